"""The unit's simulation as a job: the core's inputs of a study from the properties in Blender."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import attrs
import bpy

from ...errors import InputError, MuError
from ..jobs.start_child import JobKind
from ..obstacles import state as obstacles
from ..shared.blender_property import exact
from ..unit import envelope
from ..unit.properties import to_unit
from . import effects, timings
from . import study_folder as studies

if TYPE_CHECKING:
    from pathlib import Path

    from ...run.progress_estimate import Plan
    from ...studies.unit_ranking import UnitStudy


def plan_of(root: Any, quick: bool = False) -> Plan:
    """Expected stages of a unit's simulation or quick ranking, with the seconds of each; raises MuError."""
    return timings.expected(*_asked(root, quick))[0]


def announced(root: Any, quick: bool = False) -> tuple[float, bool] | None:
    """Expected seconds of a unit's simulation or quick ranking, and True if measured on this machine.

    None where it cannot start.
    """
    try:
        return timings.announced(*_asked(root, quick))
    except MuError:
        return None


def _asked(root: Any, quick: bool) -> tuple[UnitStudy, list[Path]]:
    """The study, and folders of the unit's complete runs."""
    return _without_bodies(root, quick), [run.folder for run in studies.runs_of(root) if run.complete]


SIMULATION = JobKind(
    "simulate",
    lambda root: root.mu_unit.uuid,
    studies.results_folder,
    "simulation",
    heavy=True,
    plan_of=plan_of,
)
timings.READERS[SIMULATION.name] = timings.of_run


def job_of(root: Any, in_short: bool = False) -> UnitStudy:
    """Study from a unit's properties; in_short: its quick ranking. Raises InputError."""
    study = _without_bodies(root, in_short)
    body = envelope.envelope_in(root, study.unit)
    return attrs.evolve(study, body=body, obstacles=obstacles.rigid_bodies(root, study.unit))


def _without_bodies(root: Any, quick: bool) -> UnitStudy:
    """The study without envelope and obstacles, whose checks take long; raises InputError."""
    # Imported late: they need the solver's packages, which a Blender may lack.
    try:
        from ...meshing.settings import MeshSettings
        from ...studies.unit_inputs import protocol_of
        from ...studies.unit_ranking import UnitStudy
    except (ImportError, OSError, RuntimeError) as error:
        raise InputError(
            f"the solver cannot load: {error}", "", "install the extension built for this Blender and system"
        ) from error

    settings = root.mu_unit.study
    place = quick or settings.command == "place"
    extra: dict[str, Any] = {}
    if place:
        extra |= {"paths": settings.paths, "all_paths": settings.all_paths, "quick": quick}
    if settings.self_contact:
        extra["self_friction"] = round(settings.self_friction, 6)
    return UnitStudy(
        unit=to_unit(root.mu_unit),
        protocol=protocol_of(bpy.path.abspath(settings.protocol) if settings.protocol else None),
        effects=effects.named_effects(root),
        stages=("design", "simulate", "place") if place else ("design", "simulate"),
        mesh=MeshSettings(refine=exact(settings.refine)),
        self_contact=settings.self_contact,
        device=settings.device,
        **extra,
    ).complete()
