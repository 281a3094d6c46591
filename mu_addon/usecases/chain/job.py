"""Inputs of a chain: its units, their pressures over time or a point to reach, and its loads."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...chain.joint_learning import Sampling
from ...chain.settings import GRAVITY, REFINE, TIMES, TIP_MASS
from ...design.parameters import Unit, load_preset, read_unit, to_toml
from ...design.settings import USUAL_RESIN
from ...errors import InputError
from ...fem.protocol import read_protocol_text
from ...meshing.settings import MeshSettings
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, read_inputs, structured
from ...toml_writer import toml_text

Array = np.ndarray[Any, Any]

PROTOCOL = "protocol.csv"
LAYOUT = FolderLayout(
    "chain.toml",
    "# The inputs of this chain; the unit_N.toml and protocol.csv beside it belong to them.",
    results=(
        "tip.csv", "joints.csv", "target.csv", "chain.pvd", "chain", "chain_*.png", "report.html",
    ),
    optional=(PROTOCOL, *(f"unit_{n}.toml" for n in range(1, 9))),
)  # fmt: skip
MOST_UNITS = 8
_ENTRY = ("preset", "file", "turn_deg", "pressure_kPa")


@attrs.frozen
class ChainUnit:
    """One unit of a chain: turned about its axis by turn_deg, learned for pressure_kPa (low, high)."""

    unit: Unit
    turn_deg: float = 0.0
    pressure_kPa: tuple[float, float] | None = None

    def __attrs_post_init__(self) -> None:
        self.unit.wall.require_without_memory("a chain")
        if not np.isfinite(self.turn_deg):
            raise InputError("turn_deg is not a number", "[[unit]]", "give degrees about the axis")
        if self.pressure_kPa is not None:
            low, high = self.pressure_kPa
            if not -100.0 < low <= high <= 1000.0:
                raise InputError(
                    f"pressure_kPa = [{low:g}, {high:g}]",
                    "[[unit]]",
                    "give the lowest, then the highest, in kPa",
                )


@attrs.frozen
class Target:
    """A target point (3,) in mm for the tip, in the frame of the chain's base."""

    reach: tuple[float, float, float]

    def __attrs_post_init__(self) -> None:
        if not np.isfinite(self.reach).all():
            raise InputError("the point has a coordinate that is not a number", "[target] reach", "give mm")


@attrs.frozen(eq=False)
class Pressures:
    """Piecewise linear gauge pressures over time: corner points in s (c,) and kPa (c, n), a column a unit."""

    time_s: Array
    pressure_kPa: Array

    def sample(self, count: int) -> tuple[Array, Array]:
        """Times (count,) in s, evenly spaced, and pressures (count, n) in kPa there."""
        time = np.linspace(self.time_s[0], self.time_s[-1], count)
        columns = [np.interp(time, self.time_s, column) for column in self.pressure_kPa.T]
        return time, np.round(np.stack(columns, axis=1), 9)

    def text(self) -> str:
        """The corner points as CSV, to their last digit."""
        names = ",".join(columns_of(self.pressure_kPa.shape[1]))
        rows = zip(self.time_s, self.pressure_kPa, strict=True)
        return names + "\n" + "".join(",".join(repr(float(v)) for v in (t, *p)) + "\n" for t, p in rows)


def columns_of(count: int) -> list[str]:
    """Columns of a chain's protocol."""
    return ["time_s", *(f"pressure_{n}_kPa" for n in range(1, count + 1))]


