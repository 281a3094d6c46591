"""Positions and values of a field on the shown motion: its maximum at this frame, and under a ray."""

from __future__ import annotations

from typing import Any

import attrs
import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from ..unit import object as unit_object
from . import field_colours
from . import motion as motion_parts


@attrs.frozen(eq=False)
class Place:
    """A point of the shown motion: its part, the field's value there or None, and its position.

    world: in the scene; now_mm, rest_mm: in the unit's frame, (3,) each, moved and at rest.
    """

    part: Any
    value: float | None
    world: Any
    now_mm: Any
    rest_mm: Any


def seen(root: Any) -> list[Any]:
    """Visible parts of a unit's motion."""
    return [part for part in motion_parts.parts(root) if motion_parts.is_seen(root, part)]


def coloured(root: Any) -> bool:
    """Return True if a unit shows colours of a field: of a study's motion, or of live bending."""
    live = unit_object.in_place(root) if root.visible_get() else []
    return any(field_colours.COLOUR in part.data.color_attributes for part in [*seen(root), *live])


def moved(part: Any) -> Any:
    """Vertices (v, 3) in mm of a part at this frame, in the unit's frame."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return motion_parts.vertices_of(part.evaluated_get(depsgraph).data)


def values_of(part: Any, field: str) -> Any | None:
    """Values (v,) of a field at a part's vertices at this frame, NaN where unknown; None without it."""
    attribute = part.data.attributes.get(field)
    if attribute is None or not len(attribute.data):
        return None
    found = np.empty(len(part.data.vertices), np.float32)
    attribute.data.foreach_get("value", found)
    return found


def largest(root: Any) -> Place | None:
    """Position where the chosen field is largest in the visible parts at this frame, or None."""
    best: tuple[float, Any, int] | None = None
    for part in seen(root):
        values = values_of(part, root.mu_motion.field)
        if values is None or np.isnan(values).all():
            continue
        vertex = int(np.nanargmax(values))
        if best is None or values[vertex] > best[0]:
            best = float(values[vertex]), part, vertex
    if best is None:
        return None
    value, part, vertex = best
    now = moved(part)[vertex]
    rest = motion_parts.vertices_of(part.data)[vertex]
    return Place(part, value, part.matrix_world @ Vector(now), now, rest)


class Surfaces:
    """Surfaces of the visible parts at one frame, for ray casts."""

    def __init__(self, root: Any) -> None:
        self.field = root.mu_motion.field
        self._parts = []
        for part in seen(root):
            mesh = part.data
            mesh.calc_loop_triangles()
            triangles = np.empty(3 * len(mesh.loop_triangles), np.int32)
            mesh.loop_triangles.foreach_get("vertices", triangles)
            triangles = triangles.reshape(-1, 3)
            now = moved(part)
            tree = BVHTree.FromPolygons(now.tolist(), triangles.tolist(), all_triangles=True)
            self._parts.append((part, tree, triangles, now, values_of(part, self.field)))

    def hit(self, origin: Any, direction: Any) -> Place | None:
        """First hit of a ray given in the scene's frame; None without one."""
        best: tuple[float, Place] | None = None
        for part, tree, triangles, now, values in self._parts:
            back = part.matrix_world.inverted()
            local = back @ Vector(origin)
            along = (back.to_3x3() @ Vector(direction)).normalized()
            at, _, face, _ = tree.ray_cast(local, along)
            if at is None:
                continue
            world = part.matrix_world @ at
            far = (world - Vector(origin)).length
            if best is not None and far >= best[0]:
                continue
            corners = triangles[face]
            share = _shares(np.array(at), now[corners])
            value = None if values is None else float(share @ values[corners])
            if value is not None and np.isnan(value):
                value = None
            rest = share @ motion_parts.vertices_of(part.data)[corners]
            best = far, Place(part, value, world, np.array(at), rest)
        return None if best is None else best[1]


def _shares(point: Any, corners: Any) -> Any:
    """Barycentric coordinates (3,) of a point (3,) in a triangle (3, 3), by least squares."""
    edges = np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1)
    b, c = np.linalg.lstsq(edges, point - corners[0], rcond=None)[0]
    return np.array([1.0 - b - c, b, c])
