"""Directions that columns span."""

from __future__ import annotations

import numpy as np

from ..arrays import Array

# Directions of columns of unit length that hold less than this are none.
NEAR = 1e-6


def unit(columns: Array) -> Array:
    """Columns (n, d) of unit length; zeros stay."""
    length = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(length > 0, length, 1.0))


def basis(columns: Array, near: float = NEAR) -> Array:
    """Orthonormal basis (n, k) of columns (n, d), each taken of unit length, near dependences left out."""
    u, sizes, _ = np.linalg.svd(unit(columns), full_matrices=False)
    return np.asarray(u[:, sizes > near])
