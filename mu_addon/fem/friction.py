"""Coulomb friction at points of a surface: slip that gives a little, then slides, under a bound that lags."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array

# Of a step's share in contact: an energy is divided by it.
_LEAST = 1e-6


@attrs.frozen(eq=False)
class Memory:
    """Memory of points (f, q) of a surface of their last committed contact, in the obstacle's frame.

    place (f, q, 3) in mm; gap (f, q), their distance, in mm; normal (f, q, 3), its gradient, and pressure (f,
    q) in MPa that bound friction; slip (f, q, 3), elastic slip, in mm; slid (f, q), the length slid so far,
    in mm. lost_mJ: energy dissipated by sliding so far.
    """

    place: Array
    gap: Array
    normal: Array
    pressure: Array
    slip: Array
    slid: Array
    lost_mJ: float = 0.0


@attrs.frozen(eq=False)
class Lag:
    """Values of friction from an earlier iterate: pressure (f, q), normal (f, q, 3), and `counts` (f, q).

    counts: the share of the way since the last committed state that is in contact, see `met`.
    """

    pressure: Array
    normal: Array
    counts: Array


def met(before: Array, gap: Array) -> Array:
    """Share (f, q) of a step that is in contact, of the distances in mm at both its ends.

    before, gap (f, q): at the start and the end, negative in contact. The distance is assumed linear over the
    step, so that an obliquely approaching point does not slip before it touches. 1 out of contact, where it
    has no effect.
    """
    away = np.maximum(before, 0.0)
    share = gap / np.where(gap < 0, gap - away, 1.0)
    return np.where(gap < 0, np.maximum(share, _LEAST), 1.0)


def slip(memory: Memory, lag: Lag, place: Array) -> Array:
    """Slip (f, q, 3) in mm in the lagged tangent plane, without sliding since the last committed state.

    place (f, q, 3) in mm: where the points are, in the obstacle's frame. The elastic slip remembered, plus
    the share of the way that was in contact, less its part along the lagged normal.
    """
    e: Array = memory.slip + lag.counts[..., None] * (place - memory.place)
    return np.asarray(e - (e * lag.normal).sum(axis=-1, keepdims=True) * lag.normal)


def energy(e: Array, bound: Array, stiffness: float) -> Array:
    """Energy (...) in mJ/mm2 whose derivative by slip e (..., 3) in mm is `traction`: Huber's function.

    bound (...) of the traction and stiffness in MPa and MPa/mm. With the bound held, a step's energy is that
    of elastic slip plus the dissipation by sliding: Coulomb's law as an incremental potential, as in Li et
    al., ACM Trans. Graph. 39 (2020) 49, but of elastic slip in place of velocity, so that sticking points do
    not creep.
    """
    size = np.linalg.norm(e, axis=-1)
    least = bound / stiffness
    return np.where(size < least, stiffness * size**2 / 2, bound * (size - least / 2))


def traction(e: Array, bound: Array, stiffness: float) -> Array:
    """Traction (..., 3) in MPa along slip e (..., 3) in mm: stiffness times slip, up to the bound (...).

    bound in MPa, stiffness in MPa/mm.
    """
    return stiffness * kept(e, bound, stiffness)[..., None] * e


def kept(e: Array, bound: Array, stiffness: float) -> Array:
    """Share (...) of slip e (..., 3) in mm that is elastic: 1 where it sticks, 0 without pressure.

    bound (...) of the traction in MPa, stiffness in MPa/mm; beyond a slip of bound/stiffness it slides.
    """
    size = np.linalg.norm(e, axis=-1)
    least = bound / stiffness
    return np.where(size > least, least / np.maximum(size, 1e-300), np.where(bound > 0, 1.0, 0.0))


def tangent(e: Array, bound: Array, stiffness: float, normal: Array) -> Array:
    """Derivative (..., 3, 3) in MPa/mm of `traction` by slip within the plane across `normal` (..., 3).

    e (..., 3) in mm, bound (...) in MPa, stiffness in MPa/mm. Symmetric: where the point slides only a turn
    of its direction is resisted.
    """
    size = np.linalg.norm(e, axis=-1)
    along = e / np.maximum(size, 1e-300)[..., None]
    plane = np.eye(3) - normal[..., :, None] * normal[..., None, :]
    share = kept(e, bound, stiffness)
    # A sliding point resists only a turn of its direction.
    turning = (
        plane - np.where(share < 1, 1.0, 0.0)[..., None, None] * along[..., :, None] * along[..., None, :]
    )
    return np.asarray(stiffness * share[..., None, None] * turning)
