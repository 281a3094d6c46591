"""Targets, bounds and objectives of a design, and a unit's distance from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import attrs

from ..design.body import Body
from ..errors import InputError
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
from .target_kinds import GAP, KINDS, PRESSURE
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
    quantity = _quantity(kind, name, table, supplies)
    if KINDS[kind].is_yes:
        _refuse(table, ("value", "tolerance", "low", "high", "objective"), f"{kind} is a yes or a no")
        return [Target(name, kind, "", quantity, tolerance=1.0, low=1.0, line=table.at())]
    return [Target(name, kind, KINDS[kind].unit, quantity, **_asked(table, kind), line=table.at())]


def _name(kind: str, table: Mapping[str, Any]) -> str:
    """A name from the quantity and its pressure or axis: "angle at 30 kPa", "stiffness along x"."""
    words = kind.replace("_", " ")
    if "region" in table:
        words += f" of {table['region']}"
    if "path" in table:
        words += f" of {table['path']}"
    if "pressure_kPa" in table:
        words += f" at {table['pressure_kPa']:g} kPa" if is_finite(table["pressure_kPa"]) else ""
    if "gap_mm" in table:
        words += f" on a wall at {table['gap_mm']:g} mm" if is_finite(table["gap_mm"]) else ""
    return f"{words} along {table['direction']}" if "direction" in table else words


def _asked(table: TomlTable, kind: str) -> dict[str, Any]:
    goal = table.word("objective", ("minimise", "maximise"), None)
    has_bound = "low" in table or "high" in table
    if ("value" in table) + has_bound + (goal is not None) != 1:
        raise InputError(
            f"{kind} must have either value and tolerance, or low and high, or objective", table.at(),
            'write value = 40, tolerance = 1; or low = 40; or objective = "minimise"',
        )  # fmt: skip
    if goal is not None:
        _refuse(table, ("tolerance",), "an objective has no tolerance")
        return {"goal": goal}
    if "value" in table:
        if "tolerance" not in table:
            raise InputError("a value has no tolerance", table.at("tolerance"), "write tolerance = ..")
        found = {key: _number(table, key) for key in ("value", "tolerance")}
    else:
        found = {key: _number(table, key) for key in ("low", "high") if key in table}
        if found.get("low", -math.inf) >= found.get("high", math.inf):
            raise InputError("low is not below high", table.at("low"), "exchange the two")
        largest = max(abs(v) for v in found.values())
        found["tolerance"] = _number(table, "tolerance", NARROW * (largest or 1.0))
    if found["tolerance"] <= 0:
        what = f"tolerance = {found['tolerance']:g} is not positive"
        raise InputError(what, table.at("tolerance"), "give more than 0")
    return found


def _curve(table: TomlTable, kind: str, supplies: Supplies) -> list[Target]:
    """A target at every point (pressure in kPa, value) of a curve."""
    points = table.take("points", tuple[tuple[float, float], ...])
    if len(points) < 2:
        raise InputError("one point is no curve", table.at("points"), "write [[-15, -20], [30, 40]]")
    if "pressure_kPa" not in KINDS[kind].takes:
        raise InputError(f"{kind} has no curve", table.at("points"), "give a value")
    _refuse(table, ("value", "low", "high", "objective", "pressure_kPa"), "points give it already")
    rest = {key: v for key, v in table.values.items() if key not in ("points", "name")}
    return [
        target
        for pressure, value in points
        for target in _targets(
            attrs.evolve(table, values={**rest, "pressure_kPa": pressure, "value": value}), supplies
        )
    ]


def _quantity(kind: str, name: str, table: TomlTable, supplies: Supplies) -> Quantity | None:
    if kind == "printable":
        return None
    if kind == "mass":
        return Mass(name, supplies.density_g_per_ml, supplies.printer, body=supplies.body)
    if kind == "print_time":
        return PrintTime(name, supplies.printer)
    if kind == "wall_thickness":
        return WallThickness(name)
    if kind == "stiffness":
        return RestStiffness(name, table.word("direction", ("x", "y", "z")))
    if kind == "workspace":
        return Workspace(name, _pressures(table))
    if kind in ("deviation", "sensor_slope"):
        pressures, path = _pressures(table), table.values.get("path")
        if path is None and supplies.path_is_free:
            path = ""
        elif path not in supplies.paths:
            raise InputError(
                f"path = {path!r} is not a path of the unit", table.at("path"),
                f"one of: {', '.join(supplies.paths)}; left out where the path is a freedom",
            )  # fmt: skip
        made = Disturbance if kind == "deviation" else SensorSlope
        return made(name, str(path), pressures)
    pressure = 0.0 if kind == "air_volume" and "pressure_kPa" not in table else _pressure(table)
    if kind == "air_volume":
        return AirVolume(name, pressure)
    if pressure == 0 and not (supplies.has_gravity and kind in ("angle", "tip_position")):
        raise InputError(
            f"{kind} at 0 kPa is that of the unit at rest", table.at("pressure_kPa"),
            "give another; with orientation_deg, under its weight, an angle or a tip position may be at 0",
        )  # fmt: skip
    if kind == "angle":
        return Angle(name, pressure)
    if kind == "tip_force":
        return _tip_force(name, pressure, table)
    if kind == "tip_position":
        direction = table.values.get("direction", "y")
        if direction not in ("y", "z"):
            raise InputError(
                f"the tip does not move in direction = {direction!r}", table.at("direction"),
                'write "y", toward which it bends, or "z", along the axis',
            )  # fmt: skip
        return TipPosition(name, pressure, str(direction))
    if kind == "walls_apart":
        return WallsApart(name, pressure)
    region = table.word("region", ("wall", "struts"), "wall")
    return Stretch(name, pressure, region, supplies.elongation if kind == "safety" else None)


def _tip_force(name: str, pressure: float, table: TomlTable) -> TipForce:
    gap = table.number("gap_mm", 0.0, GAP.high, 0.0)
    if pressure < 0:
        raise InputError(
            "the wall is on the side toward which pressure bends the unit", table.at("pressure_kPa"),
            "give a pressure above 0",
        )  # fmt: skip
    return TipForce(name, pressure, gap)


def _refuse(table: TomlTable, keys: Sequence[str], why: str) -> None:
    for key in keys:
        if key in table:
            raise InputError(f"{why}: {key} does not apply there", table.at(key), "leave it out")


def _pressures(table: TomlTable) -> tuple[float, ...]:
    given = table.take("pressures_kPa", tuple[float, ...])
    bounded = (table.bounded("pressures_kPa", p, PRESSURE.low, PRESSURE.high) for p in given)
    found = tuple(sorted({*bounded} - {0.0}))
    if not found:
        raise InputError("no pressure differs from 0", table.at("pressures_kPa"), "give one")
    return found


def _pressure(table: TomlTable) -> float:
    return float(table.number("pressure_kPa", PRESSURE.low, PRESSURE.high))


def _number(table: TomlTable, key: str, default: Any = attrs.NOTHING) -> float:
    return float(table.number(key, default=default))
