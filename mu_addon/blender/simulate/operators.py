"""Start a simulation in a child process, cancel it, open its files."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import attrs
import bpy

from ...usecases.simulate_and_place import unit_runs
from ...usecases.simulate_and_place.settings import QUICK
from ..jobs import start_child
from ..jobs.operators import FILES, job_operators
from ..shared import viewports
from ..shared.blender_property import blender_property
from ..unit.base_classes import ValidUnitOperator
from . import study_folder as studies
from .job import SIMULATION, job_of, plan_of


def _file_of(root, what):
    """A file of the shown run; of one that is running or has just ended, its process's output."""
    child = SIMULATION.child(root)
    if what in ("log", "errors") and child is not None:
        return child.folder.parent / FILES[what]
    return studies.results_folder(root) / FILES[what]


class MU_OT_simulate(ValidUnitOperator, bpy.types.Operator):
    """Simulate the unit in a child process; Blender stays usable, and finished stages are not repeated"""

    bl_idname = "mu.simulate"
    bl_label = "Simulate"
    bl_options = {"REGISTER"}

    # Not remembered: the next press of the main button is no quick one.
    quick: blender_property(QUICK, name="Quick Ranking", options={"SKIP_SAVE"})

    @classmethod
    def trouble(cls, root):
        running = SIMULATION.is_running(root)
        return super().trouble(root) or ("This unit is being simulated" if running else start_child.lacking())

    def act(self, context, root):
        study = root.mu_unit.study
        job = job_of(root, self.quick)
        # Imported late, with the solver's packages.
        from ...studies.use_case import write_study

        folder, job = unit_runs.place_of(studies.assign_folder(root), job)
        options = ["--device", study.device]
        kind = attrs.evolve(SIMULATION, plan_of=lambda root: plan_of(root, self.quick))
        kind.start(root, folder, lambda folder: write_study(job, folder), options)
        viewports.redraw()


CLASSES = (
    MU_OT_simulate,
    *job_operators(
        SIMULATION,
        "",
        "simulation",
        kept="finished stages are kept, and the next run continues from there",
        first="simulate first",
        path_of=_file_of,
    ),
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
