"""`design-experiments`: the effects that planned experiments can detect."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_measured_folder, add_report, add_self_contact, add_unit, unit_if_named

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `design-experiments`."""
    command = commands.add_parser(
        "design-experiments",
        help="Design experiments before measuring: compute which effects planned experiments can detect, "
        "and the smallest detectable size of each.",
        epilog="example: run.py design-experiments my-protocols --noise angle=0.5 --out out/plan",
    )
    add_measured_folder(
        command,
        "Folder of planned experiments, in the format of `diagnose`; the measured columns may hold any "
        "numbers.",
    )
    add_unit(command, required=False)
    add_self_contact(command)
    add_report(command)
    command.add_argument(
        "--noise",
        nargs="+",
        default=(),
        metavar="QUANTITY=VALUE",
        help="Standard deviation of a reading, in the unit of its column (default: angle=0.3 marker=0.1 "
        "stress=0.1 pressure=0.1 tip_deflection=0.1 voltage=0.002).",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Plan the folder's experiments."""
    from ..measured import read_folder
    from ..usecases.diagnose.design_experiments import USE_CASE, Job, noise_of

    unit = unit_if_named(options)
    noise = noise_of(options.noise)
    job = Job(read_folder(Path(options.folder)), unit, noise, self_contact=options.self_contact)
    USE_CASE.start(job, Path(options.out), context)
