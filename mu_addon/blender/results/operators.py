"""Show a study's motion on the timeline, take it away, fit its colours, and look at its pictures."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ...errors import InputError
from ...report.motion_files import FOLDER, MODEL_A
from ..shared import viewports
from ..shared.blender_property import Choice, Flag, Text
from ..shared.operators import operator, unless
from ..shared.registration import menu
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator
from . import legend_object, places
from . import motion as motion_parts

NO_MOTION = "No motion yet: simulate this unit first"


class MotionOperator(UnitOperator):
    """An operator on the active unit whose study holds a motion."""

    trouble = unless(motion_parts.motion_of, NO_MOTION)


@operator(
    MotionOperator,
    "Show Motion",
    name=Text("Whose", "`model_a`, the unit without a sensor, or a path's name", default=MODEL_A),
    what=Choice(
        "Body",
        "What moves",
        items=[
            (motion_parts.MESH, "Analysis Mesh", "The analysis mesh with its fields"),
            (motion_parts.PRINT, "Printable Solid", "The printable body, moved with the mesh"),
        ],
    ),
    on=Flag("Show", "Show or hide it", default=True),
    timeline=Flag("Fit Timeline", "End the scene's timeline where the protocol ends", default=True),
)
def motion(context, root, name, what, on, timeline):
    """Show or hide the motion without a sensor or with a path, as mesh or as print"""
    motion = motion_parts.motion_of(root)
    if name not in (MODEL_A, *motion.paths):
        raise InputError(
            f"there is no motion of {name!r}",
            str(motion.folder),
            f"choose one of {', '.join((MODEL_A, *motion.paths))}",
        )
    if not on:
        motion_parts.hide(root, name, what)
        return
    if root.mu_motion.on_unit:
        unit_object.hide_candidates(root)
    motion_parts.show(root, name, what)
    if timeline:
        context.scene.frame_end = motion_parts.last_frame(motion, context.scene)


@operator(UnitOperator, "Clear Motion")
def motion_clear(root):
    """Remove every motion of this unit from the scene; the study's files stay"""
    for name, what in motion_parts.shown(root):
        motion_parts.hide(root, name, what)
    legend_object.hide(root)


@operator(MotionOperator, "Update Motion")
def motion_update(root):
    """Rebuild the shown motion from the study's files, after another simulation"""
    motion_parts.rebuild(root)
    root.mu_motion.trouble = ""


@operator(MotionOperator, "Fit Range")
def motion_range(root):
    """Fit the range of the colours to the field over the whole motion"""
    settings = root.mu_motion
    settings.low, settings.high = motion_parts.extent(root, settings.field)


@operator(
    MotionOperator,
    "Legend in Renders",
    on=Flag("Show", "Show or hide it", default=True),
)
def motion_legend(root, on):
    """Add the legend to the scene next to the unit, so that renders show it, or remove it"""
    legend_object.show(root) if on else legend_object.hide(root)


class MU_OT_colours(bpy.types.Operator):
    """Let this 3D view show the colours of results: solid shading by attribute"""

    bl_label = "Show Colours"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        cls.poll_message_set("Press it in the header of a 3D view")
        return context.area is not None and context.area.type == "VIEW_3D"

    def execute(self, context):
        context.space_data.shading.type = "SOLID"
        viewports.show_colours()
        viewports.redraw()
        return {"FINISHED"}


@menu("VIEW3D_MT_editor_menus")
def draw_colours(self, context) -> None:
    """Draw, in the header of a 3D view that cannot show the colours that are there, the button for it."""
    if not viewports.shows_colours(context) and unit_object.first_that(context, places.coloured) is not None:
        row = self.layout.row()
        row.alert = True
        row.operator("mu.colours", icon="COLOR")


@operator(
    UnitOperator,
    "Enlarge",
    undo=False,
    name=Text("Picture", "Name of its file in the study's folder"),
)
def picture(context, root, name):
    """Open a picture of the study in a new image editor"""
    path = studies.results_folder(root) / FOLDER / name
    if not name or not path.is_file():
        raise InputError("there is no such picture", str(path), "simulate first")
    image = bpy.data.images.load(str(path), check_existing=True)
    image.reload()
    if bpy.app.background:
        return
    bpy.ops.wm.window_new()
    area = context.window_manager.windows[-1].screen.areas[0]
    area.type = "IMAGE_EDITOR"
    area.spaces.active.image = image
