"""Freedoms of a design: parameters of a unit that may change, with bounds or values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs

from ..design import grading, wall_factors
from ..design.grading import CellFactor
from ..design.parameters import SECTIONS, Unit
from ..design.quantity import Description, describe
from ..errors import InputError, did_you_mean
from ..meshing.settings import OF_CONTINUUM, require_printed

SCALE = "scale"
PATH, RESIN = "path", "resin"
"""Freedoms besides a unit's parameters: the path of the sensor, and the resin of the unit."""


@attrs.frozen
class FactorList:
    """A parameter that is a text of factors by place; each factor may be free: "grading.cells[0 2 *]".

    key: of a [[freedom]] table, names the place; place: its notation, with an example. factors: from a text,
    by the text of their place; text: the inverse; both raise InputError.
    """

    name: str
    key: str
    place: tuple[str, str]
    low: float
    high: float
    factors: Callable[[str], dict[str, float]]
    text: Callable[[Mapping[str, float]], str]

    def canonical(self, place: str) -> str:
        """Canonical text of all that name the same place; raises InputError."""
        # Any factor but 1, which would be no entry.
        [found] = self.factors(f"{place}: 1.5")
        return found

    def of(self, unit: Unit) -> dict[str, float]:
        """Factors of the unit by their place."""
        section, _, name = self.name.partition(".")
        return self.factors(getattr(getattr(unit, section), name))


def _cells_by_place(text: str) -> dict[str, float]:
    entries = grading.parsed(text)
    return {grading.cells_text([e._replace(factor=1.5)]).rpartition(":")[0]: e.factor for e in entries}


def _text_of_cells(factors: Mapping[str, float]) -> str:
    [*entries] = (
        CellFactor(*grading.parsed(f"{place}: 1.5")[0][:3], factor) for place, factor in factors.items()
    )
    return grading.cells_text(entries)


FACTOR_LISTS = (
    FactorList(
        "grading.cells",
        "cells",
        ("column, row and chamber", "0 2 *"),
        grading.LEAST,
        grading.MOST,
        _cells_by_place,
        _text_of_cells,
    ),
    FactorList(
        "chambers.wall_factors",
        "chamber",
        ("chamber, counted from 1 at the inlet", "2"),
        wall_factors.LEAST,
        wall_factors.MOST,
        lambda text: {str(chamber): factor for chamber, factor in wall_factors.parsed(text).items()},
        lambda factors: wall_factors.text_of({int(chamber): f for chamber, f in factors.items()}),
    ),
)


def _entry(name: str) -> tuple[FactorList, str] | None:
    """List and place of a name such as "grading.cells[0 2 *]"; None for another name."""
    match = re.fullmatch(r"([^\[]+)\[(.+)\]", name)
    lists = [known for known in FACTOR_LISTS if match is not None and match[1] == known.name]
    return (lists[0], match[2]) if match is not None and lists else None


@attrs.frozen
class Freedom:
    """One parameter of the unit, by its dotted name, that may change.

    "grading.cells[0 2 *]" is the factor on the struts of these cells: column, row and chamber as
    `design.grading` has them; "chambers.wall_factors[2]" that on a chamber's wall. `PATH` and `RESIN` are no
    parameters of the unit: `is_of_unit` is then False.

    low, high: bounds of a continuous one, or of whole numbers; values: those of a discrete one; also: factors
    by the names of parameters that follow it, as the bladder's diameter follows the cell.
    """

    name: str
    low: float = math.nan
    high: float = math.nan
    values: tuple[Any, ...] = ()
    also: Mapping[str, float] = attrs.field(factory=dict)
    unit: str = ""

    @property
    def discrete(self) -> bool:
        """True if it has values instead of a range."""
        return bool(self.values)

    @property
    def is_of_unit(self) -> bool:
        """True if it is a parameter of the unit."""
        return self.name not in (PATH, RESIN)

    def value_of(self, unit: Unit) -> Any:
        """Its value in a unit."""
        return parameter_of(unit, self.name)

    def place(self, value: float) -> float:
        """Position of a continuous freedom's value between the bounds, 0 to 1."""
        return (value - self.low) / (self.high - self.low)

    def at(self, place: float) -> float:
        """Value at a position, 0 to 1, to nine figures: further digits would only make a new unit."""
        value = self.low + place * (self.high - self.low)
        return min(max(float(f"{value:.9g}"), self.low), self.high)


