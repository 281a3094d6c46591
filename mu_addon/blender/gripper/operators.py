"""Add a gripper, simulate its grasp in a child process, and play the grasp."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import attrs
import bpy
from bpy.props import BoolProperty, EnumProperty

from ...design.anchors import farthest_window, windows
from ...design.gripper import gripper_names, load_gripper
from ..jobs.operators import job_operators
from ..shared import landing, viewports
from ..shared.operators import RootOperator, reports_errors
from ..simulate.study_job import StudyOperator
from ..unit.object import active_root
from ..unit.properties import to_unit
from . import object as gripper_object
from . import state as grasps
from . import timeline

NO_GRIPPER = "Select a Monolithic Gripper, or add one: Add > Mesh > Monolithic Gripper"

_items: list[tuple[str, str, str]] = []


def _preset_items(self, context):
    # Blender does not keep these strings alive; this list does.
    _items[:] = [(name, name.capitalize(), "") for name in gripper_names()]
    return _items


class MU_OT_gripper_add(bpy.types.Operator):
    """Add a Monolithic Gripper: two units that face each other on a plate, one part to print"""

    bl_idname = "mu.gripper_add"
    bl_label = "Monolithic Gripper"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Preset", description="Gripper to begin with", items=_preset_items, options={"SKIP_SAVE"}
    )
    of_unit: BoolProperty(
        name="Of the Active Unit",
        description="Its fingers are copies of the active unit, with its sensor path",
        options={"SKIP_SAVE"},
    )

    @reports_errors
    def execute(self, context):
        found = load_gripper(self.preset)
        unit = active_root(context) if self.of_unit else None
        if unit is not None:
            own, path = to_unit(unit.mu_unit), unit.mu_unit.path
            count = own.chambers.count
            if path not in {one.name for one in windows(count)}:
                # The plate covers where paths near the inlet end.
                path = farthest_window(count).name
            found = attrs.evolve(found, unit=own, path=path, name=f"{unit.mu_unit.title[:72]} gripper")
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        landing.land(context, gripper_object.create(context, found))
        viewports.frame_selected(context)
        return {"FINISHED"}


class GripperOperator(RootOperator):
    """An operator on the active gripper."""

    find_root = staticmethod(gripper_object.active)
    no_root = NO_GRIPPER


class MU_OT_gripper_delete(GripperOperator, bpy.types.Operator):
    """Delete the gripper with all its parts; its folder stays"""

    bl_idname = "mu.gripper_delete"
    bl_label = "Delete Gripper"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        gripper_object.delete(root)


class MU_OT_grasp(StudyOperator, GripperOperator, bpy.types.Operator):
    """Run the chosen job in a child process; Blender stays usable, and finished stages are not repeated"""

    bl_idname = "mu.grasp"
    bl_label = "Grasp"
    bl_options = {"REGISTER"}

    job = grasps.GRASPING


class MU_OT_grasp_show(GripperOperator, bpy.types.Operator):
    """Play the grasp on the timeline, both fingers and the cube, or hide it"""

    bl_idname = "mu.grasp_show"
    bl_label = "Show Grasp"
    bl_options = {"REGISTER", "UNDO"}

    on: BoolProperty(name="Show", description="Show or hide it", default=True)

    def act(self, context, root):
        if self.on:
            timeline.show(root, context.scene)
        else:
            timeline.hide(root)


CLASSES = (
    MU_OT_gripper_add,
    MU_OT_gripper_delete,
    MU_OT_grasp,
    *job_operators(
        grasps.GRASP,
        "grasp_",
        "grasp",
        kept="finished stages are kept, and the next run continues from there",
        first="press Grasp first",
        base=GripperOperator,
    ),
    MU_OT_grasp_show,
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
