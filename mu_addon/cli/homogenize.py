"""`homogenize`: from struts and resin to the lattice's law."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_model, add_report, add_setting, add_unit, modelled_unit

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `homogenize`."""
    from ..usecases.homogenize.settings import CELLS, FRICTION, REFINE, RESIN, STRAIN

    command = commands.add_parser(
        "homogenize",
        help="Homogenize the lattice: compute effective moduli from struts and resin, run virtual "
        "compression tests, and fit the lattice law for `place`.",
        epilog="example: run.py homogenize --preset mu-1.0x --out out/lattice",
    )
    add_unit(command)
    add_report(command)
    add_model(command)
    add_setting(command, RESIN, "NAME|FILE")
    add_setting(command, CELLS, "N")
    add_setting(command, FRICTION)
    add_setting(command, STRAIN, "E")
    command.add_argument(
        "--no-specimen",
        dest="specimen",
        action="store_false",
        help="Do not simulate the specimen, only the periodic lattice.",
    )
    add_setting(command, REFINE, "F")


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Homogenise the unit's lattice."""
    from ..usecases.homogenize.job import Job, frictions_of, resin_of
    from ..usecases.homogenize.run import USE_CASE

    unit = modelled_unit(options, context)
    job = Job(
        unit=unit,
        resin=resin_of(options.resin, unit),
        cells=options.cells,
        frictions=frictions_of(options.friction) if options.specimen else (),
        strain=options.strain,
        refine=options.refine,
    )
    USE_CASE.start(job, Path(options.out), context)
