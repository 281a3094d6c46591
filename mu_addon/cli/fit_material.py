"""`fit-material`: laws from coupon tests."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_measured_folder, add_report, add_results, add_setting, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `fit-material`."""
    from ..materials.settings import WEIGHTS
    from ..measured.kinds import MODES

    command = commands.add_parser(
        "fit-material",
        help="Fit hyperelastic laws to coupon tests and write the best one as a material for simulations.",
        epilog="example: run.py fit-material my-coupons --out out/resin",
    )
    add_measured_folder(command)
    add_results(command)
    add_report(command)
    command.add_argument(
        "--laws",
        nargs="+",
        default=(),
        metavar="LAW",
        help="Laws to fit: neo-hooke, mooney-rivlin, yeoh, ogden-1, ogden-2, ogden-3 (default: all).",
    )
    command.add_argument(
        "--hold-out",
        nargs="+",
        default=(),
        metavar="MODE",
        help=f"Test modes held out of the fit for validation: {', '.join(MODES)} (default: none).",
    )
    add_setting(command, WEIGHTS)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Fit laws to the folder's coupons."""
    from ..measured import read_folder
    from ..usecases.fit_material.job import Job
    from ..usecases.fit_material.run import USE_CASE

    require_out(options)
    job = Job(
        read_folder(Path(options.folder)), tuple(options.laws), tuple(options.hold_out), options.weights
    )
    USE_CASE.start(job, Path(options.out), context)
