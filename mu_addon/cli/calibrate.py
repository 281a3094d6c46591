"""`calibrate`: from recorded bending to a map from voltage to angle."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_report, add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `calibrate`."""
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
    command.add_argument(
        "--channel", metavar="NAME", help="Column of the light signal (default: the only column)."
    )
    command.add_argument(
        "--dark", metavar="NAME|V", help="Dark level: the name of a column, or a voltage in V (default: 0)."
    )
    command.add_argument(
        "--angles",
        metavar="CSV",
        help="Reference angles, CSV with the columns time_s,angle_deg, for a recording without marks "
        'such as "angle 30".',
    )


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
