"""`reproduce`: the paper's table and bending ranges beside this simulation's."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_report, add_results, add_setting, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..usecases.reproduce.settings import Settings
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `reproduce`."""
    command = commands.add_parser(
        "reproduce",
        help="Reproduce the paper: compare its Table I and bending angles at three scales with this "
        "simulation.",
        epilog="example: run.py reproduce --out out/reproduce",
    )
    add_options(command)


def add_options(command: argparse.ArgumentParser) -> None:
    """Folder, meshes and values of a reproduction."""
    from ..usecases.simulate_and_place.settings import WORKERS

    add_results(command)
    add_report(command)
    command.add_argument(
        "--coarse",
        action="store_true",
        help="Quick, less accurate run of one to two minutes: coarse meshes, no gripper.",
    )
    command.add_argument(
        "--refine",
        type=float,
        default=None,
        metavar="F",
        help="Mesh refinement: element sizes are divided by F (default: 1; 0.4 with --coarse).",
    )
    command.add_argument(
        "--set",
        default="default",
        metavar="NAME|FILE",
        help="Set of values for the parameters that the paper does not print (default: default).",
    )
    command.add_argument(
        "--no-gripper",
        dest="gripper",
        action="store_false",
        help="Leave out the gripper's column, as --coarse does.",
    )
    add_setting(command, WORKERS, "N")


def settings_of(options: argparse.Namespace) -> Settings:
    """Settings that the options ask for; raises InputError."""
    from ..meshing.settings import MeshSettings
    from ..usecases.reproduce.settings import Settings, read_set

    require_out(options)
    coarse = options.coarse
    return Settings(
        **read_set(options.set),
        values_name=Path(options.set).stem,
        mesh=MeshSettings(refine=options.refine if options.refine is not None else 0.4 if coarse else 1.0),
        gripper=options.gripper and not coarse,
        workers=options.workers,
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Do the paper's table again."""
    from ..usecases.reproduce.run import USE_CASE

    USE_CASE.start(settings_of(options), Path(options.out), context)
