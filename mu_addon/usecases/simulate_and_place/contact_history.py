"""A study's unit beside rigid bodies: what it touches, with what force, and how it slides, over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...errors import InputError
from ...fem.obstacle import Contact, Obstacle
from ...fem.rigid_surface import Surface
from ...meshing.settings import CELL_MM

if TYPE_CHECKING:
    from ...design.parameters import Unit
    from ...design.rigid_body import RigidBody
    from ...meshing.mesh import Mesh

Array = np.ndarray[Any, Any]

# At this contact pressure the gap is off by so much at 1.0x, and friction gives by as much before it slides.
PRESSURE_MPa, DEPTH_mm = 0.02, 0.05
# Faces of the envelope are some 15 mm long: contact is felt at points four times as close.
HALVINGS = 2
# Deeper than this at rest, as a share of DEPTH_mm, is an overlap and no rounding of the mesh.
_OVERLAP = 0.2
COLUMNS = (
    "time_s",
    "pressure_kPa",
    "obstacle",
    "normal_N",
    "friction_N",
    "force_x_N",
    "force_y_N",
    "force_z_N",
    "area_mm2",
    "sticking",
    "gap_error_mm",
    "slid_mm",
    "lost_mJ",
)


@attrs.frozen(eq=False)
class ContactHistory:
    """A whole unit's contact with b rigid bodies at k instants; forces (b, k, 3) are its on them, in N.

    area_mm2, sticking, deepest_mm, slid_mm and lost_mJ (b, k): see `fem.obstacle.Contact`; slid_mm is the
    farthest that a point has slid so far.
    """

    names: tuple[str, ...]
    friction: tuple[float, ...]
    time_s: Array
    pressure_kPa: Array
    normal_N: Array
    tangential_N: Array
    area_mm2: Array
    sticking: Array
    deepest_mm: Array
    slid_mm: Array
    lost_mJ: Array

    @property
    def force_N(self) -> Array:
        """Size (b, k) of the whole force."""
        return np.asarray(np.linalg.norm(self.normal_N + self.tangential_N, axis=2))

    def rows(self) -> list[tuple[Any, ...]]:
        """A row of contact.csv an instant and body, see COLUMNS."""
        found = []
        for k, (time, pressure) in enumerate(zip(self.time_s, self.pressure_kPa, strict=True)):
            for b, name in enumerate(self.names):
                normal, rubbing = self.normal_N[b, k], self.tangential_N[b, k]
                values = [np.linalg.norm(normal), np.linalg.norm(rubbing), *(normal + rubbing)]
                values += [self.area_mm2[b, k], self.sticking[b, k], self.deepest_mm[b, k]]
                values += [self.slid_mm[b, k], self.lost_mJ[b, k]]
                found.append((f"{time:.9g}", f"{pressure:.9g}", name, *(f"{v + 0.0:.6g}" for v in values)))
        return found

    def summary(self) -> dict[str, Any]:
        """Its figures by name of the body; two of a name are told apart by their number."""
        found = {}
        for b, name in enumerate(self.names):
            k = int(self.force_N[b].argmax())
            found[f"{b + 1} {name}"] = {
                "friction": self.friction[b],
                "largest_force_N": float(self.force_N[b, k]),
                "at_s": float(self.time_s[k]),
                "at_kPa": float(self.pressure_kPa[k]),
                "largest_gap_error_mm": float(self.deepest_mm[b].max()),
                "slid_mm": float(self.slid_mm[b].max()),
                "lost_mJ": float(self.lost_mJ[b].max()),
            }
        return found


def obstacles_of(bodies: Sequence[RigidBody], unit: Unit, mesh: Mesh) -> tuple[Obstacle, ...]:
    """The bodies as obstacles of a unit's mesh; InputError where it overlaps one at rest: where, how deep."""
    depth = DEPTH_mm * unit.dimensions.cell / CELL_MM
    found = []
    for rigid in bodies:
        surface = Surface(rigid.body.vertices, rigid.body.triangles, rigid.name)
        obstacle = Obstacle(mesh, surface, PRESSURE_MPa, depth, HALVINGS, rigid.friction)
        at_rest = np.zeros_like(mesh.nodes)
        deep = obstacle.deepest_mm(at_rest)
        if deep > _OVERLAP * depth:
            x, y, z = obstacle.deepest_place(at_rest)
            raise InputError(
                f"the obstacle stands in the unit at rest, {deep:.2g} mm deep",
                f"{rigid.name}, at ({x:.2f}, {y:.2f}, {z:.2f}) mm",
                "move it away until they do not touch",
            )
        found.append(obstacle)
    return tuple(found)


def history(
    bodies: Sequence[RigidBody],
    mesh: Mesh,
    time_s: Array,
    pressure_kPa: Array,
    contacts: Sequence[Sequence[Contact]],
) -> ContactHistory:
    """What contacts, an instant a row, are together; a half mesh's with its mirror image's, k of b each."""
    whole, keeps = (2.0, np.array([0.0, 1.0, 1.0])) if "x" in mesh.symmetry else (1.0, np.ones(3))

    def values(of: Any) -> Array:
        return np.array([[of(c) for c in row] for row in contacts], float).swapaxes(0, 1)

    return ContactHistory(
        tuple(r.name for r in bodies),
        tuple(r.friction for r in bodies),
        time_s,
        pressure_kPa,
        whole * keeps * values(lambda c: c.normal_N),
        whole * keeps * values(lambda c: c.tangential_N),
        whole * values(lambda c: c.area_mm2),
        values(lambda c: c.sticking),
        values(lambda c: c.deepest_mm),
        values(lambda c: c.slid_mm.max()),
        whole * values(lambda c: c.lost_mJ),
    )
