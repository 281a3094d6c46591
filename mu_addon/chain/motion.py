"""The motion of a chain over time, under its pressures or to a point."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError
from .chain import Chain, ChainState
from .inverse import Reach, reach_point
from .pressures import Pressures


@attrs.frozen(eq=False)
class Motion:
    """States of a chain at times (t,) in s, and the one at rest; reach: how its tip came to a point.

    processor_s: processor's time for all of it.
    """

    rest: ChainState
    time_s: Array
    states: tuple[ChainState, ...]
    reach: Reach | None
    processor_s: float

    @property
    def largest_used_range(self) -> float:
        """Largest share of a joint's learned range that a state uses."""
        return max(float(state.used_range.max()) for state in self.states)


def move(
    chain: Chain,
    protocol: Pressures | None,
    times: int,
    point: tuple[float, ...],
    bounds_kPa: Sequence[tuple[float, float]],
    report: Callable[[float], None] = lambda share: None,
) -> Motion:
    """The motion under a protocol, or without one to the pressures that bring the tip to a point (3,) in mm.

    bounds_kPa: of each unit's pressure, to reach the point. report: called with the share done. Raises
    ConvergenceError where a state has no equilibrium.
    """
    begun = time.process_time()
    rest, reach = chain.at_rest(), None
    if protocol is not None:
        time_s, pressures = protocol.sample(times)
    else:
        low, high = np.array(bounds_kPa, float).T
        reach = reach_point(chain, np.array(point), low, high)
        time_s = np.linspace(0.0, 1.0, times)
        pressures = time_s[:, None] * reach.pressures_kPa
    states: list[ChainState] = []
    for k, row in enumerate(pressures):
        try:
            states.append(chain.reach(states[-1] if states else rest, row))
        except ConvergenceError as error:
            if not states:
                raise
            words = ", ".join(f"{p:.4g}" for p in row)
            raise ConvergenceError(
                f"no equilibrium of the chain at {words} kPa: {error.what}", error.where, error.remedy
            ) from None
        report((k + 1) / len(pressures))
    return Motion(rest, time_s, tuple(states), reach, time.process_time() - begun)
