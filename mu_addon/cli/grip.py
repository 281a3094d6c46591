"""`grip`: two units on a plate, and their grasp of cubes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands

COARSE = 0.4


def add(commands: Commands[Any]) -> None:
    """Add the parser of `grip`."""
    command = commands.add_parser(
        "grip",
        help="a gripper of two units: printable part, grasp of cubes with friction, light, sensor paths",
        epilog="example: run.py grip --preset gripper --out out/gripper",
    )
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--preset", metavar="NAME", help="a shipped gripper: gripper")
    which.add_argument("--gripper", metavar="FILE", help="a gripper's parameters, TOML")
    add_results(command)
    command.add_argument(
        "--cube",
        nargs="+",
        type=float,
        default=(12.5, 25.0),
        metavar="MM",
        help="sides of the cubes to grasp; the last is the sensor table's (12.5 25)",
    )
    command.add_argument(
        "--density", type=float, default=1.24, metavar="G_PER_ML", help="of the cubes (1.24: solid PLA)"
    )
    command.add_argument(
        "--friction", type=float, default=0.5, metavar="MU", help="Coulomb's coefficient (0.5)"
    )
    command.add_argument(
        "--beyond",
        type=float,
        default=3.0,
        metavar="MM",
        help="how far the cubes' middle lies beyond the tips at rest (3)",
    )
    command.add_argument(
        "--protocol", metavar="CSV", help="pressure and phases i to v (protocols/gripper.csv)"
    )
    command.add_argument(
        "--refine", type=float, metavar="F", help="divides the sizes of the mesh's elements (0.5)"
    )
    command.add_argument(
        "--coarse", action="store_true", help="a quick look: a coarser mesh, longer steps, one inclusion rule"
    )
    command.add_argument("--no-paths", action="store_true", help="leave out the table of sensor paths")
    command.add_argument("--solid-only", action="store_true", help="only the printable part")
    command.add_argument(
        "--quality",
        choices=("interactive", "export"),
        default="interactive",
        help="how fine the printable surface is (interactive)",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Design the gripper and let it grasp."""
    from ..design.gripper import load_gripper, read_gripper
    from ..meshing.settings import MeshSettings
    from ..placement.inclusion import RULES
    from ..usecases.grip.grasp import Cube, Grip
    from ..usecases.grip.job import REFINE, Job
    from ..usecases.grip.phases import read_phases, shipped_phases
    from ..usecases.grip.run import USE_CASE

    require_out(options)
    gripper = load_gripper(options.preset) if options.preset is not None else read_gripper(options.gripper)
    refine = options.refine or (COARSE if options.coarse else REFINE)
    rules = ("volume_fraction",) if options.coarse else RULES
    step_s = 1.0 if options.coarse else 0.5
    job = Job(
        gripper=gripper,
        cubes=() if options.solid_only else tuple(Cube(side, options.density) for side in options.cube),
        grip=Grip(friction=options.friction, beyond_mm=options.beyond, step_s=step_s),
        phases=shipped_phases() if options.protocol is None else read_phases(Path(options.protocol)),
        mesh=MeshSettings(refine=refine),
        rules=() if options.solid_only or options.no_paths else rules,
        quality=options.quality,
    )
    USE_CASE.start(job, Path(options.out), context)
