"""Options that `design`, `simulate` and `place` share: solid, body, obstacles, simulation."""

from __future__ import annotations

import argparse
from typing import Any

EXAMPLE = "example: run.py place --preset mu-1.0x --out out/mu-1.0x"


def add_solid(command: argparse.ArgumentParser) -> None:
    """How fine the STL is."""
    command.add_argument(
        "--quality",
        choices=("interactive", "export"),
        default="interactive",
        help="facets of the STL (interactive)",
    )


def add_body(command: argparse.ArgumentParser) -> None:
    """A body of the user's own around the chambers."""
    command.add_argument(
        "--body",
        metavar="FILE",
        help="closed surface (STL, OBJ or PLY; mm, in the unit's frame) that the lattice fills in place of "
        "its box; cut off flat at the unit's ends",
    )


def add_obstacles(command: argparse.ArgumentParser) -> None:
    """Rigid bodies that the unit may touch, each with its friction."""
    command.add_argument(
        "--obstacle",
        action=_Obstacle,
        dest="obstacles",
        default=[],
        metavar="FILE",
        help="closed surface (STL, OBJ or PLY; mm, in the unit's frame) of something rigid and fixed that "
        "the unit may touch; give it again for each",
    )
    command.add_argument(
        "--friction",
        action=_Friction,
        type=float,
        metavar="MU",
        help="coefficient of friction of the obstacle before it (0.5, assumed)",
    )


class _Obstacle(argparse.Action):
    """Adds a file of an obstacle, its friction still unsaid."""

    def __call__(self, parser: Any, namespace: Any, value: Any, option: Any = None) -> None:
        namespace.obstacles = [*namespace.obstacles, (value, None)]


class _Friction(argparse.Action):
    """Says the friction of the obstacle before it."""

    def __call__(self, parser: Any, namespace: Any, value: Any, option: Any = None) -> None:
        if not namespace.obstacles or namespace.obstacles[-1][1] is not None:
            parser.error("--friction: give it after the --obstacle that it belongs to")
        *before, (path, _) = namespace.obstacles
        namespace.obstacles = [*before, (path, value)]


def add_simulation(command: argparse.ArgumentParser) -> None:
    """Protocol, mesh and material of a simulation."""
    command.add_argument(
        "--protocol", metavar="CSV", help="time_s,pressure_kPa (the grasp that comes with it)"
    )
    command.add_argument("--order", type=int, choices=(1, 2), default=2, help="order of the elements (2)")
    command.add_argument(
        "--refine", type=float, default=1.0, metavar="F", help="divides every element size (1)"
    )
    command.add_argument(
        "--lattice",
        metavar="FILE",
        help="effective.toml of `homogenize`: the lattice's law, from its struts and resin, kept in the "
        "results (without it the unit's material.lattice_modulus_kPa and lattice_poisson, neo-Hookean)",
    )
    command.add_argument("--times", type=int, default=13, metavar="K", help="samples of the protocol (13)")
    command.add_argument(
        "--mesher", choices=("auto", "gmsh", "pytetwild"), default="auto", help="who makes the mesh (auto)"
    )
