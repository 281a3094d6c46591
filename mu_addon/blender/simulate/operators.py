"""Start a simulation in a child process, cancel it, open its files."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ..jobs import start_child
from ..jobs.operators import job_operators
from ..shared import viewports
from ..shared.operators import ValidUnitOperator, reports_errors
from ..unit import object as unit_object
from . import study_folder as studies
from .job import SIMULATION, write_inputs


class MU_OT_simulate(ValidUnitOperator, bpy.types.Operator):
    """Simulate the unit in a child process; Blender stays usable, and finished stages are not repeated"""

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
        if trouble := start_child.lacking():
            cls.poll_message_set(trouble)
        return not trouble

    @reports_errors
    def execute(self, context):
        root = unit_object.active_root(context)
        study = root.mu_unit.study
        SIMULATION.start(
            root,
            studies.assign_folder(root),
            lambda folder: write_inputs(root, folder),
            ["--solver", study.solver, "--device", study.device],
        )
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
