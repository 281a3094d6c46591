"""Start a simulation in a child process, cancel it, open its files."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import attrs

from ...simulate_and_place.settings import QUICK
from ...studies import unit_runs
from ..jobs import start_child
from ..jobs.operators import FILES, job_operators
from ..shared.blender_property import blender_property
from ..shared.operators import operator
from ..unit.base_classes import ValidUnitOperator
from . import study_folder as studies
from .job import SIMULATION, job_of, plan_of


def _file_of(root, what):
    """A file of the shown run; of one that is running or has just ended, its process's output."""
    child = SIMULATION.child(root)
    if what in ("log", "errors") and child is not None:
        return child.folder.parent / FILES[what]
    return studies.results_folder(root) / FILES[what]


def _simulate_trouble(root):
    running = SIMULATION.is_running(root)
    return "This unit is being simulated" if running else start_child.lacking()


@operator(
    ValidUnitOperator,
    "Simulate",
    undo=False,
    trouble=_simulate_trouble,
    quick=blender_property(QUICK, name="Quick Ranking", options={"SKIP_SAVE"}),
)
def simulate(root, quick):
    """Simulate the unit in a child process; Blender stays usable, and finished stages are not repeated"""
    study = root.mu_unit.study
    job = job_of(root, quick)
    # Imported late, with the solver's packages.
    from ...studies.starting import write_study

    folder, job = unit_runs.place_of(studies.assign_folder(root), job)
    options = ["--device", study.device]
    kind = attrs.evolve(SIMULATION, plan_of=lambda root: plan_of(root, quick))
    kind.start(root, folder, lambda folder: write_study(job, folder), options)


job_operators(SIMULATION, "simulate first", path_of=_file_of)
