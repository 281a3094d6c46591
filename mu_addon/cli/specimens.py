"""`specimens`: parts to print and measure."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_setting, add_unit, unit_if_named

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `specimens`."""
    from ..design.settings import PRINTER
    from ..usecases.export.settings import RESIN

    command = commands.add_parser(
        "specimens",
        help="Write test specimens as STL: lattice cubes, coupons, a gauge for the printer and a part "
        "for each of its limits, with data sheets for the measurements.",
        epilog="example: run.py specimens --out out/specimens",
    )
    add_unit(command, required=False)
    add_setting(command, RESIN, "NAME|FILE")
    # The parts named limit-... show its limits.
    add_setting(command, PRINTER, "NAME|FILE")


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Write the specimens of a unit, mu-1.0x unless one is named."""
    from ..design.parameters import load_preset
    from ..design.printing.printer import load_printer
    from ..usecases.export.job import resin_of
    from ..usecases.export.specimens import USE_CASE, Job

    unit = unit_if_named(options) or load_preset("mu-1.0x")
    job = Job(unit, resin_of(options.resin), load_printer(options.printer))
    USE_CASE.start(job, Path(options.out), context)
