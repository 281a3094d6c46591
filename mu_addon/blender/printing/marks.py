"""Marks of a check's findings in the view: a ball at every location, an arrow along the build direction."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ..preview import materials, nodes, skeletons
from ..shared import displays, viewports
from ..shared.compat import set_modifier_input
from ..unit.properties import to_unit

FAULTS = ("error", "warning")
MARK = displays.CHECK
"""Its value on a mark is the finding's number, and `UP` on the arrow along the build direction."""
UP = "up"
LARGER = 1.8
"""Factor on the ball at the location in view."""
OF = "mu_check_of"
"""On that arrow: digest of the marked check."""
MATERIAL = {"error": "MU Flaws", "warning": "MU Doubt"}


def mark_objects(root: Any) -> list[Any]:
    """Objects that mark the findings of a check."""
    return displays.parts(root, MARK)


def marked(root: Any) -> str:
    """Digest of the check whose locations are marked, or ""."""
    return next((obj[OF] for obj in mark_objects(root) if obj[MARK] == UP), "")


def clear(root: Any) -> None:
    """Remove the marks."""
    displays.clear(root, MARK)
    root.mu_print.finding = -1


def mark(root: Any, found: Any) -> None:
    """Put a ball at every location of every error and warning, replacing earlier ones."""
    clear(root)
    for number, finding in enumerate(found.content["findings"]):
        if finding["severity"] not in FAULTS or not len(finding["places"]):
            continue
        name = f"{finding['check'].capitalize()} ({finding['severity']})"
        obj = _mark_object(root, name, bpy.data.meshes.new(name), str(number))
        radius = np.full(len(finding["places"]), root.mu_print.marker)
        skeletons.write(obj.data, skeletons.Skeleton(finding["places"], attributes={"radius": radius}))
        materials.assign(obj.data, MATERIAL[finding["severity"]])
        set_modifier_input(nodes.skin(obj, "MU Balls"), "Material", obj.data.materials[0])
        obj.hide_render = True
    arrow = _mark_object(root, "Build Direction", None, UP)
    arrow[OF] = found.digest
    arrow.empty_display_type = "SINGLE_ARROW"
    unit = to_unit(root.mu_unit).dimensions
    arrow.empty_display_size = 2.0 * unit.cell
    arrow.location = (0.0, unit.bounds[1][0] - unit.cell, 0.0)
    arrow.rotation_mode = "QUATERNION"
    arrow.rotation_quaternion = Vector(found.content["direction"]).to_track_quat("Z", "Y")


def _mark_object(root: Any, name: str, data: Any, value: str) -> Any:
    obj = displays.lock(displays.add(root, MARK, value, data, name))
    obj.show_in_front = True
    return obj


def resize(root: Any) -> None:
    """Give the marks the set radius, and the location in view a larger one."""
    settings = root.mu_print
    for obj in mark_objects(root):
        if obj.data is None:
            continue
        values = np.full(len(obj.data.vertices), settings.marker, np.float32)
        if obj[MARK] == str(settings.finding):
            values[settings.place % len(values)] *= LARGER
        obj.data.attributes["radius"].data.foreach_set("value", values)
        obj.data.update()


def frame(root: Any, place: Any, reach: float) -> None:
    """Turn every 3D view to a position (3,) in mm of the unit's frame, showing `reach` mm around it."""
    centre = root.matrix_world @ Vector(place)
    for area in viewports.areas():
        view = area.spaces.active.region_3d
        view.view_location = centre
        view.view_distance = 4.0 * reach * root.matrix_world.median_scale
        if view.view_perspective == "CAMERA":
            view.view_perspective = "PERSP"
