"""Objects that display results of a unit or gripper: candidate paths, motions, marks, a legend.

Each is a child of the root object, or of another such child, and carries one of these marks, which names its
content, and its owner's UUID. `scene.gestures` lets them follow their root: deleted, hidden and moved to
another collection with it.
"""

from __future__ import annotations

from typing import Any

import bpy

PART = "mu_part"
"""Mark of candidate paths and of flaws found by a body's check, see `unit.drawing`."""
MOTION = "mu_motion_part"
"""Mark of the objects that show a study's motion, see `results.motion`. It must differ from property groups:
up to Blender 4.5 those are among an object's custom properties."""
EVIDENCE = "mu_evidence_part"
"""Mark of the objects that show measured motion, see `evidence.timeline`."""
CHECK = "mu_check"
"""Mark of the objects that show a print check's findings, see `printing.marks`."""
LAYER = "mu_layer"
"""Mark of the object that shows a layer of the print, see `printing.layer`."""
LEGEND = "mu_legend"
"""Mark of the objects of a legend in the scene, see `results.legend_object`."""
TWIN = "mu_twin"
"""Mark of the objects that move as the real unit does, see `sensor.twin`."""
LIVE = "mu_live_part"
"""Mark of the objects that show a unit bent while it is designed, see `live_bending.state`."""
PAINTED = "mu_painted"
"""Mark of the object on which factors of the struts are painted, see `grading.state`."""
GRIPPER = "mu_grip"
"""Mark of the cube of a gripper and the parts that play its grasp, see `gripper.object`."""
OWNER = "mu_of"
"""On each: UUID of its unit or gripper."""

ON_UNIT = "mu_on_unit"
"""On a hidden motion's object: the unit shows it in its place."""


def parts(root: Any, mark: str) -> list[Any]:
    """Displays of a root with a mark."""
    return [child for child in root.children if child.get(mark)]


def part(root: Any, mark: str, value: str) -> Any | None:
    """A root's display with that value of a mark, or None."""
    return next((child for child in root.children if child.get(mark) == value), None)


def clear(root: Any, mark: str) -> None:
    """Remove the displays of a root with a mark."""
    for one in parts(root, mark):
        remove(one)


def on_unit(root: Any, mark: str = MOTION) -> list[Any]:
    """Objects with a mark whose shape a unit shows in its place, by name."""
    found = (child for child in parts(root, mark) if child.get(ON_UNIT))
    return sorted(found, key=lambda child: str(child.name))


def uuid_of(root: Any) -> str:
    """UUID of the unit or gripper that an object is the root of, or ""."""
    return str(root.mu_unit.uuid or root.mu_gripper.uuid)


def root_above(obj: Any) -> Any | None:
    """Root of the unit or gripper that an object is or belongs to, or None."""
    while obj is not None and not uuid_of(obj):
        obj = obj.parent
    return obj


def by_uuid(uuid: str) -> Any | None:
    """Root of this file with that UUID, or None where it was deleted."""
    return next((o for o in bpy.data.objects if uuid_of(o) == uuid and editable(o)), None)


def editable(obj: Any) -> bool:
    """Return True if an object belongs to this file: neither linked from a library nor an override."""
    return obj.library is None and obj.override_library is None


def add(root: Any, mark: str, value: str, data: Any, title: str = "", parent: Any = None) -> Any:
    """Add a display of a root, in its collections, below it or below another display."""
    obj = bpy.data.objects.new(title or data.name, data)
    obj[mark], obj[OWNER] = value, uuid_of(root)
    for collection in root.users_collection:
        collection.objects.link(obj)
    obj.parent = parent or root
    return obj


def lock(obj: Any, location: bool = True) -> Any:
    """Lock the transform of a display: moved by hand it would be wrong."""
    obj.lock_location = (location,) * 3
    obj.lock_rotation = obj.lock_scale = (True, True, True)
    return obj


def remove_root(root: Any, *meshes: Any) -> None:
    """Remove a unit or gripper with its displays and those of its meshes that nothing else uses."""
    uuid, own = uuid_of(root), dict.fromkeys(mesh for mesh in (root.data, *meshes) if mesh is not None)
    for child in root.children_recursive:
        if child.get(OWNER) == uuid:
            remove(child)
    bpy.data.objects.remove(root)
    for mesh in own:
        if not mesh.users:
            bpy.data.meshes.remove(mesh)


def remove(obj: Any) -> None:
    """Remove a display and, if nothing else uses them, its data and its action."""
    data, action = obj.data, obj.animation_data.action if obj.animation_data else None
    bpy.data.objects.remove(obj)
    if data is not None and not data.users:
        (bpy.data.curves if isinstance(data, bpy.types.Curve) else bpy.data.meshes).remove(data)
    if action is not None and not action.users:
        bpy.data.actions.remove(action)
