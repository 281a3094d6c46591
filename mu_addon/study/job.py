"""What a study is asked to do: its inputs, and the text that stands for them in study.toml."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from ..design.assets import asset_root
from ..design.parameters import Unit, to_toml
from ..errors import InputError
from ..fem.protocol import Protocol, read_protocol
from ..fem.unit import materials_of
from ..homogenize.effective import Effective
from ..meshing.settings import MeshSettings
from ..placement.graph import Limits
from ..placement.inclusion import RULES

if TYPE_CHECKING:
    from ..fem.materials import Materials
    from ..meshing.mesh import Mesh

GRASP = "protocols/grasp.csv"
# The first line of study.toml, by which a study's folder is known.
HEADER = "# The inputs of this study; unit.toml and protocol.csv beside it belong to them."
LATTICE_LAW = "effective.toml"


def _whole(low: int, high: int, what: str) -> Any:
    def check(_: object, field: attrs.Attribute[int], value: int) -> None:
        if not low <= value <= high:
            raise InputError(f"{what} is {value}", field.name, f"give a whole number from {low} to {high}")

    return check


@attrs.frozen
class Job:
    """Inputs of a study. times: samples k of the protocol; stations: j along the backbone.

    The 13 samples of the grasp protocol are 1 s or 10 kPa apart and meet each of its corners.
    """

    unit: Unit
    protocol: Protocol
    mesh: MeshSettings = attrs.field(factory=MeshSettings)
    mesher: str = "auto"
    times: int = attrs.field(default=13, validator=_whole(2, 1001, "the number of time samples"))
    stations: int = attrs.field(default=51, validator=_whole(2, 10_001, "the number of stations"))
    rules: tuple[str, ...] = RULES
    quality: str = "interactive"
    workers: int = attrs.field(default=2, validator=_whole(1, 256, "the number of workers"))
    # Whether a second, coarser mesh is solved to tell how far the mesh moves a ranking.
    mesh_check: bool = True
    # Which paths: the windows of anchors alone, or the whole lattice graph besides.
    paths: str = attrs.field(default="windows", validator=attrs.validators.in_(("windows", "graph")))
    limits: Limits = attrs.field(factory=Limits)
    most_checks: int = attrs.field(default=100, validator=_whole(2, 100_000, "the number of checks"))
    # The lattice's law, by homogenizing its cell, in place of the unit's one modulus for it.
    lattice: Effective | None = None

    def __attrs_post_init__(self) -> None:
        _, pressure = self.protocol.sample(self.times)
        if not pressure.any():
            raise InputError(
                f"none of the {self.times} samples of the protocol has any pressure",
                "times",
                "give more samples, or a protocol that leaves 0 kPa",
            )

    def text(self) -> str:
        """study.toml: everything that decides the results (not `workers`, which does not)."""
        rules = ", ".join(f'"{rule}"' for rule in self.rules)
        mesh = attrs.asdict(self.mesh)
        lines = [
            HEADER,
            "format = 1",
            'unit = "unit.toml"',
            'protocol = "protocol.csv"',
            f"times = {self.times}",
            f"stations = {self.stations}",
            f"rules = [{rules}]",
            f'quality = "{self.quality}"',
            f'mesher = "{self.mesher}"',
            f"mesh_check = {str(self.mesh_check).lower()}",
            f'paths = "{self.paths}"',
            *self._lattice_lines(),
            "",
            "[mesh]",
            *(f'{k} = "{v}"' if isinstance(v, str) else f"{k} = {v}" for k, v in mesh.items()),
        ]
        if self.paths == "graph":
            limits = attrs.asdict(self.limits) | {"most_checks": self.most_checks}
            lines += ["", "[search]", *(f"{k} = {v}" for k, v in limits.items())]
        return "\n".join(lines) + "\n"

    def _lattice_lines(self) -> list[str]:
        text = self.lattice_text()
        if text is None:
            return []
        digest = hashlib.sha256(text.encode()).hexdigest()
        return [f'lattice = "{LATTICE_LAW}"', f'lattice_sha256 = "{digest}"']

    def materials(self, mesh: Mesh) -> Materials:
        """Materials of the unit's mesh."""
        return materials_of(self.unit, mesh, None if self.lattice is None else self.lattice.law)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; study.toml is the first."""
        found = {
            "study.toml": self.text(),
            "unit.toml": self.unit_text(),
            "protocol.csv": self.protocol_text(),
        }
        lattice = self.lattice_text()
        return found if lattice is None else found | {LATTICE_LAW: lattice}

    def lattice_text(self) -> str | None:
        """effective.toml: the lattice's law and where it is from, or None where it is the unit's modulus."""
        return None if self.lattice is None else self.lattice.text()

    def unit_text(self) -> str:
        """unit.toml: the unit's parameters with units, meaning and source."""
        return to_toml(self.unit)

    def protocol_text(self) -> str:
        """protocol.csv: corner points of the pressure protocol."""
        rows = zip(self.protocol.time_s, self.protocol.pressure_kPa, strict=True)
        return "time_s,pressure_kPa\n" + "".join(f"{float(t)!r},{float(p)!r}\n" for t, p in rows)


def grasp() -> Protocol:
    """The protocol that comes with the package."""
    return read_protocol(asset_root() / GRASP)


def protocol_of(path: str | Path | None) -> Protocol:
    """The protocol in a CSV file, or the one that comes with the package. Raises InputError."""
    return grasp() if path is None else read_protocol(Path(path))
