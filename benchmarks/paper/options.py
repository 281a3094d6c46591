"""Options of both commands on the paper's table."""

from __future__ import annotations

import argparse
from pathlib import Path

from mu_addon.cli.options import add_report, add_results, add_setting, require_out
from mu_addon.meshing.settings import MeshSettings
from mu_addon.usecases.simulate_and_place.settings import WORKERS

from .table.settings import Settings, read_set


def parser(name: str, page: str) -> argparse.ArgumentParser:
    """A parser with folder, meshes and values of the table; page: the command's docstring."""
    command = argparse.ArgumentParser(name, description=page.splitlines()[0])
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
    return command


def settings_of(options: argparse.Namespace) -> Settings:
    """Settings of the table that the options ask for; raises InputError."""
    require_out(options)
    coarse = options.coarse
    return Settings(
        **read_set(options.set),
        values_name=Path(options.set).stem,
        mesh=MeshSettings(refine=options.refine if options.refine is not None else 0.4 if coarse else 1.0),
        gripper=options.gripper and not coarse,
        workers=options.workers,
    )
