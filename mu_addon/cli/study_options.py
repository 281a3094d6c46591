"""Options that `design`, `simulate` and `place` share: solid, body, obstacles, simulation."""

from __future__ import annotations

import argparse
from typing import Any

from .options import add_solver

EXAMPLE = "example: run.py place --preset mu-1.0x --out out/mu-1.0x"


def add_solid(command: argparse.ArgumentParser) -> None:
    """How fine the STL is."""
    command.add_argument(
        "--quality",
        choices=("interactive", "export"),
        default="interactive",
        help="Facet resolution of the STL (default: interactive).",
    )


def add_body(command: argparse.ArgumentParser) -> None:
    """A body of the user's own around the chambers."""
    command.add_argument(
        "--body",
        metavar="FILE",
        help="Closed surface that the lattice fills in place of its box: STL, OBJ or PLY, in mm, in the "
        "unit's frame. It is cut flat at both ends of the unit.",
    )


def add_obstacles(command: argparse.ArgumentParser) -> None:
    """Rigid bodies that the unit may touch, each with its friction."""
    command.add_argument(
        "--obstacle",
        action=_Obstacle,
        dest="obstacles",
        default=[],
        metavar="FILE",
        help="Closed surface of a rigid, fixed obstacle: STL, OBJ or PLY, in mm, in the unit's frame. "
        "Repeat the option for each obstacle.",
    )
    command.add_argument(
        "--friction",
        action=_Friction,
        type=float,
        metavar="MU",
        help="Coulomb friction coefficient of the preceding --obstacle (default: 0.5, assumed).",
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
        "--protocol",
        metavar="CSV",
        help="Pressure protocol, CSV with the columns time_s,pressure_kPa (default: the shipped grasp "
        "protocol).",
    )
    command.add_argument(
        "--order", type=int, choices=(1, 2), default=2, help="Order of the finite elements (default: 2)."
    )
    command.add_argument(
        "--refine",
        type=float,
        default=1.0,
        metavar="F",
        help="Mesh refinement: every element size is divided by F (default: 1).",
    )
    command.add_argument(
        "--lattice",
        metavar="FILE",
        help="Lattice law computed from struts and resin, the effective.toml of `homogenize`; a copy is "
        "stored with the results (default: neo-Hookean with the unit's material.lattice_modulus_kPa "
        "and lattice_poisson).",
    )
    command.add_argument(
        "--times",
        type=int,
        default=13,
        metavar="K",
        help="Number of time samples of the protocol (default: 13).",
    )
    command.add_argument(
        "--mesher",
        choices=("auto", "gmsh", "pytetwild"),
        default="auto",
        help="Mesh generator (default: auto).",
    )
    add_solver(command)
