"""`export`: files for printers and CAD, with a manifest."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_model, add_unit, modelled_unit

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands

FORMATS = ("stl", "3mf", "3mf-beams", "step", "txt")


def add(commands: Commands[Any]) -> None:
    """Add the parser of `export`."""
    command = commands.add_parser(
        "export",
        help="STL, 3MF, STEP and nodes of a unit, each read back, with a manifest",
        epilog="example: run.py export --preset mu-1.0x --path alpha4 --out out/print",
    )
    add_unit(command)
    add_model(command)
    command.add_argument(
        "--path",
        metavar="NAME|CSV",
        help="a waveguide along this path, alpha1 .., or the best of a paths.csv of `place --paths graph`",
    )
    command.add_argument("--path-row", metavar="NAME", help="another path of that paths.csv")
    command.add_argument(
        "--formats",
        nargs="+",
        choices=FORMATS,
        default=FORMATS,
        metavar="F",
        help=f"{', '.join(FORMATS)} (all)",
    )
    command.add_argument(
        "--quality",
        choices=("interactive", "export"),
        default="export",
        help="facets of the solid (export)",
    )
    command.add_argument(
        "--compensate",
        nargs="?",
        const="unit",
        metavar="CSV",
        help="take the printer's offsets off the drawing: the unit's [print] (or --model's), or what "
        "calipers found on the calibration coupon of `specimens`",
    )
    command.add_argument(
        "--resin", metavar="NAME|FILE", help="a material of the library, or its TOML file (elastic-50a-v1)"
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Export the unit."""
    from ..usecases.export.job import Job, path_of, resin_of
    from ..usecases.export.print_offsets import taken_off
    from ..usecases.export.run import USE_CASE

    unit = modelled_unit(options, context)
    path, name = path_of(unit, options.path, options.path_row)
    offsets, source = taken_off(unit, options.compensate)
    job = Job(
        unit=unit,
        resin=resin_of(options.resin),
        path=path,
        path_name=name,
        formats=tuple(dict.fromkeys(options.formats)),
        quality=options.quality,
        take_off=offsets,
        offset_source=source,
    )
    USE_CASE.start(job, Path(options.out), context)
