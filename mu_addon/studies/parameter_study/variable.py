"""One varied input: its name, its values, and its use in a study."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.parameters import SECTIONS, Unit
from ...design.quantity import describe
from ...errors import InputError, did_you_mean
from ...fem.protocol import Protocol, read_protocol
from ...meshing.settings import OF_CONTINUUM, MeshSettings, require_printed
from ...toml_reader import TomlTable
from ..unit_ranking import UnitStudy

FACTOR = "protocol.factor"
FILE = "simulate.protocol"
# Levels of a range in a grid, unless it says how many.
STEPS = 3


@attrs.frozen
class Variable:
    """A range from low to high (whole numbers if both are), or a choice among `values`.

    log: sample evenly in the logarithm; steps: its levels in a grid.
    """

    name: str
    low: float | None = None
    high: float | None = None
    values: tuple[Any, ...] = ()
    log: bool = False
    steps: int = STEPS

    def at(self, u: float) -> Any:
        """Value at a position u in [0, 1)."""
        if self.values:
            return self.values[min(int(u * len(self.values)), len(self.values) - 1)]
        assert self.low is not None
        assert self.high is not None
        if isinstance(self.low, int) and isinstance(self.high, int):
            return min(self.low + int(u * (self.high - self.low + 1)), self.high)
        width = self.high - self.low
        found = self.low * (self.high / self.low) ** u if self.log else self.low + u * width
        # Meaningless digits would only disturb a reader.
        return float(f"{found:.8g}")

    @property
    def levels(self) -> list[Any]:
        """Values in a grid."""
        if self.values:
            return list(self.values)
        assert self.low is not None
        assert self.high is not None
        if self.log:
            found = np.geomspace(self.low, self.high, self.steps)
        else:
            found = np.linspace(self.low, self.high, self.steps)
        if isinstance(self.low, int) and isinstance(self.high, int):
            return list(dict.fromkeys(round(float(v)) for v in found))
        return [float(f"{v:.8g}") for v in found]

    @property
    def table(self) -> dict[str, Any]:
        """Table of the variable in sweep.toml."""
        if self.values:
            return {"values": list(self.values)}
        return {"low": self.low, "high": self.high, "log": self.log, "steps": self.steps}


def variable(name: str, table: TomlTable) -> Variable:
    """A variable of its name and its table in sweep.toml; raises InputError."""
    require_printed(name, table.at())
    if name not in variable_names():
        raise InputError(
            f"unknown input {name!r}{did_you_mean(name, variable_names())}",
            table.at(),
            "name it as in unit.toml (chambers.wall_mm) or in study.toml (simulate.mesh.refine)",
        )
    if "values" in table:
        values = table.only(("values",)).take("values", tuple[Any, ...])
        if not values:
            raise InputError("the list of values is empty", table.at("values"), "write values = [1, 2]")
        return Variable(name, values=values)
    table.only(("low", "high", "log", "steps"))
    for key in ("low", "high"):
        table.number(key)
    low, high, log = table.values["low"], table.values["high"], table.take("log", bool, False)
    if not low < high:
        what = f"low = {low!r} and high = {high!r} are not a range"
        raise InputError(what, table.at("low"), "give two numbers with low < high, or values = [1, 2]")
    if log and low <= 0:
        what = f"log = {log!r} with low = {low!r}"
        raise InputError(what, table.at("log"), "write log = true only where low is positive")
    steps = table.take("steps", int, STEPS)
    return Variable(name, low, high, log=log, steps=int(table.bounded("steps", steps, 2, 1000)))


def variable_names() -> list[str]:
    """Names of all inputs that can be varied, as in unit.toml and study.toml."""
    unit = [f"{s.section}.{d.name}" for s in SECTIONS for d in describe(s)]  # type: ignore[attr-defined]
    unit = [name for name in unit if name not in OF_CONTINUUM]
    settings = UnitStudy.inputs().items()
    study = [f"{one.target}.{n}" for n, one in settings if one.kind == "setting" and one.decides]
    mesh = [f"simulate.mesh.{f.name}" for f in attrs.fields(MeshSettings)]
    return ["scale", *unit, FACTOR, FILE, *study, "simulate.orientation_deg", *mesh]


@attrs.frozen
class Inputs:
    """Inputs of a study: unit, protocol, and settings in tables like study.toml's."""

    unit: Unit
    protocol: Protocol
    tables: Mapping[str, Mapping[str, Any]]


def changed_inputs(inputs: Inputs, values: Mapping[str, Any], folder: Path) -> Inputs:
    """Inputs with some of them changed; raises InputError where the unit breaks a rule with them.

    folder: of files that values name.
    """
    sections: dict[str, dict[str, Any]] = {}
    tables = copy.deepcopy({stage: dict(table) for stage, table in inputs.tables.items()})
    protocol, factor, scale = inputs.protocol, 1.0, inputs.unit.scale
    own = {s.section for s in SECTIONS}  # type: ignore[attr-defined]
    for name, value in values.items():
        head, _, rest = name.partition(".")
        if name == "scale":
            scale = value
        elif name == FACTOR:
            factor = value
        elif name == FILE:
            protocol = read_protocol(folder / str(value))
        elif head in own:
            sections.setdefault(head, {})[rest] = value
        elif head not in tables:
            raise InputError(f"{name} is not an input of these stages", "[vary]", f'write stages = "{head}"')
        else:
            *inner, key = rest.split(".")
            table: dict[str, Any] = tables[head]
            for part in inner:
                table = table.setdefault(part, {})
            table[key] = value
    changed = {name: attrs.evolve(getattr(inputs.unit, name), **v) for name, v in sections.items()}
    unit = attrs.evolve(inputs.unit, scale=scale, **changed)
    return Inputs(unit, Protocol(protocol.time_s, protocol.pressure_kPa * factor), tables)