def parameters() -> dict[str, Description]:
    """Every parameter of a printed unit by its dotted name; `scale` has no section."""
    found = {d.name: d for d in describe(Unit)}
    found |= {f"{s.section}.{d.name}": d for s in SECTIONS for d in describe(s)}  # type: ignore[attr-defined]
    return {name: d for name, d in found.items() if name not in OF_CONTINUUM}


def parameter_of(unit: Unit, name: str) -> Any:
    """Value of a unit's parameter by its dotted name."""
    if entry := _entry(name):
        listed, place = entry
        return listed.of(unit).get(listed.canonical(place), 1.0)
    found: Any = unit
    for part in name.split("."):
        found = getattr(found, part)
    return found


def changed_unit(unit: Unit, freedoms: Sequence[Freedom], values: Sequence[Any]) -> Unit:
    """The unit with other values of some freedoms, and of the parameters tied to them; raises InputError.

    All changes are made together, so that rules check the result.
    """
    sections: dict[str, dict[str, Any]] = {}
    head: dict[str, Any] = {}
    entries: dict[str, dict[str, float]] = {}
    for freedom, value in zip(freedoms, values, strict=True):
        for name, factor in ((freedom.name, None), *freedom.also.items()):
            own = value if factor is None else factor * value
            if entry := _entry(name):
                listed, place = entry
                entries.setdefault(listed.name, {})[listed.canonical(place)] = float(own)
                continue
            section, _, key = name.rpartition(".")
            if section:
                sections.setdefault(section, {})[key] = own
            else:
                head[key] = own
    for listed in FACTOR_LISTS:
        if listed.name in entries:
            section, _, key = listed.name.partition(".")
            sections.setdefault(section, {})[key] = listed.text(listed.of(unit) | entries[listed.name])
    changed = {section: attrs.evolve(getattr(unit, section), **own) for section, own in sections.items()}
    return attrs.evolve(unit, **head, **changed)


def read_freedoms(tables: Sequence[Mapping[str, Any]], where: Sequence[str], unit: Unit) -> list[Freedom]:
    """The freedoms of [[freedom]] tables; those that are fixed only change `fixed_unit`.

    where: file and line of each. Raises InputError that names key and line.
    """
    found: list[Freedom] = []
    for table, place in zip(tables, where, strict=True):
        freedom = _freedom(table, place)
        if freedom is None:
            continue
        if freedom.name in {f.name for f in found}:
            raise InputError(f"{freedom.name} is listed twice", place, "leave one of the two out")
        _require_start(freedom, unit, place)
        found.append(freedom)
    if not found:
        raise InputError(
            "no parameter is free",
            "[[freedom]]",
            'add [[freedom]] with parameter = "chambers.wall_mm", low = .. and high = ..',
        )
    return found


def fixed_values(tables: Sequence[Mapping[str, Any]], where: Sequence[str]) -> dict[str, Any]:
    """Values by name of the [[freedom]] tables with `fixed`; raises InputError for an unknown name."""
    found = {}
    for table, place in zip(tables, where, strict=True):
        if "fixed" in table:
            name, _ = _parameter(table, place)
            _require_keys(table, ("parameter", "fixed"), place)
            found[name] = table["fixed"]
    return found


def _parameter(table: Mapping[str, Any], where: str) -> tuple[str, Description]:
    known = parameters()
    name = table.get("parameter")
    require_printed(name, f"{where}, parameter")
    if not isinstance(name, str) or name not in known:
        hint = did_you_mean(name, list(known)) if isinstance(name, str) else ""
        raise InputError(
            f"parameter = {name!r} is not a parameter of a unit{hint}",
            f"{where}, parameter",
            "name it as in a unit's file: chambers.wall_mm, lattice.kind, scale; or path, resin",
        )
    return name, known[name]


def _require_keys(table: Mapping[str, Any], known: Sequence[str], where: str) -> None:
    for key in table:
        if key not in known:
            raise InputError(
                f"unknown key {key!r}{did_you_mean(key, known)}",
                f"{where}, {key}",
                f"known: {', '.join(known)}",
            )