@attrs.frozen
class Job:
    """Inputs of a run: either a protocol or a target.

    orientation_deg: of the base about x; 0: hanging, tip down. tip_mass_g hangs at the middle of the tip.
    tip_force_N and tip_couple_N_mm: in the base's frame. times: instants that are computed. Raises
    InputError.
    """

    units: tuple[ChainUnit, ...]
    protocol: Pressures | None = None
    target: Target | None = None
    gravity: bool = GRAVITY.field()
    orientation_deg: float = 0.0
    tip_mass_g: float = TIP_MASS.field()
    tip_force_N: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip_couple_N_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    resin: str = USUAL_RESIN
    times: int = TIMES.field()
    mesh: MeshSettings = attrs.field(factory=lambda: MeshSettings(refine=REFINE.default, fraction="full"))
    joint: Sampling = attrs.field(factory=Sampling)

    def __attrs_post_init__(self) -> None:
        if not 1 <= len(self.units) <= MOST_UNITS:
            raise InputError(
                f"a chain of {len(self.units)} units", "[[unit]]", f"give 1 to {MOST_UNITS} tables [[unit]]"
            )
        if (self.protocol is None) == (self.target is None):
            both = "both a protocol and a target" if self.target else "neither a protocol nor a target"
            raise InputError(both, "chain.toml", 'give protocol = "FILE.csv", or [target] reach = [x, y, z]')
        if self.target is not None and all(one.pressure_kPa is None for one in self.units):
            raise InputError(
                "no unit has a pressure range",
                "[[unit]] pressure_kPa",
                "give pressure_kPa = [low, high] to each unit that is to move",
            )
        numbers = (self.orientation_deg, *self.tip_force_N, *self.tip_couple_N_mm)
        if not np.isfinite(numbers).all():
            raise InputError("a load or the orientation is not a number", "chain.toml", "give finite numbers")
        if self.mesh.fraction != "full":
            raise InputError(
                f"fraction = {self.mesh.fraction!r}", "[mesh] fraction", 'a joint needs the "full" unit'
            )

    def ranges_kPa(self) -> list[tuple[float, float]]:
        """Lowest and highest pressure in kPa that each unit's joint must cover; equal units share theirs."""
        own = []
        for n, one in enumerate(self.units):
            values = [0.0, *(one.pressure_kPa or ())]
            if self.protocol is not None:
                values += self.protocol.pressure_kPa[:, n].tolist()
            own.append((min(values), max(values)))
        found = []
        for one in self.units:
            same = [
                r for r, other in zip(own, self.units, strict=True) if other.unit.hash() == one.unit.hash()
            ]
            found.append((min(low for low, _ in same), max(high for _, high in same)))
        return found

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; chain.toml is the first."""
        values: dict[str, Any] = {"format": FORMAT}
        if self.protocol is not None:
            values["protocol"] = PROTOCOL
        for name in ("gravity", "orientation_deg", "tip_mass_g", "tip_force_N", "tip_couple_N_mm", "resin"):
            values[name] = getattr(self, name)
        values["times"] = self.times
        values["unit"] = [
            {"file": f"unit_{n}.toml", "turn_deg": one.turn_deg}
            | ({} if one.pressure_kPa is None else {"pressure_kPa": one.pressure_kPa})
            for n, one in enumerate(self.units, 1)
        ]
        values["mesh"] = attrs.asdict(self.mesh)
        values["joint"] = attrs.asdict(self.joint)
        if self.target is not None:
            values["target"] = attrs.asdict(self.target)
        texts = {LAYOUT.inputs: toml_text(values, LAYOUT.header)}
        texts |= {f"unit_{n}.toml": to_toml(one.unit) for n, one in enumerate(self.units, 1)}
        return texts if self.protocol is None else texts | {PROTOCOL: self.protocol.text()}


def read_chain(path: Path, changes: Mapping[str, Any] | None = None) -> Job:
    """The chain of a TOML file, with file names relative to its folder; changes: keys in place of the file's.

    Raises InputError that names file and key.
    """
    values, _ = read_inputs(path, "chain", "give a chain.toml, such as assets/examples/trunk/chain.toml")
    values |= changes or {}
    entries = values.pop("unit", [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise InputError("unit is not a list of tables", str(path), "write each unit as a table [[unit]]")
    units = tuple(_unit(entry, path, n) for n, entry in enumerate(entries, 1))
    protocol = None
    if changes is not None and "target" in changes:
        values.pop("protocol", None)
    if "protocol" in values:
        name = values.pop("protocol")
        if not isinstance(name, str):
            raise InputError(f"protocol = {name!r}", str(path), "give the name of a CSV file")
        protocol = read_pressures(path.parent / name, len(units))
    mesh = values.get("mesh")
    if isinstance(mesh, dict):
        mesh.setdefault("fraction", "full")
        mesh.setdefault("refine", REFINE.default)
    return structured(Job, values, str(path), units=units, protocol=protocol)


def read_job(folder: Path) -> Job:
    """The job that a folder of `chain` describes; raises InputError."""
    return read_chain(folder / LAYOUT.inputs)


def _unit(entry: dict[str, Any], path: Path, number: int) -> ChainUnit:
    where = f"{path}, [[unit]] {number}"
    for key in entry:
        if key not in _ENTRY:
            raise InputError(f"unknown key {key!r}", where, f"known: {', '.join(_ENTRY)}")
    if ("preset" in entry) == ("file" in entry):
        raise InputError("a unit is named by preset or by file", where, 'give preset = "mu-1.0x", or file')
    named = entry.get("preset", entry.get("file"))
    if not isinstance(named, str):
        raise InputError(f"{named!r} is not a name", where, "give text in quotes")
    unit = load_preset(named) if "preset" in entry else read_unit(path.parent / named)
    rest = {key: entry[key] for key in ("turn_deg", "pressure_kPa") if key in entry}
    return structured(ChainUnit, rest, where, unit=unit)


def read_pressures(path: Path, count: int) -> Pressures:
    """A chain's protocol: columns time_s, pressure_1_kPa and so on, one a unit, `#` comments allowed.

    Raises InputError naming file and line.
    """
    wanted = columns_of(count)
    text = read_protocol_text(path, wanted)
    if len(text.names) != len(wanted):
        raise InputError(
            f"the protocol of {count} units has the columns {', '.join(text.names)}",
            str(path),
            f"name the columns {', '.join(wanted)}",
        )
    table = text.values(wanted)
    return Pressures(table[:, 0], table[:, 1:])
