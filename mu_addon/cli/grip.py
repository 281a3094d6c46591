"""`grip`: two units on a plate, and their grasp of cubes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import (
    add_report,
    add_results,
    add_self_contact,
    add_setting,
    add_solid,
    help_of,
    presets,
    require_out,
)

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `grip`."""
    from ..design.settings import FRICTION
    from ..usecases.grip.settings import (
        BEYOND,
        COARSE,
        COARSE_REFINE,
        CUBES,
        DENSITY,
        REFINE,
        SIDES,
    )

    command = commands.add_parser(
        "grip",
        help="Design a gripper of two units and simulate its grasp of cubes with friction: printable part, "
        "forces, light signal.",
        epilog="example: run.py grip --preset gripper --out out/gripper",
    )
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--preset", metavar="NAME", help=f"Gripper preset: {presets('gripper')}.")
    which.add_argument("--gripper", metavar="FILE", help="Gripper parameters, a TOML file.")
    add_results(command)
    add_report(command)
    command.add_argument("--cube", nargs="+", type=float, default=SIDES, metavar="MM", help=help_of(CUBES))
    add_setting(command, DENSITY, "G_PER_ML")
    add_setting(command, FRICTION, "MU")
    add_setting(command, BEYOND, "MM")
    command.add_argument(
        "--protocol",
        metavar="CSV",
        help="Pressure protocol with the phases i to v (default: protocols/gripper.csv).",
    )
    default = f"{REFINE.default:g}; {COARSE_REFINE:g} with --coarse"
    command.add_argument("--refine", type=float, metavar="F", help=help_of(REFINE, default))
    add_self_contact(command)
    add_setting(command, COARSE)
    command.add_argument(
        "--solid-only", action="store_true", help="Write only the printable part; simulate nothing."
    )
    add_solid(command)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Design the gripper and simulate its grasp."""
    from ..design.gripper import load_gripper, read_gripper
    from ..usecases.grip.job import Job, detailed
    from ..usecases.grip.phases import read_phases, shipped_phases
    from ..usecases.grip.run import USE_CASE
    from ..usecases.grip.settings import Cube

    require_out(options)
    gripper = load_gripper(options.preset) if options.preset is not None else read_gripper(options.gripper)
    detail = detailed(options.coarse, options.refine)
    density = options.density_g_per_ml
    job = Job(
        gripper=gripper,
        cubes=() if options.solid_only else tuple(Cube(side, density) for side in options.cube),
        grip=detail.grip(friction=options.friction, beyond_mm=options.beyond_mm),
        phases=shipped_phases() if options.protocol is None else read_phases(Path(options.protocol)),
        mesh=detail.mesh,
        self_contact=options.self_contact,
        quality=options.quality,
    )
    USE_CASE.start(job, Path(options.out), context)
