"""The user's own bodies: a selected mesh in a unit's frame, checked by the core, and kept."""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np

from ...design.body import Body, Flaw, body_of, envelope, flaws, misfits
from ...design.dimensions import Dimensions
from ...design.parameters import Unit
from ...design.printing.repair import Repair
from ...errors import InputError

_kept: dict[tuple[str, str], Body] = {}


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


def envelope_in(root: Any, unit: Unit) -> Body | None:
    """The envelope that the user gave a unit, cut to its length, or None; raises InputError."""
    mesh = root.mu_unit.envelope
    if mesh is None:
        return None
    vertices, triangles = arrays_in(mesh)
    digest = hashlib.sha256(vertices.tobytes() + triangles.tobytes()).hexdigest()
    key = digest, repr((unit.scale, unit.chambers))
    if key not in _kept:
        if len(_kept) > 16:
            _kept.clear()
        _kept[key] = envelope(body_of(vertices, triangles, mesh.name), unit.dimensions)
    return _kept[key]


def fingerprint(root: Any) -> str:
    """Text that differs whenever the user's envelope does."""
    mesh = root.mu_unit.envelope
    if mesh is None:
        return ""
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays_in(mesh))).hexdigest()


def arrays_in(mesh: Any) -> tuple[Any, Any]:
    """Vertices (n, 3), float64, and triangles (m, 3) of a Blender mesh."""
    mesh.calc_loop_triangles()
    vertices = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", vertices)
    triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    return vertices.reshape(-1, 3).astype(float), triangles.reshape(-1, 3).astype(np.int64)
