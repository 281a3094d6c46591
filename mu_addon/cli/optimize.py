"""`optimize`: targets and freedoms in, units that meet them out."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_model, add_report, add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `optimize`."""
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
    command.add_argument(
        "--workers",
        type=int,
        default=1,
        metavar="N",
        help="Number of units simulated in parallel on this machine (default: 1).",
    )
    command.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Address of a Dask scheduler whose workers simulate the units, such as tcp://host:8786.",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Search, check what is found, and report."""
    from ..errors import InputError
    from ..usecases.optimize.job import job_from
    from ..usecases.optimize.run import USE_CASE

    require_out(options)
    if not 1 <= options.workers <= 256:
        raise InputError(f"{options.workers} is out of bounds", "--workers", "give 1 to 256")
    model = None if options.model is None else Path(options.model)
    job = job_from(Path(options.file), model, options.workers, options.scheduler)
    USE_CASE.start(job, Path(options.out), context)
