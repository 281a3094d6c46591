"""The valid value nearest to a parameter's present one, and parameters tied by rules."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from .parameters import SECTIONS, Unit
from .quantity import describe
from .rules import RuleError

STEPS = 240
"""Number of values between a parameter's bounds that are tried."""
MOST_REPAIRS = 12
DIGITS = 3
"""Decimals of the value found: whole micrometres."""


def tied(given: dict[str, Any]) -> dict[str, Any]:
    """Parameters with the one that a rule ties to one of them: the bladder is two cells wide.

    Nodes meet the bladder apices only so. Where both are given, the cell drives the bladder.
    """
    if "cell_mm" in given:
        return {**given, "bladder_diameter_mm": 2.0 * given["cell_mm"]}
    if "bladder_diameter_mm" in given:
        return {**given, "cell_mm": 0.5 * given["bladder_diameter_mm"]}
    return given


@attrs.frozen
class Repair:
    """A broken rule, and the value of a parameter that repairs it; None where a person must decide."""

    error: InputError
    section: str = ""
    name: str = ""
    value: float | int | None = None


def repairs(sections: Mapping[str, Any], scale: float) -> list[Repair]:
    """Every broken rule of a unit's sections, in order, each with a value that repairs it.

    Each value is the nearest round one with those before it set; the list ends at the first rule without one.
    """
    found: list[Repair] = []
    now = dict(sections)
    while len(found) < MOST_REPAIRS:
        error = _broken(now, scale)
        if error is None:
            break
        repair = _repair(now, scale, error)
        found.append(repair)
        if repair.value is None:
            break
        now[repair.section] = attrs.evolve(now[repair.section], **tied({repair.name: repair.value}))
    return found


def _broken(sections: Mapping[str, Any], scale: float) -> InputError | None:
    try:
        Unit(scale=scale, **sections)
    except InputError as error:
        return error
    return None


def _repair(sections: Mapping[str, Any], scale: float, error: InputError) -> Repair:
    place = re.match(r"\[(\w+)\] (\w+)", error.where)
    if not isinstance(error, RuleError) or place is None:
        return Repair(error)
    section, name = place.groups()

    def mends(changed: Mapping[str, Any]) -> bool:
        left = _broken(changed, scale)
        return left is None or (isinstance(left, RuleError) and _later(left, error))

    value = nearest_fit(sections, scale, section, name, mends)
    if isinstance(value, float):
        present = getattr(sections[section], name)
        value = _rounded(value, present, lambda v: mends(_with(sections, section, name, v)))
    return Repair(error, section, name, value)


def _later(left: RuleError, error: RuleError) -> bool:
    return left.order > error.order or (left.order == error.order and left.rule != error.rule)


def _rounded(value: float, present: float, fits: Callable[[float], bool]) -> float:
    """A valid value, up to a twentieth further from the present one, in as few decimals as possible."""
    for digits in range(DIGITS):
        step = 10.0**-digits
        away = math.ceil(value / step - 1e-9) if value > present else math.floor(value / step + 1e-9)
        found = round(away * step, digits)
        if abs(found - value) <= 0.05 * abs(value) and fits(found):
            return found
    return value


def _with(sections: Mapping[str, Any], section: str, name: str, value: Any) -> dict[str, Any]:
    return {**sections, section: attrs.evolve(sections[section], **tied({name: value}))}


def nearest_fit(
    sections: Mapping[str, Any],
    scale: float,
    section: str,
    name: str,
    enough: Callable[[Mapping[str, Any]], bool] | None = None,
) -> float | int | None:
    """Valid value of `section.name` nearest to its present one; None where none makes a unit.

    sections: the unit's sections by name, which break a rule together; scale: the unit's. All other
    parameters stay. enough: test of the sections in place of making a unit.
    """
    present = getattr(sections[section], name)
    every: tuple[Any, ...] = SECTIONS
    (core,) = (s for s in every if s.section == section)
    d = next(d for d in describe(core) if d.name == name)

    def fits(value: float | int) -> bool:
        try:
            changed = _with(sections, section, name, value)
        except InputError:
            return False
        return _broken(changed, scale) is None if enough is None else enough(changed)

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
    """Valid value nearest to `present` on the way to a valid bound, in whole micrometres."""
    # Increasingly far apart: the first valid one is near, if there is any.
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
