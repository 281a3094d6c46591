"""`place`: the solid, its motion, and the ranking of sensor paths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .options import add_model, add_orientation, add_unit
from .study_job import run
from .study_options import EXAMPLE, add_body, add_obstacles, add_simulation, add_solid

if TYPE_CHECKING:
    from .options import Commands

__all__ = ["add", "run"]


def add(commands: Commands[Any]) -> None:
    """Add the parser of `place`."""
    command = commands.add_parser(
        "place", help="... and the ranking of sensor paths (the main job)", epilog=EXAMPLE
    )
    add_unit(command)
    add_model(command)
    add_orientation(command)
    add_solid(command)
    add_body(command)
    add_obstacles(command)
    add_simulation(command)
    command.add_argument(
        "--stations", type=int, default=51, metavar="J", help="stations along the backbone (51)"
    )
    command.add_argument(
        "--rule",
        choices=("both", "intersect", "volume_fraction"),
        default="both",
        help="how an inclusion stiffens the elements it touches (both)",
    )
    command.add_argument(
        "--workers", type=int, default=2, metavar="N", help="processes for the candidates (2)"
    )
    command.add_argument(
        "--no-mesh-check",
        dest="mesh_check",
        action="store_false",
        help="leave out the second mesh that tells how far the mesh moves the ranking",
    )
    command.add_argument(
        "--paths",
        choices=("windows", "graph"),
        default="windows",
        help="graph: search the whole lattice for the best path, bent ones too (windows)",
    )
    command.add_argument(
        "--light",
        nargs="+",
        default=(),
        metavar="NAME=VALUE",
        help="the resin's optics: index, attenuation_per_mm, roughness (1.5, 0.01, 0.02, assumed)",
    )
    search = command.add_argument_group("limits of --paths graph")
    search.add_argument(
        "--shortest-cells", type=float, default=2.0, metavar="C", help="shortest path, in cells (2)"
    )
    search.add_argument(
        "--longest-cells", type=float, default=float("inf"), metavar="C", help="longest path, in cells (any)"
    )
    search.add_argument("--bend-deg", type=float, default=75.0, metavar="A", help="sharpest bend (75)")
    search.add_argument(
        "--checks", type=int, default=100, metavar="N", help="paths solved exactly at most (100)"
    )
    command.set_defaults(stages=("design", "simulate", "place"))
