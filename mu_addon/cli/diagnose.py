"""`diagnose`: measured data against the model."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_measured_folder, add_report, add_self_contact, add_unit, unit_if_named

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `diagnose`."""
    command = commands.add_parser(
        "diagnose",
        help="Diagnose model error from measured data: name the physical effects missing from the model, "
        "and compute by how much the error drops with them.",
        epilog="example: run.py diagnose assets/examples/paper-moduli --out out/diagnosis",
    )
    add_measured_folder(command)
    add_unit(command, required=False)
    add_self_contact(command)
    command.add_argument(
        "--model",
        metavar="FILE",
        help="Extended model of an earlier diagnosis, its model.toml. Its effects stay in the model; new "
        "causes are added.",
    )
    command.add_argument(
        "--unknown",
        metavar="FILE",
        help="TOML file with [[freedom]] tables, as of `optimize`: parameters of the unit's design that "
        "nobody measured, with bounds. They are fitted beside every cause, and shapes.csv says which fit.",
    )
    add_report(command)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Diagnose the folder."""
    from ..evidence.extended import load_model
    from ..measured import read_folder
    from ..usecases.diagnose.job import Job
    from ..usecases.diagnose.run import USE_CASE

    unit = unit_if_named(options)
    known = load_model(Path(options.model)) if options.model else None
    measured = read_folder(Path(options.folder))
    unknown = None
    if options.unknown:
        from ..design.parameters import load_preset
        from ..design.settings import PRESET
        from ..usecases.diagnose.unknown import unknown_of

        unknown = unknown_of(Path(options.unknown), unit or load_preset(PRESET))
    job = Job(measured, unit, known=known, self_contact=options.self_contact, unknown=unknown)
    USE_CASE.start(job, Path(options.out), context)
