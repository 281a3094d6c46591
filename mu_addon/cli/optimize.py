"""`optimize`: units that meet targets within given freedoms."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_model, add_report, add_results, add_scheduler, add_setting, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `optimize`."""
    from ..optimization.settings import WORKERS

    command = commands.add_parser(
        "optimize",
        help="Find units that meet targets: bending angles, stiffness, stretch, mass, printability and more.",
        epilog="example: run.py optimize assets/examples/stronger-finger/design.toml --out out/finger",
    )
    command.add_argument(
        "file", metavar="FILE", help="Targets and freedoms, a design.toml: see docs/guide/search.md."
    )
    add_results(command)
    add_model(command)
    add_report(command)
    add_setting(command, WORKERS, "N")
    add_scheduler(command)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Search, check the proposals, and report."""
    from ..usecases.optimize.job import job_from
    from ..usecases.optimize.run import USE_CASE

    require_out(options)
    model = None if options.model is None else Path(options.model)
    job = job_from(Path(options.file), model, options.workers, options.scheduler)
    USE_CASE.start(job, Path(options.out), context)
