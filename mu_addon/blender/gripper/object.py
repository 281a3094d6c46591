"""A gripper in the scene: a root object with its parameters, two fingers, plate and cube.

Its parts are children, known by the custom property `mu_grip`; frame and places are the core's.
"""

from __future__ import annotations

import uuid
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...design.gripper import Gripper
from ...design.steps import StepInputs
from ...errors import MuError
from ..preview import materials, skeletons
from ..shared import updates
from ..shared.texts import error_text
from ..steps import state as stack
from ..unit import object as unit_object
from ..unit.properties import exact
from .properties import PARAMETERS_CHANGED, from_gripper, to_gripper

PART = "mu_grip"
"""Marks the parts: `finger:SIDE`, `finger:SIDE:NAME`, `plate`, `cube`, `moving:SIDE`, `moving:cube`."""
SIDES = ("left", "right")
SHOWN = ("membranes", "struts", "wells")
"""Steps of a finger's unit that are drawn."""
BEYOND_MM = 3.0
"""The cube's middle beyond the tips where it is put first, as the core's `Grip` has it; that cannot be asked
without the solver."""


def roots() -> list[Any]:
    """Root objects of all grippers in the file."""
    return [o for o in bpy.data.objects if o.mu_gripper.uuid]


def active(context: Any) -> Any | None:
    """The gripper to work on: that of the active object, or the only one there is if no unit is active."""
    obj = context.object
    while obj is not None:
        if obj.mu_gripper.uuid:
            return obj
        if obj.mu_unit.uuid:
            return None
        obj = obj.parent
    found = [o for o in context.scene.objects if o.mu_gripper.uuid]
    return found[0] if len(found) == 1 else None


def part(root: Any, name: str) -> Any | None:
    """The gripper's part of that name, or None."""
    return next((child for child in root.children_recursive if child.get(PART) == name), None)


def create(context: Any, gripper: Gripper) -> Any:
    """A new gripper at the 3D cursor of the scene, with its preview, selected and active."""
    root = unit_object.new_root(context, "Monolithic Gripper", gripper.unit.dimensions.cell)
    with updates.paused():
        root.mu_gripper.uuid = uuid.uuid4().hex
        from_gripper(root.mu_gripper, gripper)
    rebuild(root)
    unit_object.make_active(context, root)
    return root


def delete(root: Any) -> None:
    """Remove a gripper with all its parts."""
    for child in root.children_recursive:
        unit_object.remove_part(child)
    bpy.data.objects.remove(root)


def rebuild(root: Any) -> bool:
    """Draw the gripper from its parameters; where they break a rule the last good one stays."""
    props = root.mu_gripper
    try:
        _draw(root, to_gripper(props))
        trouble = ""
    except MuError as error:
        trouble = error_text(error)
    if props.trouble != trouble:
        props.trouble = trouble
    return not trouble


def _draw(root: Any, gripper: Gripper) -> None:
    given = StepInputs(gripper.unit, gripper.path)
    drawn = {}
    for step in SHOWN:
        name, draw = unit_object.DRAWN[step]
        drawn[name] = draw(stack.STACK.value(step, given), given, root.mu_gripper.cut)
    for side, (rotation, shift) in zip(SIDES, gripper.placements, strict=True):
        finger = part(root, f"finger:{side}") or new_part(root, root, f"finger:{side}", None)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, shift
        finger.matrix_local = Matrix(matrix.tolist())
        for name, skeleton in drawn.items():
            mark = f"finger:{side}:{name}"
            if skeleton is None:
                continue
            obj = part(root, mark) or new_part(root, finger, mark, bpy.data.meshes.new(name.capitalize()))
            unit_object.draw_part(obj, name, skeleton)
    x, y = (extent / 2.0 for extent in gripper.size_mm)
    put_box(root, "plate", (-x, -y, -gripper.plate.thickness_mm), (x, y, 0.0), "MU Plate")
    first = part(root, "cube") is None
    half = np.full(3, root.mu_gripper.cube_mm / 2.0)
    cube = put_box(root, "cube", -half, half, "MU Obstacle")
    if first:
        cube.location.z = gripper.unit.dimensions.height + BEYOND_MM
        # Fingers and cube are solved as mirror images: it may be moved between them, along them alone.
        cube.lock_location[2] = False


def beyond_mm(root: Any) -> float:
    """How far beyond the tips the cube's middle is, where the user has it."""
    cube = part(root, "cube")
    if cube is None:
        return BEYOND_MM
    # Digits beyond a nanometre are single precision's.
    return round(exact(cube.location.z) - to_gripper(root.mu_gripper).unit.dimensions.height, 6)


def put_box(root: Any, name: str, low: Any, high: Any, material: str) -> Any:
    """The part of that name as a box between two corners (3,) in mm."""
    obj = part(root, name) or new_part(root, root, name, bpy.data.meshes.new(name.capitalize()))
    skeletons.write(obj.data, skeletons.box(low, high), smooth=False)
    materials.assign(obj.data, material)
    return obj


def new_part(root: Any, parent: Any, name: str, data: Any) -> Any:
    """A new part of the gripper, a child of `parent`, locked in its place."""
    words = name.replace(":", " ").capitalize()
    obj = bpy.data.objects.new(words, data)
    obj[PART] = name
    for collection in root.users_collection:
        collection.objects.link(obj)
    obj.parent = parent
    # Parts follow their root; moved by hand they would no longer show the gripper.
    obj.lock_location = obj.lock_rotation = obj.lock_scale = (True, True, True)
    if data is None:
        obj.empty_display_size = 1.0
    return obj


def _parameters_changed(root: Any) -> None:
    if not updates.are_paused() and root.mu_gripper.uuid:
        rebuild(root)


def register() -> None:
    """Rebuild a gripper when its parameters change."""
    PARAMETERS_CHANGED.connect(_parameters_changed)


def unregister() -> None:
    """Rebuild it no more."""
    PARAMETERS_CHANGED.disconnect(_parameters_changed)