def _freedom(table: Mapping[str, Any], where: str) -> Freedom | None:
    if table.get("parameter") in (PATH, RESIN):
        return _choice(table, where)
    name, d = _parameter(table, where)
    if "fixed" in table:
        return None
    for listed in FACTOR_LISTS:
        if name == listed.name and listed.key in table:
            return _of_factor(listed, table, where)
    _require_keys(table, ("parameter", "low", "high", "values", "also"), where)
    also = _also(table.get("also", {}), where)
    if "values" in table:
        values = table["values"]
        if "low" in table or "high" in table or not isinstance(values, list) or not values:
            raise InputError(
                f"{name} has both bounds and values, or an empty list", f"{where}, values",
                "write values = [..] alone, or low and high",
            )  # fmt: skip
        return Freedom(name, values=tuple(dict.fromkeys(values)), also=also, unit=d.unit)
    low, high = table.get("low"), table.get("high")
    for key, value in (("low", low), ("high", high)):
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(
                f"{key} = {value!r} of {name} is not a number",
                f"{where}, {key}",
                "write low = .. and high = ..",
            )
    assert isinstance(low, int | float)
    assert isinstance(high, int | float)
    if d.type not in (float, int):
        raise InputError(f"{name} has no range", f"{where}, low", f"write values = [..] of {d.allowed}")
    if not d.low <= low < high <= d.high:
        raise InputError(
            f"low = {low:g} and high = {high:g} of {name} are not a range within its bounds",
            f"{where}, low",
            f"choose from {d.low:g} to {d.high:g} {d.unit}".rstrip(),
        )
    if d.type is int:
        if low != int(low) or high != int(high):
            raise InputError(f"{name} is a whole number", f"{where}, low", "give whole numbers")
        return Freedom(name, values=tuple(range(int(low), int(high) + 1)), also=also, unit=d.unit)
    return Freedom(name, float(low), float(high), also=also, unit=d.unit)


def _choice(table: Mapping[str, Any], where: str) -> Freedom:
    """The freedom of a path or a resin; raises InputError where its values are not names."""
    name = str(table["parameter"])
    _require_keys(table, ("parameter", "values"), where)
    values = table.get("values")
    if not isinstance(values, list) or not values or not all(isinstance(v, str) for v in values):
        example = '["alpha4", "alpha7"]' if name == PATH else '["elastic-50a-v1", "my-resin.toml"]'
        raise InputError(f"{name} has no list of names", f"{where}, values", f"write values = {example}")
    return Freedom(name, values=tuple(dict.fromkeys(values)))


def _of_factor(listed: FactorList, table: Mapping[str, Any], where: str) -> Freedom:
    """The factor at the place that a table names; raises InputError."""
    _require_keys(table, ("parameter", listed.key, "low", "high"), where)
    given, low, high = (table.get(key) for key in (listed.key, "low", "high"))
    place = str(given) if isinstance(given, str | int) and not isinstance(given, bool) else "?"
    what, example = listed.place
    try:
        place = listed.canonical(place if ";" not in place else "?")
    except InputError as error:
        raise InputError(
            f"{listed.key} = {given!r} does not give {what}",
            f"{where}, {listed.key}",
            f'write {listed.key} = "{example}"',
        ) from error
    good = all(isinstance(v, int | float) and not isinstance(v, bool) for v in (low, high))
    if not good or not listed.low <= low < high <= listed.high:  # type: ignore[operator]
        raise InputError(
            f"low = {low!r} and high = {high!r} of {listed.key} {place} are not a range of factors",
            f"{where}, low",
            f"choose from {listed.low:g} to {listed.high:g}",
        )
    return Freedom(f"{listed.name}[{place}]", float(low), float(high))  # type: ignore[arg-type]


def _also(given: Any, where: str) -> dict[str, float]:
    known = parameters()
    if not isinstance(given, dict):
        raise InputError(f"also = {given!r} is not a table", f"{where}, also", 'write { "a.b" = 2.0 }')
    for name, factor in given.items():
        if name not in known or isinstance(factor, bool) or not isinstance(factor, int | float):
            raise InputError(
                f"also: {name} = {factor!r} is not a parameter and a factor",
                f"{where}, also",
                'write { "chambers.bladder_diameter_mm" = 2.0 }',
            )
    return {name: float(factor) for name, factor in given.items()}


def _require_start(freedom: Freedom, unit: Unit, where: str) -> None:
    """Raise InputError for a value that the parameter may not have."""
    if not freedom.is_of_unit:
        return
    if entry := _entry(freedom.name):
        try:
            changed_unit(unit, [freedom], [freedom.low])
        except InputError as error:
            raise InputError(error.what, f"{where}, {entry[0].key}", error.remedy) from error
        return
    d = parameters()[freedom.name]
    for value in freedom.values:
        fits = type(value) is d.type or (d.type is float and type(value) is int)
        within = value in d.choices if d.choices else d.type is bool or (fits and d.low <= value <= d.high)
        if not (fits and within):
            raise InputError(
                f"{value!r} is not a value of {freedom.name}",
                f"{where}, values",
                f"choose {d.allowed or 'true or false'}",
            )
