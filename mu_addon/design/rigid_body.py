"""Rigid bodies next to a unit, fixed in its frame, and their OBJ file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from ..reading import file_text
from .body import Body, flaws, half, overlaps, require_sound
from .dimensions import Dimensions
from .settings import FRICTION


@attrs.frozen(eq=False)
class RigidBody:
    """A closed surface in mm, fixed in the unit's frame, and its Coulomb friction coefficient with the unit.

    Raises InputError for a coefficient outside 0 .. 5.
    """

    body: Body
    friction: float = FRICTION.field()

    @property
    def name(self) -> str:
        """The surface's name."""
        return self.body.name


def require_beside(bodies: Sequence[RigidBody], d: Dimensions, own: Body | None = None) -> None:
    """Raise InputError, with the place, for a body that has `flaws` or overlaps the unit at rest.

    own: the body that replaces the lattice's box as envelope.
    """
    for rigid in bodies:
        found = flaws(rigid.body)
        require_sound(rigid.body, found or overlaps(rigid.body, d, own), "an obstacle")


def mirrored(bodies: Sequence[RigidBody]) -> bool:
    """True if every body is symmetric about x = 0 and extends to both sides of that plane.

    The bodies must have no `flaws`. Raises InputError as `half` does.
    """
    return all(low < 0.0 < high and half(r.body) is not None for r in bodies for low, high in [_across(r)])


def _across(rigid: RigidBody) -> tuple[float, float]:
    low, high = rigid.body.bounds[:, 0]
    return float(low), float(high)


def to_obj(bodies: Sequence[RigidBody]) -> str:
    """All bodies as the text of a Wavefront OBJ file in mm, one object each, with every digit."""
    lines, first = ["# rigid bodies beside the unit, millimetres"], 1
    for number, rigid in enumerate(bodies, 1):
        v, t = rigid.body.vertices, rigid.body.triangles
        lines.append(f"o {number} {' '.join(rigid.name.split())}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in v.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (t + first).tolist()]
        first += len(v)
    return "\n".join(lines) + "\n"


def read_rigid_bodies(path: Path, friction: Any) -> tuple[RigidBody, ...]:
    """The bodies of a file written by `to_obj`; friction: list of their coefficients, in the file's order.

    Raises InputError for a file that cannot be read or coefficients that do not fit it.
    """
    remedy = "restore the file that the study wrote"
    found: list[tuple[str, list[list[float]], list[list[int]]]] = []
    before = 0
    try:
        for line in file_text(path).splitlines():
            kind, _, words = line.partition(" ")
            if kind == "o":
                before += len(found[-1][1]) if found else 0
                found.append((words.partition(" ")[2], [], []))
            elif kind == "v":
                found[-1][1].append([float(w) for w in words.split()])
            elif kind == "f":
                found[-1][2].append([int(w) - 1 - before for w in words.split()])
        surfaces = [(np.array(v, float), np.array(t, np.int64), name) for name, v, t in found]
        for v, t, _ in surfaces:
            if v.shape[1:] != (3,) or t.shape[1:] != (3,) or not 0 <= t.min() <= t.max() < len(v):
                raise ValueError
    except (OSError, ValueError, IndexError):
        raise InputError("the obstacles cannot be read", str(path), remedy) from None
    if not isinstance(friction, list) or len(friction) != len(surfaces):
        raise InputError(f"friction = {friction!r} is not one coefficient per obstacle", str(path), remedy)
    return tuple(RigidBody(Body(*s), float(mu)) for s, mu in zip(surfaces, friction, strict=True))
