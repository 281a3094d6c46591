"""`ports`, `stream`, `record` and `replay`: the real sensor, and what was recorded of it."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_results, add_setting, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.progress import Sink
    from .options import Commands


def add_ports(commands: Commands[Any]) -> None:
    """Add the parser of `ports`."""
    commands.add_parser(
        "ports", help="List the serial ports, for `stream` and `record`.", epilog="example: run.py ports"
    )


def run_ports(options: argparse.Namespace, context: RunContext) -> None:
    """Put a line for each port into the summary."""
    from ..sensing.stream import port_lines

    context.summary["ports"] = port_lines()
    context.console_summary = lambda summary: summary["ports"] or ["no serial port was found"]


def add_stream(commands: Commands[Any]) -> None:
    """Add the parser of `stream`."""
    command = commands.add_parser(
        "stream",
        help="Read the sensor over the serial port: record every sample and display it.",
        epilog="example: run.py stream --port usb:2341:0043 --out out/bench-1",
    )
    add_source(command)
    command.set_defaults(show=True)


def add_record(commands: Commands[Any]) -> None:
    """Add the parser of `record`."""
    command = commands.add_parser(
        "record",
        help="Record the sensor over the serial port without displaying it.",
        epilog="example: run.py record --port /dev/ttyACM0 --seconds 60 --out out/bench-1",
    )
    add_source(command)
    command.set_defaults(show=False)


def add_source(command: argparse.ArgumentParser) -> None:
    """Add the options for source, duration and folder of a recording."""
    from ..sensing.settings import BAUD, PORT

    add_results(command)
    add_setting(command, PORT, "NAME")
    add_setting(command, BAUD, "B")
    command.add_argument(
        "--simulate",
        action="store_true",
        help="Read a simulated sensor that bends periodically instead of a port.",
    )
    add_calibration(command)
    command.add_argument(
        "--seconds", type=float, metavar="S", help="Duration in seconds (default: until Ctrl-C)."
    )
    command.add_argument(
        "--controlled",
        action="store_true",
        help="Accept the commands pause, resume, mark WORDS and stop on standard input, and end when it "
        "closes.",
    )


def add_calibration(command: argparse.ArgumentParser) -> None:
    """--calibration, a map from voltage to angle."""
    command.add_argument(
        "--calibration",
        metavar="FILE",
        help="Calibration, the calibration.toml of `calibrate`: angles are displayed with voltages.",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Stream until Ctrl-C."""
    from ..errors import InputError
    from ..sensing.settings import BAUD
    from ..sensing.stream import serial_source, simulated_source, stream

    require_out(options)
    if options.seconds is not None and not 0 < options.seconds < math.inf:
        raise InputError(
            f"{options.seconds:g} s is not a valid duration", "--seconds", "give a number above zero"
        )
    BAUD.checked(options.baud)
    source = simulated_source() if options.simulate else serial_source(options.port, options.baud)
    about = {"source": "simulated" if options.simulate else options.port, "baud": options.baud}
    stream(
        source,
        Path(options.out),
        seconds=options.seconds,
        about=about,
        context=context,
        controlled=options.controlled,
        calibration=options.calibration,
        show=shown(options) if options.show else None,
    )


def shown(options: argparse.Namespace) -> Sink | None:
    """Display of the stream: a line for people, or JSON for programs; none with --quiet."""
    if options.quiet:
        return None
    from ..run.progress import json_lines
    from ..sensing.stream import Display
    from .closed_pipe import until_closed

    return until_closed(json_lines(sys.stdout) if options.json else Display(sys.stdout))


def add_replay(commands: Commands[Any]) -> None:
    """Add the parser of `replay`."""
    from ..sensing.settings import SPEED

    command = commands.add_parser(
        "replay",
        help="Replay a recording as if it came from the sensor.",
        epilog="example: run.py replay out/bench-1 --out out/again",
    )
    command.add_argument("recording", metavar="RECORDING", help="Folder written by `stream` or `record`.")
    add_results(command)
    add_setting(command, SPEED, "F")
    add_calibration(command)
    command.add_argument("--controlled", action="store_true", help="As for `stream`.")


def run_replay(options: argparse.Namespace, context: RunContext) -> None:
    """Play the recording to its end."""
    from ..sensing.sources import Replay
    from ..sensing.stream import stream

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
