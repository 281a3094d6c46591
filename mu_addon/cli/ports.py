"""`ports`: the serial ports of this computer."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `ports`."""
    commands.add_parser(
        "ports", help="List the serial ports, for `stream` and `record`.", epilog="example: run.py ports"
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Put a line for each port into the summary."""
    from ..usecases.sensor.stream import port_lines

    context.summary["ports"] = port_lines()
    context.console_summary = lambda summary: summary["ports"] or ["no serial port was found"]
