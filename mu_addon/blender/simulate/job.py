"""The unit's simulation as a job: the core's inputs of a study from the properties in Blender."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy

from ...errors import InputError
from ...simulate_and_place.settings import QUICK_REFINE
from ..jobs.start_child import JobKind
from ..obstacles import state as obstacles
from ..shared.blender_property import exact
from ..unit import envelope
from ..unit.properties import to_unit
from . import effects, timings
from . import study_folder as studies

if TYPE_CHECKING:
    from ...studies.unit_ranking import UnitStudy


def plan_of(root: Any, quick: bool = False) -> list[tuple[str, float]]:
    """Expected stages of a unit's simulation or quick ranking, with the seconds of each."""
    return _expected(root, quick)[0]


def announced(root: Any, quick: bool = False) -> tuple[float, bool]:
    """Expected seconds of a unit's simulation or quick ranking, and True if measured on this machine."""
    plan, known = _expected(root, quick)
    return sum(seconds for _, seconds in plan), known


def _expected(root: Any, quick: bool) -> tuple[list[tuple[str, float]], bool]:
    """The plan, and True if all its long stages were measured: for this unit, else another one."""
    from ...simulate_and_place.expected import (
        PATHS_CHECKED,
        SHIPPED_KPA,
        SOLVED,
        Size,
        seconds_of,
        stage_names,
    )

    settings = root.mu_unit.study
    known = 0 if settings.all_paths else 1 if quick else PATHS_CHECKED
    refine, pressures = exact(settings.refine), SHIPPED_KPA
    if quick:
        refine, pressures = min(refine, QUICK_REFINE), tuple(p for p in pressures if p > 0)
    size = Size(root.mu_unit.chambers.count, refine, settings.self_contact, pressures, known)
    detail = timings.of_size(size)
    names = stage_names(quick or settings.command == "place", not quick, settings.paths == "graph")
    runs = (run for run in studies.runs_of(root) if timings.of_run(run) == detail)
    alike = (run.summary.get("seconds") for run in runs)
    own = next((s for s in alike if isinstance(s, dict) and {*names} - {"report"} <= {*s}), {})
    taken = {**timings.measured(detail), **own}

    def seconds(name: str) -> float:
        value = taken.get(name)
        if isinstance(value, int | float) and value >= 0.0:
            return float(value)
        return seconds_of(name, size.factor(name))

    return [(name, seconds(name)) for name in names], all(name in taken for name in names if name in SOLVED)


SIMULATION = JobKind(
    "simulate",
    lambda root: root.mu_unit.uuid,
    studies.results_folder,
    "simulation",
    heavy=True,
    plan_of=plan_of,
)


def job_of(root: Any, in_short: bool = False) -> UnitStudy:
    """Study from a unit's properties; in_short: its quick ranking. Raises InputError."""
    # Imported late: they need the solver's packages, which a Blender may lack.
    try:
        from ...meshing.settings import MeshSettings
        from ...studies.unit_inputs import protocol_of
        from ...studies.unit_ranking import UnitStudy
    except (ImportError, OSError, RuntimeError) as error:
        raise InputError(
            f"the solver cannot load: {error}", "", "install the extension built for this Blender and system"
        ) from error

    settings, unit = root.mu_unit.study, to_unit(root.mu_unit)
    place = in_short or settings.command == "place"
    stages = ("design", "simulate", "place") if place else ("design", "simulate")
    extra: dict[str, Any] = {}
    if place:
        extra |= {"paths": settings.paths, "all_paths": settings.all_paths, "quick": in_short}
    if settings.self_contact:
        extra["self_friction"] = round(settings.self_friction, 6)
    return UnitStudy(
        unit=unit,
        protocol=protocol_of(bpy.path.abspath(settings.protocol) if settings.protocol else None),
        body=envelope.envelope_in(root, unit),
        obstacles=obstacles.rigid_bodies(root, unit),
        effects=effects.named_effects(root),
        stages=stages,
        mesh=MeshSettings(refine=exact(settings.refine)),
        self_contact=settings.self_contact,
        device=settings.device,
        **extra,
    ).complete()
