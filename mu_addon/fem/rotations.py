"""Rotations by rotation vectors."""

from __future__ import annotations

import numpy as np

from ..arrays import Array


def skew(w: Array) -> Array:
    """Matrices (..., 3, 3) of the cross product by vectors w (..., 3)."""
    w = np.asarray(w, float)
    zero = np.zeros(w.shape[:-1])
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rotation(w: Array) -> Array:
    """Rotations (..., 3, 3) by rotation vectors w (..., 3) in radians, by Rodrigues' formula."""
    w = np.asarray(w, float)
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    hat = skew(w)
    half = np.sinc(angle / (2 * np.pi))
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * hat + half**2 / 2 * (hat @ hat))


def nearest_rotations(matrices: Array) -> Array:
    """The rotations (h, 3, 3) nearest to some matrices (h, 3, 3), by Kabsch's method."""
    left, _, right = np.linalg.svd(matrices)
    # A reflection would fit no body.
    left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
    return np.asarray(left @ right)
