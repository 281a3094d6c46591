"""`reproduce`: the paper's table, its bending ranges, and what stands between them and ours."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.progress import Progress
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `reproduce`."""
    command = commands.add_parser(
        "reproduce",
        help="Reproduce the paper: compare its Table I and bending angles at three scales with this "
        "simulation.",
        epilog="example: run.py reproduce --out out/reproduce",
    )
    add_results(command)
    command.add_argument(
        "--coarse",
        action="store_true",
        help="Quick, less accurate run of one to two minutes: coarse meshes, no random meshes.",
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
        "--meshes",
        type=int,
        default=None,
        metavar="N",
        help="Number of random meshes of each kind; 0: the shipped ones (default: 12; 0 with --coarse).",
    )
    command.add_argument(
        "--open",
        dest="points",
        type=int,
        default=0,
        metavar="N",
        help=(
            "Number of sampled parameter sets to solve, which takes hours; 0: the shipped ones (default: 0)."
        ),
    )
    command.add_argument(
        "--no-gripper",
        dest="gripper",
        action="store_false",
        help="Leave out the gripper's column, as --coarse does.",
    )
    command.add_argument(
        "--workers", type=int, default=2, metavar="N", help="Number of worker processes (default: 2)."
    )


def run(options: argparse.Namespace, progress: Progress, context: RunContext) -> None:
    """Do the paper's table again."""
    from ..meshing.settings import MeshSettings
    from ..usecases.reproduce.run import reproduce
    from ..usecases.reproduce.settings import Settings, read_set

    require_out(options)
    coarse = options.coarse
    settings = Settings(
        **read_set(options.set),
        values_name=Path(options.set).stem,
        mesh=MeshSettings(refine=options.refine if options.refine is not None else 0.4 if coarse else 1.0),
        meshes=options.meshes if options.meshes is not None else 0 if coarse else 12,
        points=options.points,
        gripper=options.gripper and not coarse,
        workers=options.workers,
    )
    reproduce(settings, Path(options.out), progress, context)


def console_summary(summary: dict[str, Any]) -> list[str]:
    """What was found, in a few lines."""
    from ..usecases.reproduce.run import console_summary

    return console_summary(summary)
