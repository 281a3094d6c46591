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
from ..toml_reader import TomlTable

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


def read_freedoms(tables: Sequence[TomlTable], unit: Unit) -> list[Freedom]:
    """The freedoms of [[freedom]] tables; those that are fixed only change the unit (`fixed_values`).

    Raises InputError that names key and line.
    """
    found: list[Freedom] = []
    for table in tables:
        freedom = _freedom(table)
        if freedom is None:
            continue
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


def fixed_values(tables: Sequence[TomlTable]) -> dict[str, Any]:
    """Values by name of the [[freedom]] tables with `fixed`; raises InputError for an unknown name."""
    fixed = [table.only(("parameter", "fixed")) for table in tables if "fixed" in table]
    return {_parameter(table)[0]: table.values["fixed"] for table in fixed}


def _parameter(table: TomlTable) -> tuple[str, Description]:
    known, name = parameters(), table.values.get("parameter")
    require_printed(name, table.at("parameter"))
    if not isinstance(name, str) or name not in known:
        hint = did_you_mean(name, list(known)) if isinstance(name, str) else ""
        raise InputError(
            f"parameter = {name!r} is not a parameter of a unit{hint}",
            table.at("parameter"),
            "name it as in a unit's file: chambers.wall_mm, lattice.kind, scale; or path, resin",
        )
    return name, known[name]


def _freedom(table: TomlTable) -> Freedom | None:
    if table.values.get("parameter") in (PATH, RESIN):
        name = table.only(("parameter", "values")).word("parameter")
        return Freedom(name, values=_values(table, tuple[str, ...]))
    name, d = _parameter(table)
    if "fixed" in table:
        return None
    for listed in FACTOR_LISTS:
        if name == listed.name and listed.key in table:
            return _of_factor(listed, table)
    also = _also(table.only(("parameter", "low", "high", "values", "also")))
    if "values" in table:
        if "low" in table or "high" in table:
            what = f"{name} has both bounds and values"
            raise InputError(what, table.at("values"), "write values = [..] alone, or low and high")
        return Freedom(name, values=_values(table, tuple[Any, ...]), also=also, unit=d.unit)
    low, high = table.take("low", float), table.take("high", float)
    if d.type not in (float, int):
        raise InputError(f"{name} has no range", table.at("low"), f"write values = [..] of {d.allowed}")
    if not d.low <= low < high <= d.high:
        raise InputError(
            f"low = {low:g} and high = {high:g} of {name} are not a range within its bounds",
            table.at("low"),
            f"choose from {d.low:g} to {d.high:g} {d.unit}".rstrip(),
        )
    if d.type is int:
        if low != int(low) or high != int(high):
            raise InputError(f"{name} is a whole number", table.at("low"), "give whole numbers")
        return Freedom(name, values=tuple(range(int(low), int(high) + 1)), also=also, unit=d.unit)
    return Freedom(name, low, high, also=also, unit=d.unit)


def _values(table: TomlTable, hint: Any) -> tuple[Any, ...]:
    """The values of a discrete freedom, each once."""
    values = table.take("values", hint)
    if not values:
        raise InputError("the list of values is empty", table.at("values"), "give what it may be")
    return tuple(dict.fromkeys(values))


def _of_factor(listed: FactorList, table: TomlTable) -> Freedom:
    """The factor at the place that a table names; raises InputError."""
    given = table.only(("parameter", listed.key, "low", "high")).values[listed.key]
    place = str(given) if type(given) in (str, int) and ";" not in str(given) else "?"
    what, example = listed.place
    try:
        place = listed.canonical(place)
    except InputError as error:
        raise InputError(
            f"{listed.key} = {given!r} does not give {what}",
            table.at(listed.key),
            f'write {listed.key} = "{example}"',
        ) from error
    low, high = table.take("low", float), table.take("high", float)
    if not listed.low <= low < high <= listed.high:
        raise InputError(
            f"low = {low!r} and high = {high!r} of {listed.key} {place} are not a range of factors",
            table.at("low"),
            f"choose from {listed.low:g} to {listed.high:g}",
        )
    return Freedom(f"{listed.name}[{place}]", low, high)


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
            raise InputError(error.what, table.at(entry[0].key), error.remedy) from error
        return
    d = parameters()[freedom.name]
    for value in freedom.values:
        fits = type(value) is d.type or (d.type is float and type(value) is int)
        within = value in d.choices if d.choices else d.type is bool or (fits and d.low <= value <= d.high)
        if not (fits and within):
            raise InputError(
                f"{value!r} is not a value of {freedom.name}",
                table.at("values"),
                f"choose {d.allowed or 'true or false'}",
            )
