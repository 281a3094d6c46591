"""Build a study's job from the options of `design`, `simulate` and `place`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import modelled, unit_of

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..usecases.simulate_and_place.job import Job


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Run the stages named by `options.stages`, and report their results."""
    from ..usecases.simulate_and_place.run import USE_CASE

    USE_CASE.start(job_of(options, context), Path(options.out), context)


def job_of(options: argparse.Namespace, context: RunContext) -> Job:
    """Study job from the options; raises InputError."""
    from ..fem.device import require_device
    from ..meshing.settings import MeshSettings, fidelity_of
    from ..placement.graph import Limits
    from ..usecases.simulate_and_place.job import Job, body_for, obstacles_for, optics_of, protocol_of

    extra: dict[str, Any] = {}
    if "simulate" not in options.stages:
        unit = unit_of(options)
    else:
        require_device(options.device)
        unit, effects = modelled(options, context)
        extra = {
            "effects": effects,
            "mesh": MeshSettings(refine=options.refine, fidelity=fidelity_of(options.solid_struts)),
            "self_contact": options.self_contact,
            "self_friction": options.self_friction,
            "times": options.times,
            "device": options.device,
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
    protocol = protocol_of(getattr(options, "protocol", None))
    if getattr(options, "body", None) is not None:
        extra["body"] = body_for(unit, options.body, options.stages, getattr(options, "paths", "windows"))
    if getattr(options, "obstacles", None):
        extra["obstacles"] = obstacles_for(unit, options.obstacles, extra.get("body"))
    if getattr(options, "path", None) is not None:
        extra["path"] = options.path
    return Job(unit=unit, protocol=protocol, quality=options.quality, stages=options.stages, **extra)
