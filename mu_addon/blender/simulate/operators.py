"""Start, cancel and look into a simulation; it runs in a process of its own."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ...design.parameters import write_unit
from ..body import state as bodies
from ..jobs import start_child
from ..jobs.operators import job_operators
from ..obstacles import state as obstacles
from ..shared import viewports
from ..shared.operators import ValidUnitOperator, reports_errors
from ..unit import object as unit_object
from ..unit.properties import to_unit
from . import effects
from . import study_folder as studies
from .job import SIMULATION

# A quick look: linear elements on a mesh of half the fineness, one rule, no second mesh.
QUICK = ["--order", "1", "--refine", "0.5"]
QUICK_PLACE = ["--rule", "volume_fraction", "--no-mesh-check"]


class MU_OT_simulate(ValidUnitOperator, bpy.types.Operator):
    """Simulate the unit in a process of its own; Blender stays free, and finished work is not repeated"""

    bl_idname = "mu.simulate"
    bl_label = "Simulate"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        root = unit_object.active_root(context)
        if SIMULATION.is_running(root):
            cls.poll_message_set("This unit is being simulated")
            return False
        missing = start_child.missing()
        if missing:
            cls.poll_message_set(f"Not in this Blender: {', '.join(missing)}")
            return False
        return True

    @reports_errors
    def execute(self, context):
        root = unit_object.active_root(context)
        core, settings = to_unit(root.mu_unit), root.mu_unit.study
        arguments = [settings.command]
        if settings.command == "place":
            arguments += ["--paths", settings.paths]
        if settings.detail == "quick":
            arguments += QUICK + (QUICK_PLACE if settings.command == "place" else [])
        for name in ("solver", "device"):
            if getattr(settings, name) != "auto":
                arguments += [f"--{name}", getattr(settings, name)]
        if settings.protocol:
            arguments += ["--protocol", bpy.path.abspath(settings.protocol)]
        folder = studies.assign_folder(root)
        arguments += bodies.arguments(root, core, folder / "blender")
        arguments += obstacles.arguments(root, core, folder / "blender")
        arguments += effects.arguments(root, folder / "blender")
        unit = folder / "blender" / "unit.toml"
        write_unit(core, unit)
        command, *options = arguments
        line = [command, "--unit", str(unit), "--out", str(folder), "--json", *options]
        SIMULATION.start(root, line, folder)
        viewports.redraw()
        return {"FINISHED"}


CLASSES = (
    MU_OT_simulate,
    *job_operators(
        SIMULATION,
        "",
        "simulation",
        kept="finished stages are kept, and the next run continues from there",
        first="simulate first",
    ),
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
