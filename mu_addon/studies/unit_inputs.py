"""Inputs of a unit's design, motion and ranking of paths that are no plain values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from .. import design, fem
from .. import simulate_and_place as core
from ..design.quantity import described
from ..design.settings import FRICTION
from ..errors import InputError
from ..placement.settings import OF_LATTICE
from ..run.study import Found, Input, Written
from ..sensing.optics import Optics
from ..simulate_and_place.settings import PROTOCOL
from .inputs import FileInput

BODY, PROTOCOL_FILE, OBSTACLES = "body.obj", "protocol.csv", "obstacles.obj"
GRASP = "protocols/grasp.csv"
LIGHT = described(
    "light",
    "",
    "optical constants of the resin; empty: assumed, "
    + ", ".join(f"{name} {value:g}" for name, value in attrs.asdict(Optics()).items()),
    group=OF_LATTICE,
)


def grasp() -> fem.Protocol:
    """The default protocol."""
    from ..design.assets import asset_root

    return fem.read_protocol(asset_root() / GRASP)


def protocol_of(path: str | Path | None) -> fem.Protocol:
    """The protocol in a CSV file, or the default one. Raises InputError."""
    return fem.read_protocol(Path(path)) if path else grasp()


def protocol_text(protocol: fem.Protocol) -> str:
    """The corner points of a protocol as CSV, to their last digit."""
    rows = zip(protocol.time_s, protocol.pressure_kPa, strict=True)
    return "time_s,pressure_kPa\n" + "".join(f"{float(t)!r},{float(p)!r}\n" for t, p in rows)


@attrs.frozen
class ProtocolInput(FileInput):
    """A pressure protocol; without a file the default one."""

    kind: str = "protocol"
    file: str = PROTOCOL_FILE
    text: Callable[[Any], str] = protocol_text
    load: Callable[[Path], Any] = lambda path: fem.read_protocol(path)
    descriptions: tuple[Any, ...] = (PROTOCOL,)
    path: str = "file"
    metavar: str = "CSV"
    target: str = "simulate"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> fem.Protocol:
        """The protocol of a file, or the default one; raises InputError."""
        return protocol_of(values[0])


@attrs.frozen
class BodyInput(FileInput):
    """A closed surface that replaces the lattice's box, cut to the unit's length."""

    kind: str = "body"
    file: str = BODY
    text: Callable[[Any], str] = lambda body: body.text()
    load: Callable[[Path], Any] = lambda path: design.read_body(path)
    needed: bool = False
    descriptions: tuple[Any, ...] = (
        described(
            "body",
            "",
            "closed surface that the lattice fills in place of its box: STL, OBJ or PLY, in mm, in the "
            "unit's frame, cut flat at both ends of the unit; empty: that box",
        ),
    )
    metavar: str = "FILE"
    target: str = "design"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> design.Body | None:
        """The body of a file; raises InputError."""
        from ..design.body import envelope

        return envelope(self.load(values[0]), given["unit"].dimensions) if values[0] else None


@attrs.frozen
class ObstaclesInput(Input):
    """Rigid bodies that the unit may touch, fixed in its frame, in a file of their own."""

    kind: str = "obstacles"
    target: str = "simulate"

    def write(self, name: str, value: Sequence[design.RigidBody]) -> Written:
        """The file's name, each one's friction, and the file's text."""
        from ..design.rigid_body import to_obj

        if not value:
            return Written()
        return Written(
            {name: OBSTACLES, "friction": [o.friction for o in value]}, files={OBSTACLES: to_obj(value)}
        )

    def read(self, name: str, found: Found) -> tuple[design.RigidBody, ...]:
        """The bodies of the folder; raises InputError."""
        from ..design.rigid_body import read_rigid_bodies

        named, friction = found.keys.pop(name, None), found.keys.pop("friction", None)
        return () if named is None else tuple(read_rigid_bodies(found.path.parent / OBSTACLES, friction))

    def file_names(self, name: str) -> tuple[str, ...]:
        """Their file."""
        return (OBSTACLES,)


def obstacles_for(
    unit: design.Unit, files: Sequence[tuple[str | Path, float | None]], own: design.Body | None = None
) -> tuple[design.RigidBody, ...]:
    """Rigid bodies next to a unit, from files, each with its friction or None for the assumed one.

    own: the unit's body, if it is not the lattice's box. Raises InputError, also if a body overlaps the unit
    at rest.
    """
    from ..design.rigid_body import require_beside

    used = [(design.read_body(file), FRICTION.default if mu is None else mu) for file, mu in files]
    found = [design.RigidBody(body, mu) for body, mu in used]
    require_beside(found, unit.dimensions, own)
    return tuple(found)


@attrs.frozen
class EffectsInput(Input):
    """Effects that measured data named, beyond the unit's parameters, and the direction of gravity."""

    kind: str = "effects"
    target: str = "simulate"

    def write(self, name: str, value: core.NamedEffects) -> Written:
        """Their table, and the direction where it matters."""
        return Written(value.tables)

    def read(self, name: str, found: Found) -> core.NamedEffects:
        """The effects of the file; raises InputError."""
        turn = found.keys.pop("orientation_deg", 0.0)
        return core.NamedEffects(found.keys.pop(name, {}), turn, f"{found.path}, [simulate.effects]")


def optics_of(words: Sequence[str] | None) -> Optics:
    """The resin's optics, changed by NAME=VALUE pairs; raises InputError."""
    names = [field.name for field in attrs.fields(Optics)]
    values: dict[str, float] = {}
    for word in words or ():
        name, _, value = word.partition("=")
        try:
            values[name] = float(value)
        except ValueError:
            name = ""
        if name not in names:
            raise InputError(f"{word!r} is not understood", "--light", f"NAME=VALUE with {', '.join(names)}")
    return Optics(**values)
