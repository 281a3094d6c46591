"""`resume`: the study that a folder's study.toml describes, from where it stopped."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_solver
from .study_options import console_summary

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.progress import Progress
    from .options import Commands

__all__ = ["add", "console_summary", "run"]


def add(commands: Commands[Any]) -> None:
    """Add the parser of `resume`."""
    command = commands.add_parser(
        "resume",
        help="Resume a stopped study, or run again what the study.toml of a folder describes.",
        epilog="example: run.py resume out/mu-1.0x",
    )
    command.add_argument("out", metavar="FOLDER", help="Folder written by `design`, `simulate` or `place`.")
    command.add_argument(
        "--json", action="store_true", help="Write one JSON message per line to standard output."
    )
    command.add_argument(
        "--workers", type=int, default=2, metavar="N", help="Number of worker processes (default: 2)."
    )
    command.add_argument(
        "--no-report",
        dest="report",
        action="store_false",
        help="Compute the numbers only: no pictures, no report.html.",
    )
    add_solver(command)


def run(options: argparse.Namespace, progress: Progress, context: RunContext) -> None:
    """Run what study.toml says; what is finished is taken from the cache."""
    from ..usecases.simulate_and_place.job import read_job
    from ..usecases.simulate_and_place.report_data import write_report
    from ..usecases.simulate_and_place.run import run_stages
    from ..usecases.simulate_and_place.study import Study
    from .options import require_out, solver_of

    require_out(options)
    folder = Path(options.out)
    study = Study.open(read_job(folder, options.workers, solver_of(options)), folder, progress, context)
    if options.report:
        context.on_stop = lambda reason: write_report(study, reason["what"])
    run_stages(study)
    if options.report:
        write_report(study)
