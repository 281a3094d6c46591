"""Walls that differ from chamber to chamber: factors on the wall, and the thickness between two of them.

A chamber's factor holds at its apex. Between two apices the factor follows a cubic with zero slope at both
ends, so that the cavity has no kink. Below the first and above the last apex it is constant.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

Array = NDArray[np.float64]

LEAST, MOST = 0.5, 2.0
"""Bounds of every factor."""


def parsed(text: str) -> dict[int, float]:
    """Factors by chamber, counted from 1 at the inlet, of a text such as "1: 0.8; 6: 1.3"; raises InputError.

    >>> parsed("6: 1.3; 1: 0.80")
    {1: 0.8, 6: 1.3}
    """
    found: dict[int, float] = {}
    for entry in filter(str.strip, text.split(";")):
        match = re.fullmatch(r"\s*(\d{1,4})\s*:\s*(\S{1,40})\s*", entry)
        try:
            factor = float(match[2]) if match else math.nan
        except ValueError:
            factor = math.nan
        if match is None or not math.isfinite(factor):
            raise _refused(f"{entry.strip()[:40]!r} is not a chamber and a factor", 'write "1: 0.8; 6: 1.3"')
        if not LEAST <= factor <= MOST:
            raise _refused(
                f"the factor {factor:g} of chamber {match[1]} is out of bounds",
                f"choose a value from {LEAST:g} to {MOST:g}",
            )
        chamber = int(match[1])
        if chamber in found:
            raise _refused(f"chamber {chamber} has two factors", "give each chamber once")
        found[chamber] = factor
    return {chamber: found[chamber] for chamber in sorted(found) if found[chamber] != 1.0}


def text_of(factors: Mapping[int, float]) -> str:
    """The text of factors by chamber, as `parsed` takes it.

    >>> text_of({6: 1.3, 1: 0.8, 2: 1.0})
    '1: 0.8; 6: 1.3'
    """
    kept = sorted((chamber, float(f)) for chamber, f in factors.items() if f != 1.0)
    return "; ".join(f"{chamber}: {factor!r}" for chamber, factor in kept)


def canonical_text(text: str) -> str:
    """Canonical text of all with the same meaning; raises InputError."""
    return text_of(parsed(text))


def factors_by_chamber(factors: Mapping[int, float], count: int) -> tuple[float, ...]:
    """The factor of each of `count` chambers, () where all are 1. Raises InputError for a chamber beyond."""
    beyond = [chamber for chamber in factors if not 1 <= chamber <= count]
    if beyond:
        raise _refused(
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


def _refused(what: str, remedy: str) -> InputError:
    return InputError(what, "[chambers] wall_factors", remedy)
