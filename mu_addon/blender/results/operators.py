"""Show a study's motion on the timeline, take it away, fit its colours, and look at its pictures."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ...errors import InputError
from ...report.motion_files import FOLDER, MODEL_A
from ..shared import viewports
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator
from . import legend_object, places
from . import motion as motion_parts

NO_MOTION = "No motion yet: simulate this unit first"


class MotionOperator(UnitOperator):
    """An operator on the active unit whose study holds a motion."""

    @classmethod
    def trouble(cls, root):
        return NO_MOTION if motion_parts.motion_of(root) is None else ""


class MU_OT_motion(MotionOperator, bpy.types.Operator):
    """Show or hide the motion without a sensor or with a path, as mesh or as print"""

    bl_idname = "mu.motion"
    bl_label = "Show Motion"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(
        name="Whose", description="`model_a`, the unit without a sensor, or a path's name", default=MODEL_A
    )
    what: EnumProperty(
        name="Body",
        description="What moves",
        items=[
            (motion_parts.MESH, "Analysis Mesh", "The analysis mesh with its fields"),
            (motion_parts.PRINT, "Printable Solid", "The printable body, moved with the mesh"),
        ],
    )
    on: BoolProperty(name="Show", description="Show or hide it", default=True)
    timeline: BoolProperty(
        name="Fit Timeline", description="End the scene's timeline where the protocol ends", default=True
    )

    def act(self, context, root):
        motion = motion_parts.motion_of(root)
        if self.name not in (MODEL_A, *motion.paths):
            raise InputError(
                f"there is no motion of {self.name!r}",
                str(motion.folder),
                f"choose one of {', '.join((MODEL_A, *motion.paths))}",
            )
        if not self.on:
            motion_parts.hide(root, self.name, self.what)
            return {"FINISHED"}
        if root.mu_motion.on_unit:
            unit_object.hide_candidates(root)
        motion_parts.show(root, self.name, self.what)
        if self.timeline:
            context.scene.frame_end = motion_parts.last_frame(motion, context.scene)
        return {"FINISHED"}


class MU_OT_motion_clear(UnitOperator, bpy.types.Operator):
    """Remove every motion of this unit from the scene; the study's files stay"""

    bl_idname = "mu.motion_clear"
    bl_label = "Clear Motion"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        for name, what in motion_parts.shown(root):
            motion_parts.hide(root, name, what)
        legend_object.hide(root)


class MU_OT_motion_update(MotionOperator, bpy.types.Operator):
    """Rebuild the shown motion from the study's files, after another simulation"""

    bl_idname = "mu.motion_update"
    bl_label = "Update Motion"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        motion_parts.rebuild(root)
        root.mu_motion.trouble = ""


class MU_OT_motion_range(MotionOperator, bpy.types.Operator):
    """Fit the range of the colours to the field over the whole motion"""

    bl_idname = "mu.motion_range"
    bl_label = "Fit Range"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        settings = root.mu_motion
        settings.low, settings.high = motion_parts.extent(root, settings.field)


class MU_OT_motion_legend(MotionOperator, bpy.types.Operator):
    """Add the legend to the scene next to the unit, so that renders show it, or remove it"""

    bl_idname = "mu.motion_legend"
    bl_label = "Legend in Renders"
    bl_options = {"REGISTER", "UNDO"}

    on: BoolProperty(name="Show", description="Show or hide it", default=True)

    def act(self, context, root):
        legend_object.show(root) if self.on else legend_object.hide(root)


class MU_OT_colours(bpy.types.Operator):
    """Let this 3D view show the colours of results: solid shading by attribute"""

    bl_idname = "mu.colours"
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


def draw_colours(self, context) -> None:
    """Draw, in the header of a 3D view that cannot show the colours that are there, the button for it."""
    if not viewports.shows_colours(context) and any(map(places.coloured, unit_object.roots())):
        row = self.layout.row()
        row.alert = True
        row.operator("mu.colours", icon="COLOR")


class MU_OT_picture(UnitOperator, bpy.types.Operator):
    """Open a picture of the study in a new image editor"""

    bl_idname = "mu.picture"
    bl_label = "Enlarge"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Picture", description="Name of its file in the study's folder")

    def act(self, context, root):
        path = studies.results_folder(root) / FOLDER / self.name
        if not self.name or not path.is_file():
            raise InputError("there is no such picture", str(path), "simulate first")
        image = bpy.data.images.load(str(path), check_existing=True)
        image.reload()
        if bpy.app.background:
            return {"FINISHED"}
        bpy.ops.wm.window_new()
        area = context.window_manager.windows[-1].screen.areas[0]
        area.type = "IMAGE_EDITOR"
        area.spaces.active.image = image
        return {"FINISHED"}


CLASSES = (
    MU_OT_motion,
    MU_OT_motion_clear,
    MU_OT_motion_update,
    MU_OT_motion_range,
    MU_OT_motion_legend,
    MU_OT_colours,
    MU_OT_picture,
)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(CLASSES)


def register() -> None:
    """Register operators, and the button in the headers of 3D views."""
    _register_classes()
    bpy.types.VIEW3D_MT_editor_menus.append(draw_colours)


def unregister() -> None:
    """Unregister them."""
    bpy.types.VIEW3D_MT_editor_menus.remove(draw_colours)
    _unregister_classes()
