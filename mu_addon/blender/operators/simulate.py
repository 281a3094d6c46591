"""Start, cancel and look into a simulation; it runs in a process of its own."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from pathlib import Path

import bpy
from bpy.props import EnumProperty

from ...study.client import ERRORS
from .. import bodies, live, simulation, studies, unit_object
from ..properties import to_unit
from .acting import CancelsJob, DismissesJob, OnSoundUnit, OnUnit, telling

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
        if settings.detail == "quick":
            arguments += QUICK + (QUICK_PLACE if settings.command == "place" else [])
        if settings.protocol:
            arguments += ["--protocol", bpy.path.abspath(settings.protocol)]
        folder = studies.settle(root)
        arguments += bodies.arguments(root, core, folder / "blender")
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


class MU_OT_open(OnUnit, bpy.types.Operator):
    """Open a file of the unit's study"""

    bl_idname = "mu.open"
    bl_label = "Open"
    bl_options = {"REGISTER"}

    what: EnumProperty(
        name="What",
        description="File or folder of the study to open",
        items=[
            ("report", "Report", "Report of the study, in the browser"),
            ("log", "Log", "Every message of the run, as a text in Blender"),
            ("errors", "Errors", "What the process wrote to its error output, as a text in Blender"),
            ("folder", "Folder", "Folder of the study"),
        ],
    )

    @telling
    def execute(self, context):
        folder = studies.folder_of(unit_object.active_root(context))
        names = {"report": studies.REPORT, "log": studies.LOG, "errors": f"blender/{ERRORS}", "folder": ""}
        path = folder / names[self.what]
        if not path.exists():
            self.report({"ERROR"}, f"There is no {path} yet: simulate first")
            return {"CANCELLED"}
        open_file(context, path, self.what)
        return {"FINISHED"}


def open_file(context, path: Path, what: str) -> None:
    """Open a report in the browser, a folder where folders are shown, anything else as a text in Blender."""
    if what == "report":
        bpy.ops.wm.url_open(url=path.as_uri())
    elif what == "folder":
        bpy.ops.wm.path_open(filepath=str(path))
    else:
        _show_text(context, path)


def _show_text(context, path: Path) -> None:
    """Put a file into a text of Blender's, and show it where a text editor is open."""
    name = f"MU {path.name}"
    text = bpy.data.texts.get(name) or bpy.data.texts.new(name)
    text.from_string(path.read_text(encoding="utf-8", errors="replace"))
    for area in context.screen.areas if context.screen else ():
        if area.type == "TEXT_EDITOR":
            area.spaces.active.text = text


CLASSES = (MU_OT_simulate, MU_OT_cancel, MU_OT_dismiss, MU_OT_open)
