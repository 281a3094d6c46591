"""`sweep`: a parameter study."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_report, add_results, add_scheduler, add_setting, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `sweep`."""
    from ..usecases.parameter_study.settings import ADD, WORKERS

    command = commands.add_parser(
        "sweep",
        help="Run a parameter study: many studies over ranges of inputs, with one table, main effects and "
        "the Pareto front.",
        epilog="example: run.py sweep assets/examples/sweep/sweep.toml --out out/sweep",
    )
    command.add_argument(
        "file",
        metavar="FILE",
        help="Plan of the parameter study, a sweep.toml: which inputs are varied, and how.",
    )
    add_results(command)
    add_report(command)
    add_setting(command, WORKERS, "N")
    add_scheduler(command)
    add_setting(command, ADD, "N")
    command.add_argument("--retry", action="store_true", help="Run the failed points again.")


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Run the points that are not there yet, and report on all."""
    from ..usecases.parameter_study.plan import read_plan
    from ..usecases.parameter_study.run import USE_CASE, Job

    require_out(options)
    job = Job(
        read_plan(Path(options.file)),
        scheduler=options.scheduler,
        workers=options.workers,
        add=options.add,
        retry=options.retry,
    )
    USE_CASE.start(job, Path(options.out), context)
