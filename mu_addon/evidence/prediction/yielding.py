"""A material that yields, as elements side by side do that slide at strains of their own (Ishlinskii)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..effect import Effect, Parameter

Array = np.ndarray[Any, Any]

NAME = "rate_independent_hysteresis"
_HARDENING = 0.1


def yielding(kind: str) -> Effect:
    """The effect, for a kind: part of the strain stays after unloading, however slow the test."""
    return Effect(
        NAME,
        (
            Parameter(
                "per_strain",
                "",
                0.0,
                200.0,
                0.0,
                (5.0, 20.0, 60.0),
                "1 over the mean strain at which it yields: glassy polymers 0.02 to 0.1",
            ),
            Parameter(
                "hardening", "", 0.0, 0.9, _HARDENING, (_HARDENING,), "share that never yields: 0.01 to 0.3"
            ),
        ),
        (kind,),
        "the material yields: part of its strain stays after unloading, however slow the test",
        "loops to several strains, to zero stress and at two rates a decade apart",
    )


def elastic_strain(strain: Array, values: Mapping[str, float]) -> Array:
    """Strain (n,) that stress goes by, of the strain (n,) of a new specimen in the order it was strained.

    values: by "effect.parameter", see `yielding`. First loading to e gives h e + (1 - h) m (1 - exp(-e/m)),
    with the mean yield strain m and the share h that never yields; after a reversal the same with twice m
    (Masing 1926).
    """
    per_strain = values.get(f"{NAME}.per_strain", 0.0)
    if not per_strain:
        return strain
    hardening = values.get(f"{NAME}.hardening", _HARDENING)

    def first(e: float) -> float:
        # Of a mean strain m beyond all numbers it is e itself, and m alone would be infinite.
        x = abs(e) * per_strain
        return hardening * e + (1.0 - hardening) * e * (-math.expm1(-x) / x if x else 1.0)

    found = []
    # Where the way turned, in pairs of strain and elastic strain, as far as the material remembers.
    turns = [(0.0, 0.0)]
    last, elastic, rising = 0.0, 0.0, True
    for e in strain.tolist():
        if e != last and (e > last) != rising:
            rising = e > last
            if turns[-1] != (last, elastic):
                turns.append((last, elastic))
        # A loop that closes is forgotten, and so is the first turn beyond its mirror image.
        while len(turns) > 2 and (e > turns[-2][0] if rising else e < turns[-2][0]):
            del turns[-2:]
        if len(turns) == 2 and abs(e) > abs(turns[1][0]):
            del turns[1]
        at, then = turns[-1]
        last, elastic = e, first(e) if len(turns) == 1 else then + 2.0 * first(0.5 * (e - at))
        found.append(elastic)
    return np.array(found)
