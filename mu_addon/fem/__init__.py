"""Quasi-static finite elements: tetrahedra, materials and follower pressure to an equilibrium path."""
