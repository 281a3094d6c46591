"""Candidates that cannot be among the best, known before all their states are solved.

J_hat is a mean over instants of a distance that is never negative. The sum over the instants solved so far,
divided by the number of all, is therefore never above J_hat.
"""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array

# Of J_hat: sums in another order differ by less.
ROUNDING = 1e-9


@attrs.frozen
class Contest:
    """The `best` candidates of least J_hat, and all within margin_mm of the least, are to be known exactly.

    every: J_hat of all others too. They are solved last, so that nothing of the best depends on them.
    """

    best: int = 1
    margin_mm: float = 0.0
    every: bool = False

    def open(self, at_least: Array, complete: Array) -> Array:
        """True for each of n candidates that is not complete and may still be among the best.

        at_least (n,): lower bounds of J_hat in mm, which are J_hat where complete (n,).

        >>> bounds, complete = np.array([0.46, 0.57, 0.39, 0.73]), np.array([True, True, False, False])
        >>> Contest(best=2).open(bounds, complete).tolist()
        [False, False, True, False]
        >>> Contest(best=2, margin_mm=0.3).open(bounds, complete).tolist()
        [False, False, True, True]
        """
        known = np.sort(at_least[complete])
        if len(known) < self.best:
            return ~complete
        limit = max(known[self.best - 1], known[0] + self.margin_mm)
        return ~complete & (at_least <= limit * (1.0 + ROUNDING))


def lower_bounds(distance: Array, instants: Array) -> Array:
    """Lower bounds (n,) in mm of J_hat of n candidates, or J_hat itself where every state is solved.

    distance (s, n): mean distance over the length in mm at s states, NaN where it is not solved; instants
    (s,): number of instants at each state, 0 where it is not compared.
    """
    compared = instants > 0
    sums = np.where(np.isfinite(distance), distance, 0.0)[compared] * instants[compared, None]
    return np.asarray(sums.sum(axis=0) / instants.sum())


def first_and_rest(pressure: Array) -> tuple[list[int], list[int]]:
    """Numbers of pressures (s,) that every candidate is solved at, and of the others, in order.

    Cheap and telling ones come first: those under pressure, where nothing touches, the highest first; or
    the highest alone of a unit that is only inflated. Suction is last, the weakest first. A weight's state,
    without pressure, is among the first.

    >>> first_and_rest(np.array([-20.0, -10.0, 20.0, 40.0]))
    ([3, 2], [1, 0])
    >>> first_and_rest(np.array([10.0, 40.0]))
    ([1], [0])
    """
    falling = np.argsort(-np.asarray(pressure), kind="stable").tolist()
    first = [n for n in falling if pressure[n] >= 0.0]
    if len(first) in (0, len(falling)):
        first = [n for n in falling if n == falling[0] or not pressure[n]]
    return first, [n for n in falling if n not in first]
