"""A gripper in the scene: a root object with its parameters, two fingers, plate and cube, and their grasp.

Its parts are children, known by the custom property `mu_grip`; frame and places are the core's.
"""

from __future__ import annotations

import uuid
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...design.gripper import Gripper
from ...design.steps import Given
from ...errors import InputError, MuError
from ...files import read_npz
from ..preview import arrays as preview
from ..preview import colours as materials
from ..results import motion as motion_parts
from ..shared.compat import set_curve
from ..steps import state as stack
from ..unit import object as unit_object
from ..unit.live_update import held
from ..unit.properties import exact
from . import state as grasps
from .properties import from_gripper, to_gripper

PART = "mu_grip"
"""Marks the parts: `finger:SIDE`, `finger:SIDE:NAME`, `plate`, `cube`, `moving:SIDE`, `moving:cube`."""
SIDES = ("left", "right")
SHOWN = ("membranes", "struts", "wells")
"""Steps of a finger's unit that are drawn."""
BEYOND_MM = 3.0
"""The cube's middle beyond the tips where it is put first, as the core's `Grip` has it; that cannot be asked
without the solver."""
MOVING = "moving:"


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
    with held():
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
        trouble = "\n".join(text for text in (error.what, error.where, error.remedy) if text)
    if props.trouble != trouble:
        props.trouble = trouble
    return not trouble


def _draw(root: Any, gripper: Gripper) -> None:
    given = Given(gripper.unit, gripper.path)
    drawn = {}
    for step in SHOWN:
        name, draw = unit_object.DRAWN[step]
        drawn[name] = draw(stack.STACK.value(step, given), given, root.mu_gripper.cut)
    for side, (rotation, shift) in zip(SIDES, gripper.placements, strict=True):
        finger = part(root, f"finger:{side}") or _new(root, root, f"finger:{side}", None)
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, shift
        finger.matrix_local = Matrix(matrix.tolist())
        for name, skeleton in drawn.items():
            mark = f"finger:{side}:{name}"
            if skeleton is None:
                continue
            obj = part(root, mark) or _new(root, finger, mark, bpy.data.meshes.new(name.capitalize()))
            unit_object.draw_part(obj, name, skeleton)
    x, y = (extent / 2.0 for extent in gripper.size_mm)
    _box(root, "plate", (-x, -y, -gripper.plate.thickness_mm), (x, y, 0.0), "MU Plate")
    first = part(root, "cube") is None
    half = np.full(3, root.mu_gripper.cube_mm / 2.0)
    cube = _box(root, "cube", -half, half, "MU Obstacle")
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


def _box(root: Any, name: str, low: Any, high: Any, material: str) -> Any:
    obj = part(root, name) or _new(root, root, name, bpy.data.meshes.new(name.capitalize()))
    preview.write(obj.data, preview.box(low, high), smooth=False)
    materials.assign(obj.data, material)
    return obj


def _new(root: Any, parent: Any, name: str, data: Any) -> Any:
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


def moving(root: Any) -> list[Any]:
    """Parts that play the grasp: left finger, right finger, cube."""
    found = (part(root, MOVING + name) for name in (*SIDES, "cube"))
    return [obj for obj in found if obj is not None]


def show_grasp(root: Any, scene: Any) -> None:
    """Play the latest grasp on the timeline: both fingers and the cube; raises InputError."""
    found = grasps.of(root)
    data = None if found is None else read_npz(found.folder / "gripper.npz")
    if found is None or data is None:
        raise InputError(
            "there is no grasp of this cube yet", str(grasps.folder_of(root)), "press Grasp first"
        )
    hide_grasp(root)
    rate = scene.render.fps / scene.render.fps_base
    time = data["time_s"]
    for side, rest in zip(SIDES, data["rest_mm"], strict=True):
        obj = _new(root, root, MOVING + side, bpy.data.meshes.new(f"{side.capitalize()} Finger"))
        slots = np.where(data["membrane"], 0, 1)
        skeleton = preview.Skeleton(rest.astype(float), faces=(data["triangles"],), slots=slots)
        preview.write(obj.data, skeleton)
        materials.assign(obj.data, "MU Membrane", "MU Lattice")
        file = found.folder / f"{side}.pc2"
        motion_parts.play(obj, file, motion_parts.step_of(file))
    half = np.full(3, float(data["cube_side_mm"]) / 2.0)
    cube = _box(root, MOVING + "cube", -half, half, "MU Obstacle")
    frames = scene.frame_start + (time - time[0]) * rate
    for axis in range(3):
        set_curve(cube, "location", axis, frames, data["cube_mm"][:, axis])
    scene.frame_end = int(np.ceil(frames[-1]))
    _hide_still(root, True)


def hide_grasp(root: Any) -> None:
    """Take the grasp out of the scene; its files stay."""
    for obj in moving(root):
        unit_object.remove_part(obj)
    _hide_still(root, False)


def _hide_still(root: Any, hidden: bool) -> None:
    for child in root.children_recursive:
        if child.get(PART, "").startswith(("finger:", "cube")):
            child.hide_viewport = child.hide_render = hidden
