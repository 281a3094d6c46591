"""`homogenize`: from struts and resin to the lattice's law."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_model, add_report, add_unit, modelled_unit

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `homogenize`."""
    command = commands.add_parser(
        "homogenize",
        help="Homogenize the lattice: compute effective moduli from struts and resin, run virtual "
        "compression tests, and fit the lattice law for `place`.",
        epilog="example: run.py homogenize --preset mu-1.0x --out out/lattice",
    )
    add_unit(command)
    add_report(command)
    add_model(command)
    command.add_argument(
        "--resin",
        metavar="NAME|FILE",
        help=(
            "Resin: a material of the library or a TOML file (default: the modulus of the unit's membrane)."
        ),
    )
    command.add_argument(
        "--cells",
        type=int,
        default=3,
        metavar="N",
        help="Number of cells along each side of the specimen (default: 3).",
    )
    command.add_argument(
        "--friction",
        choices=("both", "slide", "stick"),
        default="both",
        help="Contact of the specimen with the plates: frictionless (slide), bonded (stick) or both "
        "(default: both).",
    )
    command.add_argument(
        "--strain",
        type=float,
        default=0.4,
        metavar="E",
        help="Largest nominal compressive strain (default: 0.4).",
    )
    command.add_argument(
        "--no-specimen",
        dest="specimen",
        action="store_false",
        help="Do not simulate the specimen, only the periodic lattice.",
    )
    command.add_argument(
        "--refine",
        type=float,
        default=1.0,
        metavar="F",
        help="Mesh refinement: the cell's element size is divided by F (default: 1).",
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Homogenise the unit's lattice."""
    from ..usecases.homogenize.job import FRICTIONS, Job, resin_of
    from ..usecases.homogenize.run import USE_CASE

    unit = modelled_unit(options, context)
    frictions = FRICTIONS if options.friction == "both" else (options.friction,)
    job = Job(
        unit=unit,
        resin=resin_of(options.resin, unit),
        cells=options.cells,
        frictions=frictions if options.specimen else (),
        strain=options.strain,
        refine=options.refine,
    )
    USE_CASE.start(job, Path(options.out), context)
