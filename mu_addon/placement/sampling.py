"""Deviations at a few pressures instead of all: which to solve, interpolation, and its error."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..arrays import Array


def solution_order(pressure: Array, has_gravity: bool = False) -> list[list[int]]:
    """Numbers of distinct pressures (s,) in the order to solve them: two at a time, the extremes first.

    Each later pressure is the one farthest from the earlier ones and from 0, where the deviation is 0. A unit
    with weight deviates there, too: 0, if present, is then solved with the extremes.
    """
    pressure = np.asarray(pressure, float)
    left = [i for i, p in enumerate(pressure) if p or has_gravity]
    order = [i for i in (int(np.argmin(pressure)), int(np.argmax(pressure))) if i in left]
    still = [i for i in left if not pressure[i]]
    order = list(dict.fromkeys(still + order))
    while len(order) < len(left):
        known = np.append(pressure[order], 0.0)
        rest = [i for i in left if i not in order]
        order.append(rest[int(np.argmax([np.abs(pressure[i] - known).min() for i in rest]))])
    first = 2 + len(still)
    return [order[:first], *(order[i : i + 2] for i in range(first, len(order), 2))]


def polynomials(known: Array, wanted: Array) -> Array:
    """Weights (t, s) of values known at s pressures in their Lagrange polynomial at t others.

    known (s,), wanted (t,): pressures in one unit. The polynomial is 0 at no pressure, unless the value there
    is among the known ones.
    """
    weights = np.empty((len(wanted), len(known)))
    vanishes = [] if (np.asarray(known) == 0).any() else [0.0]
    for i, here in enumerate(known):
        others = np.append(vanishes, np.delete(known, i))
        weights[:, i] = np.prod((np.asarray(wanted)[:, None] - others) / (here - others), axis=1)
    return weights


def between(pressure: Array, known: Mapping[int, Array]) -> Array:
    """Differences (s, ...) at all pressures (s,), from those at some of them, by number.

    By their polynomial, see `polynomials`; known values stay. Pressures in any unit.
    """
    pressure = np.asarray(pressure, float)
    numbers = list(known)
    values = np.array([known[i] for i in numbers])
    found: Array = np.tensordot(polynomials(pressure[numbers], pressure), values, axes=1)
    for i, value in known.items():
        found[i] = value
    return found


def relative_error(fuller: Array, sparser: Array, weight: Array) -> float:
    """Relative error of the sparser of two sets of differences (s, jobs, p, 3) in mm against the fuller.

    weight (s,): instants at each pressure. The largest of any job, over its mean deviation. By the triangle
    inequality it bounds the difference of the two mean deviations.
    """

    def mean(values: Array) -> Array:
        return np.einsum("sjp,s->j", np.linalg.norm(values, axis=3), weight)

    size = mean(fuller)
    apart = mean(fuller - sparser)
    return float(np.divide(apart, size, out=np.zeros_like(apart), where=size > 0).max())
