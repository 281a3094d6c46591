"""The printed body beside another code, the printed solid and measured lattices."""
