"""The user's own bodies: a selected mesh in a unit's frame, checked by the core, and kept."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ...design.body import Body, Flaw, body_of, flaws, misfits
from ...design.dimensions import Dimensions
from ...design.printing.repair import Repair
from ...errors import InputError
from ..preview.skeletons import Skeleton
from ..shared import displays
from ..unit import drawing
from ..unit.envelope import arrays_in
from ..unit.properties import to_unit

FLAWS = "flaws"
"""Balls where a body's check found a flaw."""


def of_object(obj: Any, root: Any) -> Body:
    """The mesh of an object, its modifiers applied, in the frame of a unit; raises InputError."""
    return body_of(*arrays_of(obj, root), obj.name)


def arrays_of(obj: Any, root: Any) -> tuple[Any, Any]:
    """Vertices (n, 3) and triangles (m, 3) of an object's mesh, its modifiers applied, in a unit's frame.

    Raises InputError for another kind of object.
    """
    if obj is None or obj.type != "MESH":
        raise InputError("no mesh is selected besides the unit", "selection", "select one closed mesh")
    seen = obj.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = seen.to_mesh()
    try:
        vertices, triangles = arrays_in(mesh)
    finally:
        seen.to_mesh_clear()
    to_unit = np.array(root.matrix_world.inverted() @ obj.matrix_world)
    if np.linalg.det(to_unit[:3, :3]) < 0.0:
        triangles = triangles[:, ::-1]
    return vertices @ to_unit[:3, :3].T + to_unit[:3, 3], triangles


def put_repaired(obj: Any, root: Any, mended: Repair) -> Any:
    """Replace an object, which is hidden, by a new one with a repaired surface, and select that."""
    mesh = bpy.data.meshes.new(f"{obj.name} repaired")
    mesh.from_pydata(mended.vertices.tolist(), [], mended.triangles.tolist())
    copy = bpy.data.objects.new(mesh.name, mesh)
    for collection in obj.users_collection:
        collection.objects.link(copy)
    copy.matrix_world = root.matrix_world
    obj.select_set(False)
    obj.hide_set(True)
    copy.select_set(True)
    return copy


def examined(body: Body, d: Dimensions) -> list[Flaw]:
    """Reasons why a body cannot be the envelope of a unit of these dimensions."""
    return flaws(body) or misfits(body, d)


def mark(root: Any, places: list[Any]) -> None:
    """Put a red ball at every position (3,) in mm of the unit's frame, replacing earlier ones."""
    old = drawing.beside(root, FLAWS)
    if old is not None:
        displays.remove(old)
    if len(places):
        radius = 0.08 * to_unit(root.mu_unit).dimensions.cell
        balls = Skeleton(np.array(places), attributes={"radius": np.full(len(places), radius)})
        drawing.put_beside(root, FLAWS, balls, "MU Flaws", "MU Balls").show_in_front = True
