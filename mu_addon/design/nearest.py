"""The value nearest to a parameter's present one that keeps every rule, and parameters that rules tie."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from .parameters import SECTIONS, Unit
from .quantity import describe

STEPS = 240
"""Places between a parameter's bounds at which a value that fits is looked for."""
DIGITS = 3
"""Decimals of the value that is found: whole micrometres."""


def tied(given: dict[str, Any]) -> dict[str, Any]:
    """Parameters with the one that a rule ties to one of them: the bladder is two cells wide.

    Nodes meet the bladder apices only so. Where both are given, the cell drives the bladder.
    """
    if "cell_mm" in given:
        return {**given, "bladder_diameter_mm": 2.0 * given["cell_mm"]}
    if "bladder_diameter_mm" in given:
        return {**given, "cell_mm": 0.5 * given["bladder_diameter_mm"]}
    return given


def nearest_fit(sections: Mapping[str, Any], scale: float, section: str, name: str) -> float | int | None:
    """The value of `section.name` nearest to its present one that makes a unit; None where none does.

    sections: the unit's sections by name, which break a rule together; scale: the unit's. All other
    parameters stay as they are.
    """
    present = getattr(sections[section], name)
    every: tuple[Any, ...] = SECTIONS
    (core,) = (s for s in every if s.section == section)
    d = next(d for d in describe(core) if d.name == name)

    def fits(value: float | int) -> bool:
        try:
            changed = attrs.evolve(sections[section], **tied({name: value}))
            Unit(scale=scale, **{**sections, section: changed})
        except InputError:
            return False
        return True

    if d.type is int:
        whole = sorted(range(int(d.low), int(d.high) + 1), key=lambda value: abs(value - present))
        return next((value for value in whole if fits(value)), None)
    if d.type is not float:
        return None
    if fits(present):
        return float(present)
    found = [value for side in (d.low, d.high) if (value := _toward(side, present, fits)) is not None]
    return min(found, key=lambda value: abs(value - present), default=None)


def _toward(bound: float, present: float, fits: Callable[[float], bool]) -> float | None:
    """The value nearest to `present` on the way to a bound that fits, in whole micrometres."""
    # Ever further apart: the first that fits is near, if any is.
    way = (bound - present) * np.linspace(0.0, 1.0, STEPS + 1) ** 2
    bad = present
    for value in np.round(present + way[1:], DIGITS).tolist():
        if fits(value):
            break
        bad = value
    else:
        return None
    good, least = value, 10.0**-DIGITS
    while abs(good - bad) > 1.5 * least:
        middle = round(0.5 * (good + bad), DIGITS)
        if middle in (good, bad):
            break
        if fits(middle):
            good = middle
        else:
            bad = middle
    return float(good)
