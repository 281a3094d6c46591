"""Walls that differ from chamber to chamber: factors on the wall, and the thickness between two of them.

A chamber's factor holds at its apex. Between two apices the factor follows a cubic with zero slope at both
ends, so that the cavity has no kink. Below the first and above the last apex it is constant.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..arrays import Array
from .factor_list import FactorList

WALLS = FactorList("chambers", "wall_factors", ("number",), "a chamber and a factor", "2")
"""Chambers count from 1 at the inlet."""


def factors_by_chamber(text: str, count: int) -> tuple[float, ...]:
    """The factor of each of `count` chambers, () where all are 1. Raises InputError for a chamber beyond."""
    factors = {chamber: factor for (chamber,), factor in WALLS.parsed(text).items() if chamber is not None}
    beyond = [chamber for chamber in factors if not 1 <= chamber <= count]
    if beyond:
        raise WALLS.refused(
            f"there is no chamber {beyond[0]}", f"chambers count from 1 at the inlet to {count} at the tip"
        )
    return tuple(factors.get(k + 1, 1.0) for k in range(count)) if factors else ()


def factor_at(factors: Iterable[float], cell: float, z: Array) -> tuple[Array, Array]:
    """Factor and its slope in 1/mm at heights z in mm (any shape), from one factor a chamber of pitch `cell`.

    >>> factor_at((1.0, 2.0), 10.0, np.array([0.0, 10.0, 15.0]))[0].tolist()
    [1.0, 1.5, 2.0]
    """
    values = np.array(tuple(factors))
    place = np.clip(np.asarray(z, float) / cell - 0.5, 0.0, len(values) - 1.0)
    low = np.minimum(place.astype(int), max(len(values) - 2, 0))
    t = place - low
    start, end = values[low], values[np.minimum(low + 1, len(values) - 1)]
    return start + (end - start) * t**2 * (3.0 - 2.0 * t), (end - start) * 6.0 * t * (1.0 - t) / cell
