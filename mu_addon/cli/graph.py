"""`graph`: a node tree, evaluated node by node."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_report, add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `graph`."""
    command = commands.add_parser(
        "graph",
        help="Evaluate a node tree: units by their steps, simulations, rankings, prints, data and their "
        "comparison. Only nodes without a result in DIR are computed.",
        epilog="example: run.py graph assets/graphs/three-walls.toml --out out/walls",
    )
    command.add_argument(
        "file", metavar="FILE", help="Node tree, a TOML file as Blender's node editor writes it."
    )
    add_results(command)
    add_report(command)
    command.add_argument(
        "--node",
        action="append",
        default=[],
        metavar="NAME",
        help="Evaluate this node and those that it needs; repeat the option for more (default: all nodes).",
    )
    command.add_argument(
        "--node-reports",
        action="store_true",
        help="Also write the full report of every run within the tree.",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Evaluate the tree."""
    from ..usecases.graph.job import job_of_file
    from ..usecases.graph.run import USE_CASE

    require_out(options)
    job = job_of_file(Path(options.file), tuple(options.node), options.node_reports)
    # Its nodes say which of them were computed and which were taken from earlier.
    context.words = None
    USE_CASE.start(job, Path(options.out), context)
