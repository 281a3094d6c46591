"""A gripper in the scene: one mesh object that holds its parameters, with both fingers and the plate.

The cube is a child, identified by the custom property `mu_grip`; frame and positions are the core's.
"""

from __future__ import annotations

import uuid
from typing import Any

import bpy
import numpy as np

from ...design.gripper import Gripper
from ...design.steps import StepInputs
from ...errors import MuError
from ...grasp.settings import BEYOND
from ..preview import materials, skeletons
from ..shared import displays, updates
from ..shared.blender_property import exact
from ..shared.registration import connected
from ..shared.wording import error_text
from ..unit import drawing
from ..unit import object as unit_object
from .properties import PARAMETERS_CHANGED, from_gripper, to_gripper

PART = displays.GRIPPER
"""Mark of the parts in addition to the gripper's mesh: `cube`, and those that play the grasp."""
MOVING = "moving:"
"""Prefix of the names of the parts that play the grasp: `moving:SIDE`, `moving:cube`."""
SIDES = ("left", "right")
SHOWN = ("membranes", "struts", "wells")
"""Steps of a finger's unit that are drawn."""


def roots() -> list[Any]:
    """All grippers of this file, without those of linked libraries."""
    return [o for o in bpy.data.objects if o.mu_gripper.uuid and displays.editable(o)]


def active(context: Any) -> Any | None:
    """Gripper to work on: that of the active object, or the only one if no unit is worked on."""
    above = displays.root_above(unit_object.active_object(context))
    if above is not None:
        return above if above.mu_gripper.uuid else None
    found = [o for o in context.scene.objects if o.mu_gripper.uuid]
    return found[0] if len(found) == 1 and unit_object.active_root(context) is None else None


def part(root: Any, name: str) -> Any | None:
    """The gripper's part of that name, or None."""
    return displays.part(root, PART, name)


def create(context: Any, gripper: Gripper) -> Any:
    """A new gripper at the 3D cursor of the scene, with its preview, selected and active."""
    root = unit_object.new_root(context, gripper.name)
    with updates.paused():
        root.mu_gripper.uuid = uuid.uuid4().hex
        from_gripper(root.mu_gripper, gripper)
    rebuild(root)
    unit_object.make_active(context, root)
    return root


def delete(root: Any) -> None:
    """Remove a gripper with its displays; the user's own children stay."""
    displays.remove_root(root)


def rebuild(root: Any) -> bool:
    """Draw the gripper from its parameters; if they break a rule the last valid one stays."""
    props = root.mu_gripper
    if root.mode == "EDIT":
        return not props.trouble
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
    finger = drawing.shapes(given, list(SHOWN), root.mu_gripper.cut)
    x, y = (extent / 2.0 for extent in gripper.size_mm)
    drawn = {drawing.PLATE: skeletons.box((-x, -y, -gripper.plate.thickness_mm), (x, y, 0.0))}
    if part(root, MOVING + "cube") is None:  # else the grasp is played, whose fingers stand in their place
        for side, (rotation, shift) in zip(SIDES, gripper.placements, strict=True):
            own = finger
            if root.mu_gripper.cut and rotation[0, 0] < 0:
                # Both fingers show their section on the same side.
                own = {n: skeletons.mirrored(s) for n, s in finger.items()}
            drawn |= {f"{side}:{n}": skeletons.placed(s, rotation, shift) for n, s in own.items()}
    mesh = drawing.own_mesh(root, root.data, [o.data for o in roots() if o != root])
    if mesh != root.data:
        root.data = mesh
    drawing.write(root, mesh, drawn)
    first = part(root, "cube") is None
    half = np.full(3, root.mu_gripper.cube_mm / 2.0)
    cube = put_box(root, "cube", -half, half, "MU Obstacle")
    if first:
        cube.location.z = gripper.unit.dimensions.height + BEYOND.default
        # Fingers and cube are solved as mirror images: the cube moves between them, along them only.
        cube.lock_location[2] = False


def beyond_mm(root: Any) -> float:
    """Distance of the cube's middle beyond the tips, as placed by the user."""
    cube = part(root, "cube")
    if cube is None:
        return BEYOND.default
    # Digits beyond a nanometre come from single precision.
    return round(exact(cube.location.z) - to_gripper(root.mu_gripper).unit.dimensions.height, 6)


def put_box(root: Any, name: str, low: Any, high: Any, material: str) -> Any:
    """The part of that name as a box between two corners (3,) in mm."""
    obj = part(root, name) or new_part(root, name)
    skeletons.write(obj.data, skeletons.box(low, high))
    materials.assign(obj.data, material)
    return obj


def new_part(root: Any, name: str) -> Any:
    """Add a part of the gripper, with its transform locked."""
    title = name.replace(":", " ").capitalize()
    return displays.lock(displays.add(root, PART, name, bpy.data.meshes.new(title)))


@connected(PARAMETERS_CHANGED)
def _parameters_changed(root: Any) -> None:
    if not updates.are_paused() and root.mu_gripper.uuid:
        rebuild(root)
