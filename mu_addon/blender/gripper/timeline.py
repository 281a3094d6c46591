"""The grasp on the timeline: both fingers and the cube, of the latest run."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import bpy
import numpy as np

from ...errors import InputError, MuError
from ...files import read_npz
from ..preview import materials, skeletons
from ..results import motion as motion_parts
from ..shared import displays, timeline
from ..shared.compat import set_curve
from ..shared.registration import connected
from . import object as gripper_object
from . import state as grasps
from .properties import PARAMETERS_CHANGED

CUT = "mu_cut"
"""On a finger that plays the grasp: True if it is cut open."""


def parts(root: Any) -> list[Any]:
    """Parts that play the grasp: left finger, right finger, cube."""
    names = (gripper_object.MOVING + name for name in (*gripper_object.SIDES, "cube"))
    return [obj for obj in (gripper_object.part(root, name) for name in names) if obj is not None]


def show(root: Any, scene: Any) -> None:
    """Play the latest grasp on the timeline: both fingers and the cube; raises InputError."""
    found = grasps.of(root)
    data = None if found is None else read_npz(found.folder / "gripper.npz")
    if found is None or data is None:
        raise InputError(
            "there is no grasp of this cube yet", str(grasps.folder_of(root)), "press Grasp first"
        )
    hide(root)
    time = data["time_s"]
    cut = root.mu_gripper.cut
    fingers: Any = [(rest, data["triangles"], data["membrane"]) for rest in data["rest_mm"]]
    if cut:
        # Imported late, with the solver's packages.
        from ...report.grasp_files import write_halves

        fingers = write_halves(found.folder)
    for side, (rest, triangles, membrane) in zip(gripper_object.SIDES, fingers, strict=True):
        obj = gripper_object.new_part(root, gripper_object.MOVING + side)
        obj[CUT] = cut
        slots = np.where(membrane, 0, 1)
        skeleton = skeletons.Skeleton(rest.astype(float), faces=(triangles,), slots=slots)
        skeletons.write(obj.data, skeleton)
        materials.assign(obj.data, "MU Membrane", "MU Lattice")
        file = found.folder / f"{side}{'-cut' if cut else ''}.pc2"
        motion_parts.play(obj, file, motion_parts.step_of(file))
    half = np.full(3, float(data["cube_side_mm"]) / 2.0)
    cube = gripper_object.put_box(root, gripper_object.MOVING + "cube", -half, half, "MU Obstacle")
    frames = timeline.frames_at(scene, time - time[0])
    for axis in range(3):
        set_curve(cube, "location", axis, frames, data["cube_mm"][:, axis])
    scene.frame_end = int(np.ceil(frames[-1]))
    _hide_preview(root, True)


@connected(PARAMETERS_CHANGED)
def _follow(root: Any) -> None:
    """Cut a played grasp open, or close it, by the gripper's setting."""
    shown = parts(root)
    if shown and bool(shown[0].get(CUT)) != root.mu_gripper.cut:
        with suppress(MuError):
            show(root, bpy.context.scene)


def hide(root: Any) -> None:
    """Remove the grasp from the scene; its files stay."""
    for obj in parts(root):
        displays.remove(obj)
    _hide_preview(root, False)


def _hide_preview(root: Any, hidden: bool) -> None:
    """Hide the parts of the gripper that the grasp shows, or show it whole again."""
    cube = gripper_object.part(root, "cube")
    if cube is not None:
        cube.hide_viewport = cube.hide_render = hidden
    gripper_object.rebuild(root)
