"""`presets`, `design`, `simulate` and `place`: units, solids, motions, and the ranking of sensor paths."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import (
    add_body,
    add_device,
    add_model,
    add_obstacles,
    add_orientation,
    add_report,
    add_resin,
    add_self_contact,
    add_setting,
    add_solid,
    add_unit,
    modelled,
    unit_of,
)

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..usecases.simulate_and_place.job import Job
    from .options import Commands, Group


def add_design(commands: Commands[Any]) -> None:
    """Add the parser of `design`."""
    command = commands.add_parser(
        "design",
        help="Generate the printable solid of a unit: STL file and lattice nodes.",
        epilog="example: run.py design --preset mu-1.0x --path alpha4 --out out/mu-1.0x",
    )
    add_unit(command)
    add_report(command)
    add_solid(command)
    add_body(command)
    command.add_argument(
        "--path",
        metavar="NAME",
        help="Also write the unit with a waveguide along this path: alpha1, alpha2, ...",
    )
    command.set_defaults(stages=("design",))


def add_simulate(commands: Commands[Any]) -> None:
    """Add the parser of `simulate`."""
    command = commands.add_parser(
        "simulate",
        help="Run `design`, then simulate the unit's motion under a pressure protocol: the stage Model A, "
        "without a sensor.",
        epilog="example: run.py simulate --preset mu-1.0x --refine 0.5 --out out/mu-1.0x",
    )
    _add_motion(command)
    command.set_defaults(stages=("design", "simulate"))


def _add_motion(command: argparse.ArgumentParser) -> Group:
    """Add the options that `simulate` and `place` share; return the group of those of mesh and solver."""
    from ..meshing.settings import REFINE
    from ..usecases.simulate_and_place.settings import PROTOCOL, SELF_FRICTION, TIMES

    add_unit(command)
    add_report(command)
    add_setting(command, PROTOCOL, "CSV")
    add_setting(command, REFINE, "F")
    around = command.add_argument_group("unit and surroundings")
    add_resin(around)
    add_model(around)
    add_orientation(around)
    add_body(around)
    add_obstacles(around)
    solver = command.add_argument_group("mesh and solver")
    add_setting(solver, TIMES, "K")
    add_self_contact(solver)
    add_setting(solver, SELF_FRICTION, "MU")
    add_solid(solver)
    add_device(solver)
    return solver


def add_place(commands: Commands[Any]) -> None:
    """Add the parser of `place`."""
    import attrs

    from ..placement.settings import BEND, LONGEST, SHORTEST
    from ..sensing.guide import Optics
    from ..usecases.simulate_and_place.settings import (
        ALL_PATHS,
        CHECKS,
        MESH_CHECK,
        PATHS,
        QUICK,
        STATIONS,
        WORKERS,
    )

    constants = ", ".join(f"{name} {value:g}" for name, value in attrs.asdict(Optics()).items())
    command = commands.add_parser(
        "place",
        help="Run `design` and `simulate`, then rank the sensor paths by how much each disturbs the "
        "motion of Model A, the unit without a sensor (the main job).",
        epilog="example: run.py place --preset mu-1.0x --refine 0.5 --out out/mu-1.0x",
    )
    solver = _add_motion(command)
    add_setting(command, QUICK)
    add_setting(command, WORKERS, "N")
    add_setting(solver, STATIONS, "J")
    add_setting(solver, MESH_CHECK)
    add_setting(solver, ALL_PATHS)
    search = command.add_argument_group("paths, and limits of --paths graph")
    add_setting(search, PATHS)
    search.add_argument(
        "--light",
        nargs="+",
        default=(),
        metavar="NAME=VALUE",
        help=f"Optical constants of the resin, assumed by default: {constants}.",
    )
    add_setting(search, SHORTEST, "C")
    add_setting(search, LONGEST, "C")
    add_setting(search, BEND, "A")
    add_setting(search, CHECKS, "N")
    command.set_defaults(stages=("design", "simulate", "place"))


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Run the stages named by `options.stages`, and report their results."""
    from ..usecases.simulate_and_place.run import USE_CASE

    USE_CASE.start(job_of(options, context), Path(options.out), context)


def job_of(options: argparse.Namespace, context: RunContext) -> Job:
    """Study job from the options; raises InputError."""
    from ..fem.device import require_device
    from ..meshing.settings import MeshSettings
    from ..placement.graph import Limits
    from ..usecases.simulate_and_place.job import Job, body_for, obstacles_for, optics_of, protocol_of, quick

    extra: dict[str, Any] = {}
    if "simulate" not in options.stages:
        unit = unit_of(options)
    else:
        require_device(options.device)
        unit, effects = modelled(options, context)
        extra = {
            "effects": effects,
            "mesh": MeshSettings(refine=options.refine),
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
            "all_paths": options.all_paths,
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
    job = Job(unit=unit, protocol=protocol, quality=options.quality, stages=options.stages, **extra)
    return quick(job) if getattr(options, "quick", False) else job


def add_presets(commands: Commands[Any]) -> None:
    """Add the parser of `presets`."""
    commands.add_parser(
        "presets",
        help="List the shipped presets: units, and grippers for `grip`.",
        epilog="example: run.py presets",
    )


def run_presets(options: argparse.Namespace, context: RunContext) -> None:
    """Put every preset's name and size into the summary."""
    from ..design.gripper import gripper_names, load_gripper
    from ..design.parameters import load_preset, preset_names

    for name in preset_names():
        d = load_preset(name).dimensions
        context.summary[name] = f"cell {d.cell:g} mm, {d.count} chambers, {d.height:g} mm long"
    for name in gripper_names():
        gripper = load_gripper(name)
        context.summary[name] = f"two fingers {gripper.unit.name}, {gripper.fingers.gap_mm:g} mm apart"
    context.console_summary = lambda summary: [
        f"{name:12s} {summary[name]}" for name in (*preset_names(), *gripper_names())
    ]
