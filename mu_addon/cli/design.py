"""`design`: the printable solid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .options import add_body, add_report, add_solid, add_unit
from .study_job import run

if TYPE_CHECKING:
    from .options import Commands

__all__ = ["add", "run"]


def add(commands: Commands[Any]) -> None:
    """Add the parser of `design`."""
    command = commands.add_parser(
        "design",
        help="Generate the printable solid of a unit: STL file and lattice nodes.",
        epilog="example: run.py design --preset mu-1.0x --path alpha4 --out out/mu-1.0x",
    )
    add_unit(command)
    add_report(command)
    add_solid(command)
    add_body(command)
    command.add_argument(
        "--path",
        metavar="NAME",
        help="Also write the unit with a waveguide along this path: alpha1, alpha2, ...",
    )
    command.set_defaults(stages=("design",))
