"""Build a study's job from the options of `design`, `simulate` and `place`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import fidelity_of, modelled, solver_of, unit_of

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..usecases.simulate_and_place.job import Job


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Run the stages named by `options.stages`, and report their results."""
    from ..usecases.simulate_and_place.run import USE_CASE

    USE_CASE.start(job_of(options, context), Path(options.out), context)


def job_of(options: argparse.Namespace, context: RunContext) -> Job:
    """Study job from the options; raises InputError."""
    from ..homogenize.effective_file import read_effective
    from ..meshing.settings import MeshSettings
    from ..placement.graph import Limits
    from ..usecases.simulate_and_place.extended_unit import require_same_print
    from ..usecases.simulate_and_place.job import Job, body_for, obstacles_for, optics_of, protocol_of

    extra: dict[str, Any] = {}
    if "simulate" not in options.stages:
        unit = unit_of(options)
    else:
        unit, effects = modelled(options, context)
        fidelity, self_contact = fidelity_of(options)
        mesh = MeshSettings(order=options.order, refine=options.refine, fidelity=fidelity)
        extra = {
            "effects": effects,
            "mesh": mesh,
            "self_contact": self_contact,
            "self_friction": options.self_friction,
            "times": options.times,
            "mesher": options.mesher,
            "solver": solver_of(options),
            "lattice": None if options.lattice is None else read_effective(options.lattice),
        }
    if "place" in options.stages:
        extra |= {
            "stations": options.stations,
            "workers": options.workers,
            "mesh_check": options.mesh_check,
            "paths": options.paths,
            "limits": Limits(options.shortest_cells, options.longest_cells, options.bend_deg),
            "most_checks": options.checks,
            "optics": optics_of(options.light),
        }
    if extra.get("lattice") is not None and context.summary.get("model", {}).get("applied"):
        require_same_print(unit, extra["lattice"], options.model)
    protocol = protocol_of(getattr(options, "protocol", None))
    if getattr(options, "body", None) is not None:
        extra["body"] = body_for(unit, options.body, options.stages, getattr(options, "paths", "windows"))
    if getattr(options, "obstacles", None):
        extra["obstacles"] = obstacles_for(unit, options.obstacles, extra.get("body"))
    if getattr(options, "path", None) is not None:
        extra["path"] = options.path
    return Job(unit=unit, protocol=protocol, quality=options.quality, stages=options.stages, **extra)
