"""Pressures that bring a chain's tip to a point: Gauss and Newton's method within bounds."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError, InputError
from .chain import Chain, ChainState

# Weight in the minimised sum: 10 MPa against a millimetre, so that of many answers the one with the lowest
# pressures is taken.
_PER_KPA = 1e-4
_MOST_STEPS = 60
_CONVERGED_KPA = 1e-4


@attrs.frozen(eq=False)
class Reach:
    """Pressures (n,) in kPa, the state there, and the distance of its tip from the point, in mm.

    at_bound (n,): mask of units whose pressure is at the end of their joint's range. iterations: number of
    solutions of the chain.
    """

    pressures_kPa: Array
    state: ChainState
    miss_mm: float
    at_bound: Array
    iterations: int


def reach_point(
    chain: Chain,
    point_mm: Array,
    low_kPa: Array | None = None,
    high_kPa: Array | None = None,
) -> Reach:
    """Pressures that bring the tip as near to a point (3,) in mm as bounds allow, low ones first.

    The point is in the frame of the chain's base. low_kPa, high_kPa (n,): bounds, by default the joints'
    ranges. The nearest stable state is followed from the chain at rest, so that another posture that reaches
    the point, too, may be missed. Raises InputError for
    invalid bounds, ConvergenceError where the chain cannot carry its loads at rest.
    """
    from scipy.optimize import lsq_linear

    ends = np.array([link.joint.pressure_kPa[[0, -1]] for link in chain.links])
    low = np.maximum(ends[:, 0], -np.inf if low_kPa is None else low_kPa)
    high = np.minimum(ends[:, 1], np.inf if high_kPa is None else high_kPa)
    point = np.asarray(point_mm, float)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise InputError(f"{point_mm!r} is not a point", "[target] reach", "give x, y and z in mm")
    if (low > high).any():
        raise InputError("a bound below another", "[target]", "give low_kPa below high_kPa")

    def cost(state: ChainState) -> float:
        away = state.tip_mm - point
        return float(away @ away + (_PER_KPA * state.pressures_kPa) @ (_PER_KPA * state.pressures_kPa))

    state = chain.at_rest()
    inside = np.clip(state.pressures_kPa, low, high)
    if not np.array_equal(inside, state.pressures_kPa):
        state = chain.reach(state, inside)
    radius, now = 0.5 * float((high - low).max()), cost(state)
    steps = 0
    while steps < _MOST_STEPS:
        steps += 1
        p = state.pressures_kPa
        matrix = np.vstack([chain.slope_of_tip(state)[3:], _PER_KPA * np.eye(len(p))])
        left = np.concatenate([point - state.tip_mm, -_PER_KPA * p])
        # lsq_linear needs room between its bounds.
        least, most = np.maximum(low - p, -radius), np.minimum(high - p, radius)
        change = lsq_linear(matrix, left, (least - 1e-9, most + 1e-9)).x
        wanted = np.clip(p + change, low, high)
        if np.abs(wanted - p).max() < _CONVERGED_KPA:
            break
        try:
            there = chain.reach(state, wanted)
            new = cost(there)
        except ConvergenceError:
            new = np.inf
        if new < now:
            predicted = float(np.sum((matrix @ (wanted - p) - left) ** 2))
            state, radius = there, radius * (2.0 if now - new > 0.5 * (now - predicted) else 1.0)
            if now - new < 1e-12 * max(now, 1e-12):
                break
            now = new
        else:
            radius = float(np.abs(wanted - p).max()) / 4
            if radius < _CONVERGED_KPA:
                break
    p = state.pressures_kPa
    at_bound = (np.abs(p - low) < 1e-6) | (np.abs(p - high) < 1e-6)
    return Reach(p, state, float(np.linalg.norm(state.tip_mm - point)), at_bound, steps)
