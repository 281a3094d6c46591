"""`calibrate`: from recorded bending to a map from voltage to angle."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_report, add_results, add_setting, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `calibrate`."""
    from ..sensing.settings import ANGLES, CHANNEL, DARK

    command = commands.add_parser(
        "calibrate",
        help="Calibrate a sensor: fit the map from voltage to bending angle to recorded bending sweeps.",
        epilog="example: run.py calibrate out/bench-1 --channel light_V --dark dark_V --out out/calibration",
    )
    command.add_argument(
        "data",
        nargs="+",
        metavar="FOLDER",
        help="Recordings, or folders of measured data of the kind waveguide_bending.",
    )
    add_results(command)
    add_report(command)
    add_setting(command, CHANNEL, "NAME")
    add_setting(command, DARK, "NAME|V")
    add_setting(command, ANGLES, "CSV")


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Calibrate."""
    from ..usecases.sensor.calibrate import USE_CASE, Job

    require_out(options)
    job = Job(
        tuple(Path(folder) for folder in options.data),
        channel=options.channel,
        dark=options.dark,
        angles=None if options.angles is None else Path(options.angles),
    )
    USE_CASE.start(job, Path(options.out), context)
