"""Targets, bounds and objectives of a design, and a unit's distance from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import attrs

from ..design.body import Body
from ..errors import InputError, did_you_mean
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


def read_targets(
    tables: Sequence[Mapping[str, Any]], where: Sequence[str], supplies: Supplies
) -> list[Target]:
    """The targets of [[target]] tables; where: file and line of each.

    A curve of points is a target a point. `printable` adds the printer's least wall as a bound for the
    search. Raises InputError that names key and line.
    """
    found: list[Target] = []
    for table, place in zip(tables, where, strict=True):
        for target in _targets(table, place, supplies):
            if target.name in {t.name for t in found}:
                raise InputError(
                    f"two targets are named {target.name!r}", f"{place}, name", "give one of them a name"
                )
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


def _targets(table: Mapping[str, Any], where: str, supplies: Supplies) -> list[Target]:
    kind = table.get("kind")
    if not isinstance(kind, str) or kind not in KINDS:
        hint = did_you_mean(kind, list(KINDS)) if isinstance(kind, str) else ""
        raise InputError(
            f"kind = {kind!r} is not known{hint}", f"{where}, kind", f"one of: {', '.join(KINDS)}"
        )
    known = (*_FORM, *KINDS[kind].takes)
    for key in table:
        if key not in known:
            raise InputError(
                f"unknown key {key!r} of {kind}{did_you_mean(key, known)}", f"{where}, {key}",
                f"known: {', '.join(known)}",
            )  # fmt: skip
    if "points" in table:
        return _curve(table, where, supplies)
    name = table.get("name", _name(kind, table))
    if not isinstance(name, str) or not name.strip() or len(name) > 60 or not name.isprintable():
        raise InputError(f"name = {name!r} is not a name", f"{where}, name", "write a short text in quotes")
    quantity = _quantity(kind, name, table, where, supplies)
    if KINDS[kind].is_yes:
        _refuse(table, ("value", "tolerance", "low", "high", "objective"), where, f"{kind} is a yes or a no")
        return [Target(name, kind, "", quantity, tolerance=1.0, low=1.0, line=where)]
    return [Target(name, kind, KINDS[kind].unit, quantity, **_asked(table, where, kind), line=where)]


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


def _asked(table: Mapping[str, Any], where: str, kind: str) -> dict[str, Any]:
    goal = table.get("objective")
    has_bound = "low" in table or "high" in table
    if ("value" in table) + has_bound + (goal is not None) != 1:
        raise InputError(
            f"{kind} must have either value and tolerance, or low and high, or objective", where,
            'write value = 40, tolerance = 1; or low = 40; or objective = "minimise"',
        )  # fmt: skip
    if goal is not None:
        if goal not in ("minimise", "maximise"):
            raise InputError(
                f"objective = {goal!r} is not known", f"{where}, objective", '"minimise" or "maximise"'
            )
        _refuse(table, ("tolerance",), where, "an objective has no tolerance")
        return {"goal": goal}
    if "value" in table:
        if "tolerance" not in table:
            raise InputError("a value has no tolerance", f"{where}, tolerance", "write tolerance = ..")
        found = {key: _number(table, key, where) for key in ("value", "tolerance")}
    else:
        found = {key: _number(table, key, where) for key in ("low", "high") if key in table}
        if found.get("low", -math.inf) >= found.get("high", math.inf):
            raise InputError("low is not below high", f"{where}, low", "exchange the two")
        largest = max(abs(v) for v in found.values())
        found["tolerance"] = (
            _number(table, "tolerance", where) if "tolerance" in table else NARROW * (largest or 1.0)
        )
    if found["tolerance"] <= 0:
        raise InputError(
            f"tolerance = {found['tolerance']:g} is not positive", f"{where}, tolerance", "give more than 0"
        )
    return found


def _curve(table: Mapping[str, Any], where: str, supplies: Supplies) -> list[Target]:
    """A target at every point (pressure in kPa, value) of a curve."""
    points = table["points"]
    good = isinstance(points, list) and len(points) >= 2
    if not good or not all(isinstance(p, list) and len(p) == 2 and all(map(is_finite, p)) for p in points):
        raise InputError(
            f"points = {points!r} is not a curve", f"{where}, points", "write [[-15, -20], [30, 40]]"
        )
    if "pressure_kPa" not in KINDS[table["kind"]].takes:
        raise InputError(f"{table['kind']} has no curve", f"{where}, points", "give a value")
    _refuse(table, ("value", "low", "high", "objective", "pressure_kPa"), where, "points give it already")
    rest = {key: v for key, v in table.items() if key not in ("points", "name")}
    return [
        target
        for pressure, value in points
        for target in _targets({**rest, "pressure_kPa": pressure, "value": value}, where, supplies)
    ]


def _quantity(
    kind: str, name: str, table: Mapping[str, Any], where: str, supplies: Supplies
) -> Quantity | None:
    if kind == "printable":
        return None
    if kind == "mass":
        return Mass(name, supplies.density_g_per_ml, supplies.printer, body=supplies.body)
    if kind == "print_time":
        return PrintTime(name, supplies.printer)
    if kind == "wall_thickness":
        return WallThickness(name)
    if kind == "stiffness":
        direction = table.get("direction")
        if direction not in ("x", "y", "z"):
            raise InputError(
                f"direction = {direction!r} is not an axis", f"{where}, direction", 'write "x", "y" or "z"'
            )
        return RestStiffness(name, direction)
    if kind == "workspace":
        return Workspace(name, _pressures(table, where))
    if kind in ("deviation", "sensor_slope"):
        pressures, path = _pressures(table, where), table.get("path")
        if path is None and supplies.path_is_free:
            path = ""
        elif path not in supplies.paths:
            raise InputError(
                f"path = {path!r} is not a path of the unit", f"{where}, path",
                f"one of: {', '.join(supplies.paths)}; left out where the path is a freedom",
            )  # fmt: skip
        made = Disturbance if kind == "deviation" else SensorSlope
        return made(name, str(path), pressures)
    pressure = 0.0 if kind == "air_volume" and "pressure_kPa" not in table else _pressure(table, where)
    if kind == "air_volume":
        return AirVolume(name, pressure)
    if pressure == 0 and not (supplies.has_gravity and kind in ("angle", "tip_position")):
        raise InputError(
            f"{kind} at 0 kPa is that of the unit at rest", f"{where}, pressure_kPa",
            "give another; with orientation_deg, under its weight, an angle or a tip position may be at 0",
        )  # fmt: skip
    if kind == "angle":
        return Angle(name, pressure)
    if kind == "tip_force":
        return _tip_force(name, pressure, table, where)
    if kind == "tip_position":
        direction = table.get("direction", "y")
        if direction not in ("y", "z"):
            raise InputError(
                f"the tip does not move in direction = {direction!r}", f"{where}, direction",
                'write "y", toward which it bends, or "z", along the axis',
            )  # fmt: skip
        return TipPosition(name, pressure, str(direction))
    if kind == "walls_apart":
        return WallsApart(name, pressure)
    region = table.get("region", "wall")
    if region not in ("wall", "struts"):
        raise InputError(f"region = {region!r} is not known", f"{where}, region", 'write "wall" or "struts"')
    return Stretch(name, pressure, region, supplies.elongation if kind == "safety" else None)


def _tip_force(name: str, pressure: float, table: Mapping[str, Any], where: str) -> TipForce:
    gap = _number(table, "gap_mm", where) if "gap_mm" in table else 0.0
    if pressure < 0:
        raise InputError(
            "the wall is on the side toward which pressure bends the unit", f"{where}, pressure_kPa",
            "give a pressure above 0",
        )  # fmt: skip
    if not 0 <= gap <= GAP.high:
        raise InputError(
            f"gap_mm = {gap:g} is out of bounds", f"{where}, gap_mm", f"give 0 to {GAP.high:g} mm"
        )
    return TipForce(name, pressure, gap)


def _refuse(table: Mapping[str, Any], keys: Sequence[str], where: str, why: str) -> None:
    for key in keys:
        if key in table:
            raise InputError(f"{why}: {key} does not apply there", f"{where}, {key}", "leave it out")


def _pressures(table: Mapping[str, Any], where: str) -> tuple[float, ...]:
    given = table.get("pressures_kPa")
    if not isinstance(given, list) or not given or not all(is_finite(p) for p in given):
        raise InputError(
            f"pressures_kPa = {given!r} is not a list of pressures", f"{where}, pressures_kPa",
            "write pressures_kPa = [-15, 30]",
        )  # fmt: skip
    found = tuple(sorted({_pressure({"pressure_kPa": p}, where) for p in given} - {0.0}))
    if not found:
        raise InputError("no pressure differs from 0", f"{where}, pressures_kPa", "give one")
    return found


def _pressure(table: Mapping[str, Any], where: str) -> float:
    found = _number(table, "pressure_kPa", where)
    if abs(found) > PRESSURE.high:
        raise InputError(
            f"pressure_kPa = {found:g} is out of bounds", f"{where}, pressure_kPa",
            f"give {-PRESSURE.high:g} to {PRESSURE.high:g} kPa",
        )  # fmt: skip
    return found


def _number(table: Mapping[str, Any], key: str, where: str) -> float:
    value = table.get(key)
    if not is_finite(value):
        raise InputError(f"{key} = {value!r} is not a number", f"{where}, {key}", f"write {key} = ..")
    return float(value)  # type: ignore[arg-type]
