"""`place`: the solid, its motion, and the ranking of sensor paths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .options import (
    add_body,
    add_model,
    add_obstacles,
    add_orientation,
    add_report,
    add_resin,
    add_setting,
    add_simulation,
    add_solid,
    add_unit,
)
from .study_job import run

if TYPE_CHECKING:
    from .options import Commands

__all__ = ["add", "run"]


def add(commands: Commands[Any]) -> None:
    """Add the parser of `place`."""
    import attrs

    from ..placement.settings import BEND, LONGEST, SHORTEST
    from ..sensing.guide import Optics
    from ..usecases.simulate_and_place.settings import CHECKS, MESH_CHECK, PATHS, STATIONS, WORKERS

    constants = ", ".join(f"{name} {value:g}" for name, value in attrs.asdict(Optics()).items())
    command = commands.add_parser(
        "place",
        help="Run `design` and `simulate`, then rank the sensor paths by how much each disturbs the "
        "motion (the main job).",
        epilog="example: run.py place --preset mu-1.0x --refine 0.5 --out out/mu-1.0x",
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
    add_setting(command, STATIONS, "J")
    add_setting(command, WORKERS, "N")
    add_setting(command, MESH_CHECK)
    add_setting(command, PATHS)
    command.add_argument(
        "--light",
        nargs="+",
        default=(),
        metavar="NAME=VALUE",
        help=f"Optical constants of the resin, assumed by default: {constants}.",
    )
    search = command.add_argument_group("limits of --paths graph")
    add_setting(search, SHORTEST, "C")
    add_setting(search, LONGEST, "C")
    add_setting(search, BEND, "A")
    add_setting(search, CHECKS, "N")
    command.set_defaults(stages=("design", "simulate", "place"))
