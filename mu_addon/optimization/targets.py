"""Targets, bounds and objectives of a design, and a unit's distance from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import attrs

from ..design.body import Body
from ..errors import InputError
from ..meshing.mesh import AXES
from ..reading import is_finite
from ..toml_reader import TomlTable
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
from .target_kinds import AT, GAP, KINDS, OVER, PRESSURE
from .unit_quantities import Mass, PrintTime, WallThickness

Goal = Literal["minimise", "maximise"]

_FORM = ("kind", "name", "value", "tolerance", "low", "high", "objective", "points")
NARROW = 0.02
"""One unit of misfit of a bound without a tolerance, as a share of the bound."""


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
        if KINDS[self.kind].is_yes:
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


def read_targets(tables: Sequence[TomlTable], supplies: Supplies) -> list[Target]:
    """The targets of [[target]] tables.

    A curve of points is a target a point. `printable` adds the printer's least wall as a bound for the
    search. Raises InputError that names key and line.
    """
    found: list[Target] = []
    for table in tables:
        for target in _targets(table, supplies):
            if target.name in {t.name for t in found}:
                what = f"two targets are named {target.name!r}"
                raise InputError(what, table.at("name"), "give one of them a name")
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


def _targets(table: TomlTable, supplies: Supplies) -> list[Target]:
    kind = table.word("kind", tuple(KINDS))
    table.only((*_FORM, *KINDS[kind].takes))
    if "points" in table:
        return _curve(table, kind, supplies)
    name = table.word("name", default=_name(kind, table.values))
    if len(name) > 60 or not name.isprintable():
        raise InputError(f"name = {name!r} is not a name", table.at("name"), "write a short text in quotes")
    quantity, unit = _MADE[kind](_Asked(table, kind, name, supplies)), KINDS[kind].unit
    if KINDS[kind].is_yes:
        table.without(("value", "tolerance", "low", "high", "objective"), f"{kind} is a yes or a no")
        return [Target(name, kind, unit, quantity, tolerance=1.0, low=1.0, line=table.at())]
    return [Target(name, kind, unit, quantity, **_goal(table, kind), line=table.at())]


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


def _goal(table: TomlTable, kind: str) -> dict[str, Any]:
    """Goal, or value or bounds with their tolerance; raises InputError."""
    bounds = [key for key in ("low", "high") if key in table]
    if ("value" in table) + bool(bounds) + ("objective" in table) != 1:
        raise InputError(
            f"{kind} must have either value and tolerance, or low and high, or objective", table.at(),
            'write value = 40, tolerance = 1; or low = 40; or objective = "minimise"',
        )  # fmt: skip
    if "objective" in table:
        table.without(("tolerance",), "an objective has no tolerance")
        return {"goal": table.word("objective", ("minimise", "maximise"))}
    if "value" in table and "tolerance" not in table:
        raise InputError("a value has no tolerance", table.at("tolerance"), "write tolerance = ..")
    found = {key: table.number(key) for key in bounds or ("value",)}
    if found.get("low", -math.inf) >= found.get("high", math.inf):
        raise InputError("low is not below high", table.at("low"), "exchange the two")
    usual = NARROW * (max(abs(v) for v in found.values()) or 1.0)
    found["tolerance"] = table.number("tolerance", default=usual)
    if found["tolerance"] <= 0:
        what = f"tolerance = {found['tolerance']:g} is not positive"
        raise InputError(what, table.at("tolerance"), "give more than 0")
    return found


def _curve(table: TomlTable, kind: str, supplies: Supplies) -> list[Target]:
    """A target at every point (pressure in kPa, value) of a curve."""
    points = table.take("points", tuple[tuple[float, float], ...])
    if len(points) < 2:
        raise InputError("one point is no curve", table.at("points"), "write [[-15, -20], [30, 40]]")
    if AT not in KINDS[kind].takes:
        raise InputError(f"{kind} has no curve", table.at("points"), "give a value")
    table.without(("value", "low", "high", "objective", "pressure_kPa"), "points give it already")
    rest = {key: v for key, v in table.values.items() if key not in ("points", "name")}
    return [
        target
        for pressure, value in points
        for target in _targets(
            attrs.evolve(table, values={**rest, "pressure_kPa": pressure, "value": value}), supplies
        )
    ]


@attrs.frozen
class _Asked:
    """The table of a target: the values of its quantity, which raise InputError."""

    table: TomlTable
    kind: str
    name: str
    supplies: Supplies

    def pressure(self, rest: bool = False, default: Any = attrs.NOTHING) -> float:
        """A pressure in kPa. rest: it may be 0."""
        found = float(self.table.number(AT, PRESSURE.low, PRESSURE.high, default))
        if found == 0 and not rest:
            raise InputError(
                f"{self.kind} at 0 kPa is that of the unit at rest", self.table.at(AT),
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
        given = self.table.take(OVER, tuple[float, ...])
        bounded = (self.table.bounded(OVER, p, PRESSURE.low, PRESSURE.high) for p in given)
        found = tuple(sorted({*bounded} - {0.0}))
        if not found:
            raise InputError("no pressure differs from 0", self.table.at(OVER), "give one")
        return found

    @property
    def path(self) -> str:
        """A path of the unit, "" where it is free."""
        free = "" if self.supplies.path_is_free else attrs.NOTHING
        return str(self.table.word("path", tuple(self.supplies.paths), free))

    @property
    def region(self) -> str:
        """Wall or struts."""
        return str(self.table.word("region", ("wall", "struts"), "wall"))


def _tip_force(asked: _Asked) -> TipForce:
    if asked.pressure() < 0:
        raise InputError(
            "the wall is on the side toward which pressure bends the unit", asked.table.at("pressure_kPa"),
            "give a pressure above 0",
        )  # fmt: skip
    return TipForce(
        asked.name, asked.pressure(), asked.table.number(GAP.name, GAP.low, GAP.high, GAP.default)
    )


def _tip_position(asked: _Asked) -> TipPosition:
    return TipPosition(asked.name, asked.bent, asked.table.word("direction", ("y", "z"), "y"))


_MADE: dict[str, Callable[[_Asked], Quantity | None]] = {
    "angle": lambda a: Angle(a.name, a.bent),
    "tip_force": _tip_force,
    "tip_position": _tip_position,
    "workspace": lambda a: Workspace(a.name, a.pressures),
    "stiffness": lambda a: RestStiffness(a.name, a.table.word("direction", AXES)),
    "stretch": lambda a: Stretch(a.name, a.pressure(), a.region),
    "safety": lambda a: Stretch(a.name, a.pressure(), a.region, a.supplies.elongation),
    "air_volume": lambda a: AirVolume(a.name, a.pressure(rest=True, default=0.0)),
    "mass": lambda a: Mass(a.name, a.supplies.density_g_per_ml, a.supplies.printer, body=a.supplies.body),
    "print_time": lambda a: PrintTime(a.name, a.supplies.printer),
    "wall_thickness": lambda a: WallThickness(a.name),
    "deviation": lambda a: Disturbance(a.name, a.path, a.pressures),
    "sensor_slope": lambda a: SensorSlope(a.name, a.path, a.pressures),
    "walls_apart": lambda a: WallsApart(a.name, a.pressure()),
    "printable": lambda a: None,
}
"""The quantity of a target's table, by its kind."""
