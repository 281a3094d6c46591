"""Rigid motions of space as 4 x 4 matrices, their logarithms, and how a logarithm changes with a motion.

A motion g holds a rotation R and a translation t, x -> R x + t. Its logarithm eta = (omega, v), a rotation
vector in radians and a velocity in mm, is the constant twist that gives g in unit time. Along a beam it is
the constant strain times the length. Twists are spatial: g' = [xi] g with xi = (omega, v), so that a point x
moves by omega x + v. Source: Sonneville, Cardona, Bruels, Computer Methods in Applied Mechanics and
Engineering 268 (2014); Murray, Li, Sastry, *A Mathematical Introduction to Robotic Manipulation*.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..fem.rotations import rotation, skew

# Of the series of a motion's exponential and of its slope: rotations stay below pi, and pi^30/30! is 3e-18.
_TERMS = 30
# Below this angle in radians, a rotation's logarithm is its skew part.
_SMALL = 1e-8


def rotation_vector(r: Array) -> Array:
    """Rotation vectors (..., 3) in radians, shorter than pi, of rotations r (..., 3, 3)."""
    r = np.asarray(r, float)
    twice = np.stack(
        [r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1
    )
    sine = np.linalg.norm(twice, axis=-1) / 2
    cosine = (np.trace(r, axis1=-2, axis2=-1) - 1) / 2
    angle = np.arctan2(sine, cosine)
    factor = np.where(sine > _SMALL, angle / np.where(sine > _SMALL, 2 * sine, 1.0), 0.5)
    return np.asarray(factor[..., None] * twice)


def motion(r: Array, t: Array) -> Array:
    """Motions (..., 4, 4) of rotations r (..., 3, 3) and translations t (..., 3) in mm."""
    r, t = np.asarray(r, float), np.asarray(t, float)
    found = np.zeros((*r.shape[:-2], 4, 4))
    found[..., :3, :3], found[..., :3, 3], found[..., 3, 3] = r, t, 1.0
    return found


def inverse(g: Array) -> Array:
    """Inverse motions (..., 4, 4)."""
    r = np.swapaxes(g[..., :3, :3], -1, -2)
    return motion(r, -np.einsum("...ij,...j->...i", r, g[..., :3, 3]))


def exponential(eta: Array) -> Array:
    """Motions (..., 4, 4) of logarithms eta (..., 6)."""
    eta = np.asarray(eta, float)
    return motion(rotation(eta[..., :3]), np.einsum("...ij,...j->...i", _slope3(eta[..., :3]), eta[..., 3:]))


def logarithm(g: Array) -> Array:
    """Logarithms (..., 6) of motions g (..., 4, 4) that turn by less than pi."""
    w = rotation_vector(g[..., :3, :3])
    v = np.linalg.solve(_slope3(w), g[..., :3, 3, None])[..., 0]
    return np.concatenate([w, v], axis=-1)


def slope(eta: Array) -> Array:
    """Matrices (..., 6, 6) from a change of logarithms eta (..., 6) to the spatial twist of their motion.

    The left Jacobian of the exponential, sum of ad(eta)^n / (n + 1)!.
    """
    eta = np.asarray(eta, float)
    return _series(adjoint_of_twist(eta))


def adjoint_of_twist(eta: Array) -> Array:
    """Matrices (..., 6, 6) of the Lie bracket with twists eta (..., 6)."""
    w, v = skew(eta[..., :3]), skew(eta[..., 3:])
    found = np.zeros((*w.shape[:-2], 6, 6))
    found[..., :3, :3] = found[..., 3:, 3:] = w
    found[..., 3:, :3] = v
    return found


def _slope3(w: Array) -> Array:
    """Left Jacobians (..., 3, 3) of rotation vectors w (..., 3)."""
    return _series(skew(w))


def _series(a: Array) -> Array:
    """Sum of a^n / (n + 1)! of matrices a (..., k, k)."""
    term = np.broadcast_to(np.eye(a.shape[-1]), a.shape)
    total = term.copy()
    for n in range(2, _TERMS):
        term = term @ a / n
        total += term
    return total
