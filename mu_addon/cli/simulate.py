"""`simulate`: the solid and its motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .options import (
    add_body,
    add_model,
    add_obstacles,
    add_orientation,
    add_report,
    add_resin,
    add_simulation,
    add_solid,
    add_unit,
)
from .study_job import run

if TYPE_CHECKING:
    from .options import Commands

__all__ = ["add", "run"]


def add(commands: Commands[Any]) -> None:
    """Add the parser of `simulate`."""
    command = commands.add_parser(
        "simulate",
        help="Run `design`, then simulate the unit's motion under a pressure protocol.",
        epilog="example: run.py simulate --preset mu-1.0x --refine 0.5 --out out/mu-1.0x",
    )
    add_unit(command)
    add_report(command)
    add_model(command)
    add_orientation(command)
    add_resin(command)
    add_solid(command)
    add_body(command)
    add_obstacles(command)
    add_simulation(command)
    command.set_defaults(stages=("design", "simulate"))
