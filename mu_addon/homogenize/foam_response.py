"""A lattice's law at a point: a foam's uniaxial response, and the stability of the whole law in a state."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..fem.lattice_law import LatticeLaw
from ..fem.law_at_points import evaluate

_MOST_STEPS = 60
# Of the lateral stretch's logarithm; below it rounding decides.
_ENOUGH = 1e-13
# Points whose acoustic tensors are held at once.
_BLOCK = 500


def _growth(stretch: Array, exponent: Array) -> Array:
    """(stretch^exponent - 1)/exponent."""
    return np.asarray(np.expm1(exponent * np.log(stretch)) / exponent)


def _own(stretch: Array, p: Array) -> Array:
    """Kirchhoff stress of the principal stretches, without the volumetric part."""
    tension = stretch >= 1
    return 2 * np.where(tension, p[0], p[2]) * _growth(stretch, np.where(tension, p[1], p[3]))


def _own_slope(stretch: Array, p: Array) -> Array:
    """Derivative of `_own` by the stretch's logarithm."""
    tension = stretch >= 1
    return 2 * np.where(tension, p[0], p[2]) * stretch ** np.where(tension, p[1], p[3])


def _volume(J: Array, p: Array) -> Array:
    """Kirchhoff stress of the change of volume."""
    return p[4] * _growth(J, -p[5])


def uniaxial(parameters: Array, stretch: Array, diagonal_MPa: float = 0.0) -> tuple[Array, Array]:
    """Nominal stress in MPa and lateral stretch, (k,) each, under uniaxial stress along an axis.

    Of a foam, parameters (6,) as Foam names them, in parallel with a DiagonalStretch; cubic shear takes no
    part. stretch (k,) along the load. The lateral stretch frees the sides of stress, by Newton's method in
    its logarithm, and by halves where that leaves the bracket.
    """
    p, a = np.asarray(parameters, float), np.asarray(stretch, float)
    low, high = np.full_like(a, -5.0), np.full_like(a, 5.0)
    t = np.zeros_like(a)
    for _ in range(_MOST_STEPS):
        b = np.exp(t)
        J, trace = a * b * b, (a * a + 2 * b * b - 3) / 2
        value = _own(b, p) + _volume(J, p) + diagonal_MPa * trace * b * b
        slope = _own_slope(b, p) + 2 * p[4] * J ** -p[5] + 2 * diagonal_MPa * b * b * (b * b + trace)
        low, high = np.where(value < 0, t, low), np.where(value > 0, t, high)
        new = t - value / np.where(slope > 0, slope, np.inf)
        inside = (new > low) & (new < high) & (slope > 0)
        new = np.where(inside | (value == 0), np.where(value == 0, t, new), (low + high) / 2)
        done = np.abs(new - t).max(initial=0.0) < _ENOUGH
        t = new
        if done:
            break
    b = np.exp(t)
    trace = (a * a + 2 * b * b - 3) / 2
    return (_own(a, p) + _volume(a * b * b, p)) / a + diagonal_MPa * trace * a, b


def small_strain(
    parameters: Array, shear_MPa: float = 0.0, diagonal_MPa: float = 0.0
) -> tuple[float, float, float]:
    """Young's modulus in MPa and Poisson's ratio along an axis, and C44 in MPa, at small strain.

    Of a foam, parameters (6,) as `Foam` names them with mu the mean of both sides, cubic shear of shear_MPa
    and diagonal stretch of diagonal_MPa in parallel.
    """
    mu, lame = (parameters[0] + parameters[2]) / 2, parameters[4] + diagonal_MPa
    E = mu * (3 * lame + 2 * mu) / (lame + mu)
    return float(E), float(lame / (2 * (lame + mu))), float(mu + shear_MPa)


def directions(count: int = 200) -> Array:
    """Unit vectors (count + 17, 3): `count` spread evenly over a half sphere, and those between the axes.

    The first lie on a spiral with golden-angle turns; the last are all with components of equal size or 0,
    for z >= 0.
    """
    z = (np.arange(count) + 0.5) / count
    turn = np.pi * (3 - 5**0.5) * np.arange(count)
    spread = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)
    grid = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    grid = grid[np.any(grid != 0, axis=1)]
    return np.concatenate([spread, grid / np.linalg.norm(grid, axis=1)[:, None]])


def ellipticity(law: LatticeLaw, F: Array) -> Array:
    """Least stiffness (n,) in MPa against a plane wave of any polarisation, at F (n, 3, 3).

    The smallest eigenvalue of the acoustic tensor over `directions()`. Positive: strongly elliptic, so that
    no band of localised strain forms.
    """
    A = np.sum([evaluate(layer, F, row).tangent for layer, row in law.layers], axis=0)
    n = directions()
    found = []
    for part in np.array_split(A.reshape(-1, 3, 3, 3, 3), -(-len(A) // _BLOCK)):
        acoustic = np.einsum("fijkl,dj,dl->fdik", part, n, n, optimize=True)
        found.append(np.linalg.eigvalsh(acoustic)[..., 0].min(axis=1))
    return np.concatenate(found)
