"""Targets, bounds and objectives of a design, and a unit's distance from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import attrs

from ..design.body import Body
from ..design.rows import Row
from ..errors import InputError
from ..meshing.mesh import AXES
from ..reading import is_finite
from .quantities import (
    AirVolume,
    Angle,
    RestStiffness,
    Stretch,
    TipForce,
    TipPosition,
    WallsApart,
    Workspace,
)
from .sensor_quantities import Disturbance, SensorSlope
from .structure import Quantity
from .unit_quantities import Mass, PrintTime, WallThickness

Goal = Literal["minimise", "maximise"]

_FORM = ("kind", "name", "value", "tolerance", "low", "high", "objective", "points")
NARROW = 0.02
"""One unit of misfit of a bound without a tolerance, as a share of the bound."""
HIGHEST_kPa = 500.0
FARTHEST_WALL_MM = 200.0
YES_OR_NO = ("walls_apart", "printable")


@attrs.frozen
class Target:
    """One quantity and its goal.

    value with tolerance: within it; low, high: bounds, nan without; goal: an objective. tolerance: one unit
    of `misfit`, in the quantity's unit; line: in its file.
    """

    name: str
    kind: str
    unit: str
    quantity: Quantity | None
    value: float = math.nan
    tolerance: float = math.nan
    low: float = math.nan
    high: float = math.nan
    goal: Goal | None = None
    line: str = ""

    def misfit(self, found: float) -> float:
        """Distance of a value from the target, in tolerances, with its sign; 0 where a bound is kept.

        A target's misfit is its whole distance: within one tolerance it is met.
        """
        if self.goal is not None:
            return 0.0
        if not math.isnan(self.value):
            return (found - self.value) / self.tolerance
        if not math.isnan(self.low) and found < self.low:
            return (found - self.low) / self.tolerance
        if not math.isnan(self.high) and found > self.high:
            return (found - self.high) / self.tolerance
        return 0.0

    def met(self, found: float, margin: float = 0.0) -> bool:
        """True if a value meets it: a target within its tolerance, a bound to a millionth of its own.

        margin: also for values this far to either side.
        """
        least = 1.0 if not math.isnan(self.value) else 1e-6
        return all(abs(self.misfit(v)) <= least for v in (found - margin, found, found + margin))

    @property
    def words(self) -> str:
        """The target as text."""
        unit = f" {self.unit}" if self.unit else ""
        if self.kind in YES_OR_NO:
            return "yes"
        if self.goal is not None:
            return "as small as possible" if self.goal == "minimise" else "as large as possible"
        if not math.isnan(self.value):
            return f"{self.value:g} ± {self.tolerance:g}{unit}"
        parts = [
            f"at {word} {bound:g}{unit}"
            for word, bound in (("least", self.low), ("most", self.high))
            if not math.isnan(bound)
        ]
        return " and ".join(parts)


@attrs.frozen
class Supplies:
    """Further inputs of targets: elongation at break as a ratio, density in g/ml, a printer, paths.

    has_gravity: the unit bends under its weight at 0 kPa. path_is_free: a target may omit its path, which is
    then the free one; body: in place of the lattice's box, or None.
    """

    elongation: float
    density_g_per_ml: float
    printer: Any
    paths: Sequence[str]
    has_gravity: bool = False
    path_is_free: bool = False
    body: Body | None = None


def read_targets(rows: Sequence[Row], supplies: Supplies) -> list[Target]:
    """The targets of [[target]] tables.

    A curve of points is a target a point. `printable` adds the printer's least wall as a bound for the
    search. Raises InputError that names key and line.
    """
    found: list[Target] = []
    for row in rows:
        for target in _targets(row, supplies):
            if target.name in {t.name for t in found}:
                raise row.refusal(f"two targets are named {target.name!r}", "name", "give one of them a name")
            found.append(target)
    found += [_of_printer(t, supplies) for t in found if t.kind == "printable"]
    if not any(t.kind not in ("printable", "wall_thickness") for t in found):
        raise InputError(
            "no target is given", "[[target]]",
            'add [[target]] with kind = "angle", pressure_kPa = 30 and low = 40',
        )  # fmt: skip
    return found


def _of_printer(printable: Target, supplies: Supplies) -> Target:
    """Bound on the wall that the print check uses."""
    least, name = supplies.printer["wall_mm"], f"{printable.name}: thinnest wall"
    return Target(
        name, "wall_thickness", "mm", WallThickness(name), tolerance=NARROW * least, low=least,
        line=printable.line,
    )  # fmt: skip


def _targets(row: Row, supplies: Supplies) -> list[Target]:
    kind = row.one_of("kind", list(KINDS))
    row.require_keys((*_FORM, *KINDS[kind].keys), f" of {kind}")
    if "points" in row.table:
        return _curve(row, supplies)
    name = row.table.get("name", _name(kind, row.table))
    if not isinstance(name, str) or not name.strip() or len(name) > 60 or not name.isprintable():
        raise row.refusal(f"name = {name!r} is not a name", "name", "write a short text in quotes")
    quantity, unit = KINDS[kind].made(_Asked(row, kind, name, supplies)), KINDS[kind].unit
    if kind in YES_OR_NO:
        row.refuse(("value", "tolerance", "low", "high", "objective"), f"{kind} is a yes or a no")
        return [Target(name, kind, unit, quantity, tolerance=1.0, low=1.0, line=row.where)]
    return [Target(name, kind, unit, quantity, **_goal(row, kind), line=row.where)]


def _name(kind: str, table: Mapping[str, Any]) -> str:
    """A name from the quantity and its pressure or axis: "angle at 30 kPa", "stiffness along x"."""
    words = kind.replace("_", " ")
    for key, before, unit in (
        ("region", "of", ""), ("path", "of", ""), ("pressure_kPa", "at", " kPa"),
        ("gap_mm", "on a wall at", " mm"), ("direction", "along", ""),
    ):  # fmt: skip
        value = table.get(key)
        if unit and is_finite(value):
            words += f" {before} {value:g}{unit}"
        elif not unit and key in table:
            words += f" {before} {value}"
    return words


def _goal(row: Row, kind: str) -> dict[str, Any]:
    """Goal, or value or bounds with their tolerance; raises InputError."""
    table = row.table
    bounds = [key for key in ("low", "high") if key in table]
    if ("value" in table) + bool(bounds) + ("objective" in table) != 1:
        raise InputError(
            f"{kind} must have either value and tolerance, or low and high, or objective", row.where,
            'write value = 40, tolerance = 1; or low = 40; or objective = "minimise"',
        )  # fmt: skip
    if "objective" in table:
        row.refuse(("tolerance",), "an objective has no tolerance")
        return {"goal": row.one_of("objective", ("minimise", "maximise"))}
    if "value" in table and "tolerance" not in table:
        raise row.refusal("a value has no tolerance", "tolerance", "write tolerance = ..")
    found = {key: row.number(key) for key in bounds or ("value",)}
    if found.get("low", -math.inf) >= found.get("high", math.inf):
        raise row.refusal("low is not below high", "low", "exchange the two")
    usual = NARROW * (max(abs(v) for v in found.values()) or 1.0)
    found["tolerance"] = row.number("tolerance") if "tolerance" in table else usual
    if found["tolerance"] <= 0:
        what = f"tolerance = {found['tolerance']:g} is not positive"
        raise row.refusal(what, "tolerance", "give more than 0")
    return found


def _curve(row: Row, supplies: Supplies) -> list[Target]:
    """A target at every point (pressure in kPa, value) of a curve."""
    points, kind = row.table["points"], row.table["kind"]
    good = isinstance(points, list) and len(points) >= 2
    if not good or not all(isinstance(p, list) and len(p) == 2 and all(map(is_finite, p)) for p in points):
        raise row.refusal(f"points = {points!r} is not a curve", "points", "write [[-15, -20], [30, 40]]")
    if "pressure_kPa" not in KINDS[kind].keys:
        raise row.refusal(f"{kind} has no curve", "points", "give a value")
    row.refuse(("value", "low", "high", "objective", "pressure_kPa"), "points give it already")
    rest = {key: v for key, v in row.table.items() if key not in ("points", "name")}
    return [
        target
        for pressure, value in points
        for target in _targets(
            attrs.evolve(row, table={**rest, "pressure_kPa": pressure, "value": value}), supplies
        )
    ]


@attrs.frozen
class _Asked:
    """The table of a target: the values of its quantity, which raise InputError."""

    row: Row
    kind: str
    name: str
    supplies: Supplies

    def pressure(self, rest: bool = False) -> float:
        """A pressure in kPa. rest: it may be 0."""
        found = self.row.number("pressure_kPa", -HIGHEST_kPa, HIGHEST_kPa, "kPa")
        if found == 0 and not rest:
            raise self.row.refusal(
                f"{self.kind} at 0 kPa is that of the unit at rest", "pressure_kPa",
                "give another; with orientation_deg, under its weight, an angle or a tip position may be at "
                "0",
            )  # fmt: skip
        return found

    @property
    def bent(self) -> float:
        """A pressure in kPa that bends the unit, or 0 where its weight does."""
        return self.pressure(self.supplies.has_gravity)

    @property
    def pressures(self) -> tuple[float, ...]:
        """Pressures in kPa, without 0."""
        given = self.row.table.get("pressures_kPa")
        if not isinstance(given, list) or not given or not all(is_finite(p) for p in given):
            what = f"pressures_kPa = {given!r} is not a list of pressures"
            raise self.row.refusal(what, "pressures_kPa", "write pressures_kPa = [-15, 30]")
        found = tuple(sorted({float(p) for p in given} - {0.0}))
        if not found or max(map(abs, found)) > HIGHEST_kPa:
            raise self.row.refusal(
                f"pressures_kPa = {given!r} is out of bounds, or 0 alone", "pressures_kPa",
                f"give {-HIGHEST_kPa:g} to {HIGHEST_kPa:g} kPa",
            )  # fmt: skip
        return found

    @property
    def path(self) -> str:
        """A path of the unit, "" where it is free."""
        if self.supplies.path_is_free and "path" not in self.row.table:
            return ""
        return self.row.one_of("path", self.supplies.paths, why="not a path of the unit")

    @property
    def region(self) -> str:
        """Wall or struts."""
        return self.row.one_of("region", ("wall", "struts"), "wall")


def _tip_force(asked: _Asked) -> TipForce:
    if asked.pressure() < 0:
        raise asked.row.refusal(
            "the wall is on the side toward which pressure bends the unit", "pressure_kPa",
            "give a pressure above 0",
        )  # fmt: skip
    gap = asked.row.number("gap_mm", 0.0, FARTHEST_WALL_MM, "mm") if "gap_mm" in asked.row.table else 0.0
    return TipForce(asked.name, asked.pressure(), gap)


def _tip_position(asked: _Asked) -> TipPosition:
    pressure = asked.bent
    direction = asked.row.one_of("direction", ("y", "z"), "y", "one that the tip does not move in")
    return TipPosition(asked.name, pressure, direction)


@attrs.frozen
class Kind:
    """A kind of target: unit of its value, its keys besides those of every kind, its quantity from these."""

    unit: str
    keys: tuple[str, ...]
    made: Callable[[_Asked], Quantity | None]


_AT, _AT_SOME = ("pressure_kPa",), ("pressures_kPa", "path")
KINDS: dict[str, Kind] = {
    "angle": Kind("deg", _AT, lambda a: Angle(a.name, a.bent)),
    "tip_force": Kind("N", (*_AT, "gap_mm"), _tip_force),
    "tip_position": Kind("mm", (*_AT, "direction"), _tip_position),
    "workspace": Kind("mm", ("pressures_kPa",), lambda a: Workspace(a.name, a.pressures)),
    "stiffness": Kind(
        "N/mm", ("direction",),
        lambda a: RestStiffness(a.name, a.row.one_of("direction", AXES, why="not an axis")),
    ),
    "stretch": Kind("", (*_AT, "region"), lambda a: Stretch(a.name, a.pressure(), a.region)),
    "safety": Kind(
        "", (*_AT, "region"), lambda a: Stretch(a.name, a.pressure(), a.region, a.supplies.elongation)
    ),
    "air_volume": Kind(
        "ml", _AT,
        lambda a: AirVolume(a.name, a.pressure(rest=True) if "pressure_kPa" in a.row.table else 0.0),
    ),
    "mass": Kind(
        "g", (), lambda a: Mass(a.name, a.supplies.density_g_per_ml, a.supplies.printer, body=a.supplies.body)
    ),
    "print_time": Kind("h", (), lambda a: PrintTime(a.name, a.supplies.printer)),
    "wall_thickness": Kind("mm", (), lambda a: WallThickness(a.name)),
    "deviation": Kind("mm", _AT_SOME, lambda a: Disturbance(a.name, a.path, a.pressures)),
    "sensor_slope": Kind("1/deg", _AT_SOME, lambda a: SensorSlope(a.name, a.path, a.pressures)),
    "walls_apart": Kind("", _AT, lambda a: WallsApart(a.name, a.pressure())),
    "printable": Kind("", (), lambda a: None),
}  # fmt: skip
