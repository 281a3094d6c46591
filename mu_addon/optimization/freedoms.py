"""Freedoms of a design: parameters of a unit that may change, with bounds or values."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import attrs

from ..design.factor_list import LEAST, MOST, FactorList, Place, place_text
from ..design.grading import CELLS
from ..design.parameters import SECTIONS, Unit
from ..design.quantity import Description, describe
from ..design.wall_factors import WALLS
from ..errors import InputError, did_you_mean
from ..meshing.settings import OF_CONTINUUM, require_printed
from ..toml_reader import TomlTable

SCALE = "scale"
PATH, RESIN = "path", "resin"
"""Freedoms besides a unit's parameters: the path of the sensor, and the resin of the unit."""


FACTOR_LISTS = {
    "grading.cells": (CELLS, "cells", "column, row and chamber", "0 2 *"),
    "chambers.wall_factors": (WALLS, "chamber", "chamber, counted from 1 at the inlet", "2"),
}
"""Parameters that are texts of factors by place, of which each may be free: "grading.cells[0 2 *]".

With the key of a [[freedom]] table that names the place, its notation, and an example."""


def _entry(name: str) -> tuple[str, FactorList, Place] | None:
    """Parameter, list and place of a name such as "grading.cells[0 2 *]"; None for another name."""
    match = re.fullmatch(r"([^\[]+)\[(.+)\]", name)
    if match is None or match[1] not in FACTOR_LISTS:
        return None
    factors = FACTOR_LISTS[match[1]][0]
    return match[1], factors, factors.place(match[2])


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
        listed, factors, place = entry
        return factors.parsed(parameter_of(unit, listed)).get(place, 1.0)
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
    entries: dict[str, dict[Place, float]] = {}
    for freedom, value in zip(freedoms, values, strict=True):
        for name, factor in ((freedom.name, None), *freedom.also.items()):
            own = value if factor is None else factor * value
            if entry := _entry(name):
                entries.setdefault(entry[0], {})[entry[2]] = float(own)
                continue
            section, _, key = name.rpartition(".")
            if section:
                sections.setdefault(section, {})[key] = own
            else:
                head[key] = own
    for listed, own in entries.items():
        factors, (section, _, key) = FACTOR_LISTS[listed][0], listed.partition(".")
        text = factors.text(factors.parsed(parameter_of(unit, listed)) | own)
        sections.setdefault(section, {})[key] = text
    changed = {section: attrs.evolve(getattr(unit, section), **own) for section, own in sections.items()}
    return attrs.evolve(unit, **head, **changed)


def read_freedoms(tables: Sequence[TomlTable], unit: Unit) -> list[Freedom]:
    """The freedoms of [[freedom]] tables; those with `fixed` are in the unit already, by `with_fixed`.

    Raises InputError that names key and line.
    """
    found: list[Freedom] = []
    for table in not_fixed(tables):
        freedom = _freedom(table)
        if freedom.name in {f.name for f in found}:
            raise InputError(f"{freedom.name} is listed twice", table.at(), "leave one of the two out")
        _require_start(freedom, unit, table)
        found.append(freedom)
    if not found:
        raise InputError(
            "no parameter is free",
            "[[freedom]]",
            'add [[freedom]] with parameter = "chambers.wall_mm", low = .. and high = ..',
        )
    return found


def not_fixed(tables: Sequence[TomlTable]) -> list[TomlTable]:
    """The tables of what is free."""
    return [table for table in tables if "fixed" not in table]


def with_fixed(unit: Unit, tables: Sequence[TomlTable]) -> Unit:
    """The unit with the values of [[freedom]] tables with `fixed`; raises InputError."""
    fixed = [table.only(("parameter", "fixed")) for table in tables if "fixed" in table]
    values = {_parameter(table).name: table.values["fixed"] for table in fixed}
    return changed_unit(unit, [Freedom(name) for name in values], list(values.values()))


