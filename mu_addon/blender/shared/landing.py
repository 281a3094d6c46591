"""Position of a new unit or gripper: at the 3D cursor or, if it is occupied, next to it."""

from __future__ import annotations

from typing import Any

import numpy as np
from mathutils import Vector

from . import scene_units

GAP_MM = 10.0
"""Distance kept to other objects."""
Box = tuple[Any, Any]


def land(context: Any, root: Any) -> None:
    """Move a new root along x until it overlaps no visible object."""
    context.view_layer.update()
    low, high = _box(root)
    gap = GAP_MM * scene_units.mm(context.scene)
    boxes = [_box(o) for o in context.visible_objects if o != root and o.parent != root and _has_body(o)]
    shift = clear(low, high, boxes, gap)
    if shift:
        root.location.x += shift
        context.view_layer.update()


def clear(low: Any, high: Any, boxes: list[Box], gap: float) -> float:
    """Distance along +x by which a box (3,), (3,) is moved to be `gap` away from every other."""
    start = float(low[0])
    width = float(high[0] - low[0])
    x = start
    for other_low, other_high in sorted(boxes, key=lambda box: float(box[0][0])):
        aside = any(
            other_low[axis] > high[axis] + gap or low[axis] > other_high[axis] + gap for axis in (1, 2)
        )
        # By start along x: later boxes leave room at the present position.
        if not aside and other_low[0] <= x + width + gap and other_high[0] >= x - gap:
            x = max(x, float(other_high[0]) + 1.001 * gap)
    return x - start


def _has_body(obj: Any) -> bool:
    return obj.type in ("MESH", "CURVE", "SURFACE", "META", "FONT", "VOLUME", "POINTCLOUD", "CURVES")


def _box(obj: Any) -> Box:
    """Corners of an object's bounding box along the axes of the world."""
    points = np.array([obj.matrix_world @ Vector(corner) for corner in obj.bound_box])
    return points.min(axis=0), points.max(axis=0)
