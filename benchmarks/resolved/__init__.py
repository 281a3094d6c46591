"""The resolved unit beside another code, the printed solid, its homogenised twin and measured lattices."""
