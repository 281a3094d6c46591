"""The envelope that the user gave a unit: a mesh of its own, kept, cut to the unit's length, compared."""

from __future__ import annotations

import hashlib
from typing import Any

import bpy
import numpy as np

from ...design.body import Body, body_of, envelope
from ...design.parameters import Unit
from ..preview import skeletons

_kept: dict[tuple[str, str], Body] = {}


def envelope_in(root: Any, unit: Unit) -> Body | None:
    """The envelope that the user gave a unit, cut to its length, or None; raises InputError."""
    mesh = root.mu_unit.envelope
    if mesh is None:
        return None
    key = fingerprint(root), repr((unit.scale, unit.chambers))
    if key not in _kept:
        if len(_kept) > 16:
            _kept.clear()
        _kept[key] = envelope(body_of(*arrays_in(mesh), mesh.name), unit.dimensions)
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


def put(root: Any, body: Body) -> Any:
    """Store the user's body as the unit's envelope; it is not drawn, since the lattice shows it."""
    mesh = bpy.data.meshes.new(body.name)
    skeletons.write(mesh, skeletons.Skeleton(body.vertices, faces=(body.triangles,), smooth=False))
    remove(root)
    root.mu_unit.envelope = mesh
    return mesh


def remove(root: Any) -> None:
    """Remove the user's envelope from the unit."""
    old, root.mu_unit.envelope = root.mu_unit.envelope, None
    if old is not None and not old.users:
        bpy.data.meshes.remove(old)