def _parameter(table: TomlTable) -> Description:
    """Description of the parameter that a table names, by its dotted name; raises InputError."""
    known, name = parameters(), table.values.get("parameter")
    require_printed(name, table.at("parameter"))
    if not isinstance(name, str) or name not in known:
        hint = did_you_mean(name, list(known)) if isinstance(name, str) else ""
        raise InputError(
            f"parameter = {name!r} is not a parameter of a unit{hint}",
            table.at("parameter"),
            "name it as in a unit's file: chambers.wall_mm, lattice.kind, scale; or path, resin",
        )
    return known[name]._replace(name=name)


def _freedom(table: TomlTable) -> Freedom:
    if table.values.get("parameter") in (PATH, RESIN):
        name = table.only(("parameter", "values")).word("parameter")
        return Freedom(name, values=_values(table, tuple[str, ...]))
    d = _parameter(table)
    if d.name in FACTOR_LISTS and FACTOR_LISTS[d.name][1] in table:
        return _of_factor(d.name, table)
    also = _also(table.only(("parameter", "low", "high", "values", "also")))
    if "values" in table:
        table.without(("low", "high"), f"{d.name} has values")
        return Freedom(d.name, values=_values(table, tuple[Any, ...]), also=also, unit=d.unit)
    if d.type not in (float, int):
        raise InputError(f"{d.name} has no range", table.at("low"), f"write values = [..] of {d.allowed}")
    low, high = _range(table, d.low, d.high, f"{d.name} are not a range within its bounds", d.unit)
    if d.type is not int:
        return Freedom(d.name, low, high, also=also, unit=d.unit)
    if low != int(low) or high != int(high):
        raise InputError(f"{d.name} is a whole number", table.at("low"), "give whole numbers")
    return Freedom(d.name, values=tuple(range(int(low), int(high) + 1)), also=also, unit=d.unit)


def _values(table: TomlTable, hint: Any) -> tuple[Any, ...]:
    """The values of a discrete freedom, each once."""
    values = table.take("values", hint)
    if not values:
        raise InputError("the list of values is empty", table.at("values"), "give what it may be")
    return tuple(dict.fromkeys(values))


def _range(table: TomlTable, least: float, most: float, of: str, unit: str = "") -> tuple[float, float]:
    """The bounds that a table gives; raises InputError where they are no range within others."""
    low, high = table.take("low", float), table.take("high", float)
    if not least <= low < high <= most:
        remedy = f"choose from {least:g} to {most:g} {unit}".rstrip()
        raise InputError(f"low = {low:g} and high = {high:g} of {of}", table.at("low"), remedy)
    return low, high


def _of_factor(name: str, table: TomlTable) -> Freedom:
    """The factor at the place that a table names; raises InputError."""
    factors, key, what, example = FACTOR_LISTS[name]
    given = table.only(("parameter", key, "low", "high")).values[key]
    try:
        place = place_text(factors.place(str(given) if type(given) in (str, int) else "?"))
    except InputError as error:
        raise InputError(
            f"{key} = {given!r} does not give {what}", table.at(key), f'write {key} = "{example}"'
        ) from error
    low, high = _range(table, LEAST, MOST, f"{key} {place} are not a range of factors")
    return Freedom(f"{name}[{place}]", low, high)


def _also(table: TomlTable) -> dict[str, float]:
    known = parameters()
    found: dict[str, float] = table.take("also", dict[str, float], {})
    for name in found:
        if name not in known:
            what = f"also: {name} is not a parameter{did_you_mean(name, known)}"
            raise InputError(what, table.at("also"), 'write { "chambers.bladder_diameter_mm" = 2.0 }')
    return found


def _require_start(freedom: Freedom, unit: Unit, table: TomlTable) -> None:
    """Raise InputError for a value that the parameter may not have."""
    if not freedom.is_of_unit:
        return
    if entry := _entry(freedom.name):
        try:
            changed_unit(unit, [freedom], [freedom.low])
        except InputError as error:
            raise InputError(error.what, table.at(FACTOR_LISTS[entry[0]][1]), error.remedy) from error
        return
    d = parameters()[freedom.name]
    for value in freedom.values:
        fits = type(value) is d.type or (d.type is float and type(value) is int)
        within = value in d.choices if d.choices else d.type is bool or (fits and d.low <= value <= d.high)
        if not (fits and within):
            what = f"{value!r} is not a value of {freedom.name}"
            raise InputError(what, table.at("values"), f"choose {d.allowed or 'true or false'}")
