"""Start, cancel and look into a simulation; it runs in a process of its own."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import EnumProperty

from ..body import state as bodies
from ..obstacles import state as obstacles
from ..shared.acting import RUN_FILES, CancelsJob, DismissesJob, OnSoundUnit, OpensRun, telling
from ..unit import live_update as live
from ..unit import object as unit_object
from ..unit.properties import to_unit
from . import effects
from . import state as simulation
from . import study_folder as studies

# A quick look: linear elements on a mesh of half the fineness, one rule, no second mesh.
QUICK = ["--order", "1", "--refine", "0.5"]
QUICK_PLACE = ["--rule", "volume_fraction", "--no-mesh-check"]


class MU_OT_simulate(OnSoundUnit, bpy.types.Operator):
    """Simulate the unit in a process of its own; Blender stays free, and finished work is not repeated"""

    bl_idname = "mu.simulate"
    bl_label = "Simulate"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        root = unit_object.active_root(context)
        if root.mu_unit.uuid in simulation.running():
            cls.poll_message_set("This unit is being simulated")
            return False
        missing = simulation.missing()
        if missing:
            cls.poll_message_set(f"Not in this Blender: {', '.join(missing)}")
            return False
        return True

    @telling
    def execute(self, context):
        root = unit_object.active_root(context)
        core, settings = to_unit(root.mu_unit), root.mu_unit.study
        arguments = [settings.command]
        if settings.command == "place":
            arguments += ["--paths", settings.paths]
        if settings.detail == "quick":
            arguments += QUICK + (QUICK_PLACE if settings.command == "place" else [])
        if settings.protocol:
            arguments += ["--protocol", bpy.path.abspath(settings.protocol)]
        folder = studies.settle(root)
        arguments += bodies.arguments(root, core, folder / "blender")
        arguments += obstacles.arguments(root, core, folder / "blender")
        arguments += effects.arguments(root, folder / "blender")
        simulation.start(root.mu_unit.uuid, core, folder, arguments)
        live.redraw()
        return {"FINISHED"}


class MU_OT_cancel(CancelsJob, bpy.types.Operator):
    """Stop the simulation; what it has finished is kept, and the next one goes on from there"""

    bl_idname = "mu.cancel"
    bl_label = "Cancel"
    bl_options = {"REGISTER"}


class MU_OT_dismiss(DismissesJob, bpy.types.Operator):
    """Take the message of an ended simulation off the panel"""

    bl_idname = "mu.dismiss"
    bl_label = "Dismiss"
    bl_options = {"REGISTER"}


class MU_OT_open(OpensRun, bpy.types.Operator):
    """Open a file of the unit's study"""

    bl_idname = "mu.open"
    bl_label = "Open"
    bl_options = {"REGISTER"}
    first = "simulate first"
    folder_of = staticmethod(studies.folder_of)

    what: EnumProperty(name="What", description="File or folder of the study to open", items=RUN_FILES)


CLASSES = (MU_OT_simulate, MU_OT_cancel, MU_OT_dismiss, MU_OT_open)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
