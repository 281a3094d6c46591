"""Contact."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import attrs

from ...fem.newton_settings import CONTACT_NEWTON
from ...meshing.settings import CELL_MM
from ..unit_body import WALL, Body, UnitEffect

if TYPE_CHECKING:
    from ...fem.model import Model
    from ...meshing.mesh import Mesh
from .declaration import BENCH, CYCLED, Data, Declaration, Law, Parameter

# A wall's contact pressure is some kPa; there the gap is off by this much at 1.0x.
OBSTACLE_MPa, OBSTACLE_mm = 0.005, 0.02
# Faces of the envelope are some 20 mm long, and the tip's edge is what touches first.
OBSTACLE_HALVINGS = 2
REACH = Parameter("reach_mm", "mm", -1.0, 1.0, 0.0)


def _of_walls(law: Law, data: Data) -> tuple[Law, ...]:
    """The law where walls were computed: above 0 on the side +y, below 0 on -y, to the nearest of them."""
    if not data.walls:
        return ()
    sides = (1, -1)
    farthest = {s: max((w.farthest_mm for t, w in data.walls if t == s), default=0.0) for s in sides}
    # Walls nearer than the computed ones are not extrapolated.
    nearest = {s: max((w.nearest_mm for t, w in data.walls if t == s), default=0.0) for s in sides}
    starts = [round(s * share * near, 3) for s, near in nearest.items() for share in (0.3, 0.7) if near]
    reaches = " or ".join(
        f"{far:.1f} mm beyond its outline at rest toward {'+' if s > 0 else '-'}y"
        for s, far in farthest.items()
        if far
    )
    size = attrs.evolve(
        REACH,
        low=-float(nearest[-1]),
        high=float(nearest[1]),
        starts=tuple(starts),
        source=f"distance of a wall inside the free unit's farthest position, {reaches}; below 0 toward -y",
    )
    mechanism = (
        "the unit touches a flat wall parallel to its axis, reach_mm inside the outline it would "
        f"reach without the wall: {reaches}"
    )
    return (attrs.evolve(law, parameters=(size,), mechanism=mechanism),)


def with_flat_obstacle(body: Body, mesh: Mesh, gap_mm: float) -> Model:
    """The unit next to a flat frictionless wall along its axis, on the side +y, or -y for gap_mm < 0.

    |gap_mm|: distance in mm of the wall from the outline at rest.
    """
    from ...fem.obstacle import Obstacle
    from ...fem.rigid import Plane

    model = body.model(mesh)
    away = math.copysign(1.0, gap_mm)
    farthest = float((away * mesh.nodes[:, 1]).max())
    wall = Plane((0.0, away * (farthest + abs(gap_mm)), 0.0), (0.0, -away, 0.0))
    size = body.unit.dimensions.cell / CELL_MM
    model.obstacles = (Obstacle(mesh, wall, OBSTACLE_MPa, OBSTACLE_mm * size, OBSTACLE_HALVINGS),)
    return model


EFFECT = Declaration(
    mechanism="the unit touches an obstacle",
    reveals="the same protocol away from every obstacle",
    remedy="remove the obstacle, or simulate it with --obstacle",
    of=BENCH,
    laws=(Law(CYCLED, (REACH,), offered=_of_walls),),
    # A flat obstacle in a run; its position depends on the free unit's range.
    unit=UnitEffect(
        Parameter("gap_mm", "mm", -1e3, 1e3, 1e3, (), "signed: toward +y, below 0 toward -y"),
        (1e3,),
        model=with_flat_obstacle,
        newton=CONTACT_NEWTON,
        length=1,
        of=WALL,
    ),
)
