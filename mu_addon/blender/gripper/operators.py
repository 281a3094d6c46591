"""Add a gripper, simulate its grasp in a child process, and play the grasp."""

import attrs

from ...design.anchors import farthest_window, windows
from ...design.gripper import gripper_names, load_gripper
from ..jobs.operators import job_operators
from ..shared import landing, viewports
from ..shared.blender_property import Choice, Flag, listed
from ..shared.operators import FreeOperator, RootOperator, operator
from ..unit.object import active_root
from ..unit.properties import to_unit
from . import object as gripper_object
from . import state as grasps
from . import timeline

NO_GRIPPER = "Select a Monolithic Gripper, or add one: Add > Mesh > Monolithic Gripper"


def _presets() -> list[tuple[str, str, str]]:
    return [(name, name.capitalize(), "") for name in gripper_names()]


@operator(
    FreeOperator,
    "Monolithic Gripper",
    preset=Choice("Preset", "Gripper to begin with", items=listed(_presets), options={"SKIP_SAVE"}),
    of_unit=Flag(
        "Of the Active Unit",
        "Its fingers are copies of the active unit, with its sensor path",
        options={"SKIP_SAVE"},
    ),
)
def gripper_add(context, preset, of_unit):
    """Add a Monolithic Gripper: two units that face each other on a plate, one part to print"""
    found = load_gripper(preset)
    unit = active_root(context) if of_unit else None
    if unit is not None:
        own, path = to_unit(unit.mu_unit), unit.mu_unit.path
        count = own.chambers.count
        if path not in {one.name for one in windows(count)}:
            # The plate covers where paths near the inlet end.
            path = farthest_window(count).name
        found = attrs.evolve(found, unit=own, path=path, name=f"{unit.mu_unit.title[:72]} gripper")
    landing.land(context, gripper_object.create(context, found))
    viewports.frame_selected(context)


class GripperOperator(RootOperator):
    """An operator on the active gripper."""

    find_root = staticmethod(gripper_object.active)
    no_root = NO_GRIPPER


@operator(GripperOperator, "Delete Gripper")
def gripper_delete(root):
    """Delete the gripper with all its parts; its folder stays"""
    gripper_object.delete(root)


@operator(GripperOperator, "Grasp", undo=False, trouble=grasps.GRASPING.trouble)
def grasp(root):
    """Run the chosen job in a child process; Blender stays usable, and finished stages are not repeated"""
    grasps.GRASPING.start(root)


@operator(GripperOperator, "Show Grasp", on=Flag("Show", "Show or hide it", default=True))
def grasp_show(context, root, on):
    """Play the grasp on the timeline, both fingers and the cube, or hide it"""
    if on:
        timeline.show(root, context.scene)
    else:
        timeline.hide(root)


job_operators(grasps.GRASP, "press Grasp first", base=GripperOperator)
