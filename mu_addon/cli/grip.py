"""`grip`: two units on a plate, and their grasp of cubes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_fidelity, add_report, add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `grip`."""
    command = commands.add_parser(
        "grip",
        help="Design a gripper of two units and simulate its grasp of cubes with friction: printable part, "
        "forces, light signal, sensor paths.",
        epilog="example: run.py grip --preset gripper --out out/gripper",
    )
    which = command.add_mutually_exclusive_group(required=True)
    which.add_argument("--preset", metavar="NAME", help="Gripper preset: gripper.")
    which.add_argument("--gripper", metavar="FILE", help="Gripper parameters, a TOML file.")
    add_results(command)
    add_report(command)
    command.add_argument(
        "--cube",
        nargs="+",
        type=float,
        default=(12.5, 25.0),
        metavar="MM",
        help="Side lengths of the cubes to grasp, in mm; the sensor paths are ranked with the last one "
        "(default: 12.5 25).",
    )
    command.add_argument(
        "--density",
        type=float,
        default=1.24,
        metavar="G_PER_ML",
        help="Density of the cubes in g/ml (default: 1.24, solid PLA).",
    )
    command.add_argument(
        "--friction",
        type=float,
        default=0.5,
        metavar="MU",
        help="Coulomb friction coefficient (default: 0.5).",
    )
    command.add_argument(
        "--beyond",
        type=float,
        default=3.0,
        metavar="MM",
        help="Distance of the cubes' centre beyond the tips at rest, in mm (default: 3).",
    )
    command.add_argument(
        "--protocol",
        metavar="CSV",
        help="Pressure protocol with the phases i to v (default: protocols/gripper.csv).",
    )
    command.add_argument(
        "--refine",
        type=float,
        metavar="F",
        help="Mesh refinement: element sizes are divided by F (default: 0.5).",
    )
    add_fidelity(command)
    command.add_argument(
        "--coarse",
        action="store_true",
        help="Quick, less accurate run: coarser mesh, longer time steps, one inclusion rule.",
    )
    command.add_argument("--no-paths", action="store_true", help="Do not rank the sensor paths.")
    command.add_argument(
        "--solid-only", action="store_true", help="Write only the printable part; simulate nothing."
    )
    command.add_argument(
        "--quality",
        choices=("interactive", "export"),
        default="interactive",
        help="Facet resolution of the printable surface (default: interactive).",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Design the gripper and let it grasp."""
    from ..design.gripper import load_gripper, read_gripper
    from ..meshing.settings import MeshSettings
    from ..placement.inclusion import PRINTED, RULES
    from ..usecases.grip.grasp import OF_FIDELITY, Cube, Grip
    from ..usecases.grip.job import COARSE, REFINE, Job
    from ..usecases.grip.phases import read_phases, shipped_phases
    from ..usecases.grip.run import USE_CASE

    require_out(options)
    gripper = load_gripper(options.preset) if options.preset is not None else read_gripper(options.gripper)
    refine = options.refine or (COARSE if options.coarse else REFINE)
    mesh = MeshSettings(refine=refine, fidelity=options.fidelity)
    rules = (PRINTED,) if mesh.resolved else ("volume_fraction",) if options.coarse else RULES
    step_s = 1.0 if options.coarse else 0.5
    job = Job(
        gripper=gripper,
        cubes=() if options.solid_only else tuple(Cube(side, options.density) for side in options.cube),
        grip=Grip(
            friction=options.friction,
            beyond_mm=options.beyond,
            step_s=step_s,
            **OF_FIDELITY[options.fidelity],
        ),
        phases=shipped_phases() if options.protocol is None else read_phases(Path(options.protocol)),
        mesh=mesh,
        self_contact=options.self_contact,
        rules=() if options.solid_only or options.no_paths else rules,
        quality=options.quality,
    )
    USE_CASE.start(job, Path(options.out), context)
