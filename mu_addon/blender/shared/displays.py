"""Objects that show something of a unit or gripper beside itself: candidate paths, motions, marks, a legend.

Each is a child of the root object, or of another such child, and carries one of these marks, which says what
it shows, and its owner's UUID. `unit.gestures` has them follow their root: deleted, hidden and moved to
another collection with it.
"""

from __future__ import annotations

from typing import Any

import bpy

PART = "mu_part"
"""Marks candidate paths and what a body's check found, see `unit.drawing`."""
MOTION = "mu_motion_part"
"""Marks the objects that show a study's motion, see `results.motion`. Not the name of a property group: up
to Blender 4.5 those are among an object's custom properties."""
EVIDENCE = "mu_evidence_part"
"""Marks the objects that show measured motion, see `evidence.motion`."""
CHECK = "mu_check"
"""Marks the objects that show what a print check found, see `printing.marks`."""
LAYER = "mu_layer"
"""Marks the object that shows a layer of the print, see `printing.layer`."""
LEGEND = "mu_legend"
"""Marks the objects of a legend in the scene, see `results.legend_object`."""
TWIN = "mu_twin"
"""Marks the objects that move as the real unit does, see `sensor.twin`."""
PAINTED = "mu_painted"
"""Marks the object on which factors of the struts are painted, see `grading.state`."""
GRIPPER = "mu_grip"
"""Marks the cube of a gripper and what plays its grasp, see `gripper.object`."""
MARKS = (PART, MOTION, EVIDENCE, CHECK, LAYER, LEGEND, TWIN, PAINTED, GRIPPER)
OWNER = "mu_of"
"""On each: UUID of the unit or gripper that it belongs to."""

ON_UNIT = "mu_on_unit"
"""On a motion's object that is not seen itself: the unit shows it in its own place."""


def on_unit(root: Any) -> list[Any]:
    """The objects whose motion a unit shows in its own place, by name."""
    found = (child for child in root.children if child.get(MOTION) and child.get(ON_UNIT))
    return sorted(found, key=lambda child: str(child.name))


def uuid_of(root: Any) -> str:
    """UUID of the unit or gripper that an object is the root of, or nothing."""
    return str(root.mu_unit.uuid or root.mu_gripper.uuid)


def root_above(obj: Any) -> Any | None:
    """The root of a unit or gripper that an object is or is below of, or None."""
    while obj is not None and not uuid_of(obj):
        obj = obj.parent
    return obj


def editable(obj: Any) -> bool:
    """Whether an object belongs to this file: neither linked from a library nor an override of such."""
    return obj.library is None and obj.override_library is None


def add(root: Any, mark: str, value: str, data: Any, title: str = "", parent: Any = None) -> Any:
    """A new display of a root, in its collections, below it or below another display."""
    obj = bpy.data.objects.new(title or data.name, data)
    obj[mark], obj[OWNER] = value, uuid_of(root)
    for collection in root.users_collection:
        collection.objects.link(obj)
    obj.parent = parent or root
    return obj


def lock(obj: Any, location: bool = True) -> Any:
    """Keep a display where it belongs: moved by hand it would no longer show what it says."""
    obj.lock_location = (location,) * 3
    obj.lock_rotation = obj.lock_scale = (True, True, True)
    return obj


def remove(obj: Any) -> None:
    """Remove a display and, where nothing else uses them, its data and its action."""
    data, action = obj.data, obj.animation_data.action if obj.animation_data else None
    bpy.data.objects.remove(obj)
    if data is not None and not data.users:
        (bpy.data.curves if isinstance(data, bpy.types.Curve) else bpy.data.meshes).remove(data)
    if action is not None and not action.users:
        bpy.data.actions.remove(action)
