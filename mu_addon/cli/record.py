"""`record`: the real sensor, recorded and not shown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .stream import add_source, run

if TYPE_CHECKING:
    from .options import Commands

__all__ = ["add", "run"]


def add(commands: Commands[Any]) -> None:
    """Add the parser of `record`."""
    command = commands.add_parser(
        "record",
        help="Record the sensor over the serial port without displaying it.",
        epilog="example: run.py record --port /dev/ttyACM0 --seconds 60 --out out/bench-1",
    )
    add_source(command)
    command.set_defaults(show=False)
