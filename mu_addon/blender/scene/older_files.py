"""Files of extensions up to 0.1, where a unit or gripper was an Empty with a child for every part.

Each such root becomes one mesh object, which takes over its parameters, place, parent, children and name;
parts that are drawn anew are removed. What was made of them, a solid and an envelope, is kept.
"""

from __future__ import annotations

from typing import Any

import bpy

from ..gripper import object as gripper_object
from ..shared import displays, scene_units, updates
from ..shared.compat import stored
from ..unit import object as unit_object

_DEFAULT_NAMES = ("Monolithic Unit", "Monolithic Gripper")
_PLACE = (
    "location", "rotation_mode", "rotation_euler", "rotation_quaternion", "rotation_axis_angle",
    "delta_location", "delta_rotation_euler", "delta_rotation_quaternion",
    "hide_viewport", "hide_render", "hide_select", "color", "lock_location", "lock_rotation",
)  # fmt: skip


def renew() -> None:
    """Turn every such root of this file into one object, and rename older marks; others are left alone."""
    for obj in bpy.data.objects:
        if displays.editable(obj) and isinstance(older := obj.get(displays.OLDER_MOTION), str):
            del obj[displays.OLDER_MOTION]
            obj[displays.MOTION] = older
    for old in [*unit_object.roots(), *gripper_object.roots()]:
        if old.type == "EMPTY":
            _renewed(old)


def _renewed(old: Any) -> Any:
    title = stored(old, "mu_unit" if old.mu_unit.uuid else "mu_gripper", "title")
    name = old.name
    if title and name.partition(".")[0] in _DEFAULT_NAMES:
        name = title
    # Its old name is given up first, or the new object would be NAME.001.
    old.name = f"{old.name} (old)"
    root = bpy.data.objects.new(name, bpy.data.meshes.new(name))
    with updates.paused():
        for found in bpy.types.Object.bl_rna.properties:
            if found.identifier.startswith("mu_") and found.type == "POINTER":
                _copy(getattr(old, found.identifier), getattr(root, found.identifier))
    for key in old.keys():  # noqa: SIM118 - not a mapping
        if not key.startswith("mu_"):
            root[key] = old[key]
    for attribute in _PLACE:
        setattr(root, attribute, getattr(old, attribute))
    root.parent, root.parent_type, root.parent_bone = old.parent, old.parent_type, old.parent_bone
    root.matrix_parent_inverse = old.matrix_parent_inverse.copy()
    root.lock_scale = (True, True, True)
    root.scale = (scene_units.mm(bpy.context.scene),) * 3
    for constraint in old.constraints:
        root.constraints.copy(constraint)
    _take_animation(old, root)
    for collection in old.users_collection:
        collection.objects.link(root)
    children = list(old.children)
    for scene in bpy.data.scenes:
        for layer in scene.view_layers:
            if layer.objects.active == old:
                layer.objects.active = root
                root.select_set(True, view_layer=layer)
    # Parents, constraints, drivers and pointers that named the old object name the new one.
    old.user_remap(root)
    for child in children:
        _take(root, child)
    bpy.data.objects.remove(old)
    root.mu_unit.built = ""
    if root.mu_unit.uuid:
        unit_object.rebuild(root)
    else:
        gripper_object.rebuild(root)
    return root


def _copy(old: Any, new: Any) -> None:
    """Copy the values of a property group into another of its kind."""
    for found in old.bl_rna.properties:
        name = found.identifier
        if name in ("rna_type", "title"):
            continue
        value = getattr(old, name)
        if found.type == "COLLECTION":
            items = getattr(new, name)
            items.clear()
            for item in value:
                _copy(item, items.add())
        elif found.type == "POINTER" and isinstance(value, bpy.types.PropertyGroup):
            _copy(value, getattr(new, name))
        elif not found.is_readonly and old.is_property_set(name):
            setattr(new, name, value)


def _take_animation(old: Any, root: Any) -> None:
    """Have an object animated as another one is: its action and its drivers."""
    if old.animation_data is None:
        return
    taken = root.animation_data_create()
    if old.animation_data.action is not None:
        taken.action = old.animation_data.action
        taken.action_slot = old.animation_data.action_slot
    for driver in old.animation_data.drivers:
        taken.drivers.from_existing(src_driver=driver)


def _take(root: Any, child: Any) -> None:
    """A child of the old root: kept as a display or the user's own, as a mesh, or drawn anew and removed."""
    part = child.get(displays.PART, "")
    if part == "solid":
        mesh = child.data
        for key in child.keys():  # noqa: SIM118 - not a mapping
            if key.startswith("mu_") and key != displays.PART:
                mesh[key] = child[key]
        # Its shape stands for what it was built from; the hash of then had the name in it.
        root.mu_unit.solid = mesh
    elif part == "envelope":
        root.mu_unit.envelope = child.data
    grip = child.get(displays.GRIPPER, "")
    if part or (grip and grip != "cube" and not grip.startswith("moving:")):
        for below in child.children_recursive:
            if below.get(displays.GRIPPER):
                displays.remove(below)
        displays.remove(child)
        return
    for obj in (child, *child.children_recursive):
        if any(obj.get(mark) is not None for mark in displays.MARKS):
            obj[displays.OWNER] = displays.uuid_of(root)
