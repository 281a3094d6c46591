"""`resume`: the run that a folder's inputs describe, from where it stopped."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `resume`."""
    command = commands.add_parser(
        "resume",
        help="Resume a stopped run, or run again what the inputs in a folder describe.",
        epilog="example: run.py resume out/mu-1.0x",
    )
    command.add_argument("out", metavar="FOLDER", help="Folder of any run: its --out, or its inputs alone.")
    command.add_argument(
        "--json", action="store_true", help="Write one JSON message per line to standard output."
    )
    command.add_argument("--workers", type=int, metavar="N", help="Number of worker processes (default: 2).")
    command.add_argument(
        "--no-report",
        dest="report",
        action="store_false",
        help="Compute the numbers only: no pictures, no report.html.",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Run what the folder's inputs say; what is finished is taken from the cache."""
    from ..usecases.resume import resume

    require_out(options)
    context.wants_report = options.report
    resume(Path(options.out), context, options.workers)
