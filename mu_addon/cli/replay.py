"""`replay`: a recording played as if by the sensor."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_results, require_out
from .stream import add_calibration, shown

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `replay`."""
    command = commands.add_parser(
        "replay",
        help="Replay a recording as if it came from the sensor.",
        epilog="example: run.py replay out/bench-1 --out out/again",
    )
    command.add_argument("recording", metavar="RECORDING", help="Folder written by `stream` or `record`.")
    add_results(command)
    command.add_argument(
        "--speed",
        type=float,
        default=1.0,
        metavar="F",
        help="Replay speed relative to real time; 0: as fast as possible (default: 1).",
    )
    add_calibration(command)
    command.add_argument("--controlled", action="store_true", help="As for `stream`.")


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Play the recording to its end."""
    from ..sensing.sources import Replay
    from ..usecases.sensor.stream import stream

    require_out(options)
    stream(
        Replay(Path(options.recording), options.speed),
        Path(options.out),
        seconds=None,
        about={"source": f"replay of {Path(options.recording).name}"},
        context=context,
        controlled=options.controlled,
        calibration=options.calibration,
        keep_time=True,
        show=shown(options),
    )
