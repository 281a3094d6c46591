"""What ties of any mesh must keep."""

import numpy as np


def require_linear_motions_kept(mesh):
    """A linear motion of what is not tied is one of what is."""
    gradient = np.array([[0.01, 0.02, -0.03], [0.0, 0.04, 0.01], [0.05, -0.02, 0.03]])
    exact = mesh.nodes @ gradient.T
    u = exact.copy()
    u[mesh.tied] = np.nan
    assert np.abs(mesh.following(u) - exact).max() < 1e-9
