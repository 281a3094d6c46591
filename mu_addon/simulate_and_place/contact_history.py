"""Contact of a study's unit with rigid obstacles over time: forces, penetration, slip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..fem.obstacle import Obstacle, ObstacleContact
from ..fem.rigid_surface import Surface
from ..meshing.settings import CELL_MM
from ..report.results import ContactHistory

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..design.rigid_body import RigidBody
    from ..meshing.mesh import Mesh


# Error of the gap at 1.0x at the expected contact pressure, and slip at which friction slides.
DEPTH_mm = 0.05
# The contact pressure in MPa, and how often faces are halved: contact is felt at their points, and struts
# bear on few small places.
PRESSURE_AND_HALVINGS = (0.1, 1)
# Deeper than this at rest, as a share of DEPTH_mm, is an overlap and no rounding of the mesh.
_OVERLAP = 0.2


def obstacles_of(bodies: Sequence[RigidBody], unit: Unit, mesh: Mesh) -> tuple[Obstacle, ...]:
    """The bodies as obstacles of a unit's mesh; InputError where it overlaps one at rest: where, how deep."""
    depth = DEPTH_mm * unit.dimensions.cell / CELL_MM
    pressure, halvings = PRESSURE_AND_HALVINGS
    found = []
    for rigid in bodies:
        surface = Surface(rigid.body.vertices, rigid.body.triangles, rigid.name)
        obstacle = Obstacle(mesh, surface, pressure, depth, halvings, rigid.friction)
        at_rest = np.zeros_like(mesh.nodes)
        deep = obstacle.deepest_mm(at_rest)
        if deep > _OVERLAP * depth:
            x, y, z = obstacle.deepest_place(at_rest)
            raise InputError(
                f"the obstacle overlaps the unit at rest, by {deep:.2g} mm deep",
                f"{rigid.name}, at ({x:.2f}, {y:.2f}, {z:.2f}) mm",
                "move the obstacle away from the unit",
            )
        found.append(obstacle)
    return tuple(found)


def history(
    bodies: Sequence[RigidBody],
    mesh: Mesh,
    time_s: Array,
    pressure_kPa: Array,
    contacts: Sequence[Sequence[ObstacleContact]],
) -> ContactHistory:
    """Contacts, an instant a row, as a history; of a half mesh with its mirror image, k of b each."""
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
