"""`export`: files for printers and CAD, with a manifest."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_model, add_unit, modelled_unit

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.progress import Progress
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


def run(options: argparse.Namespace, progress: Progress, context: RunContext) -> None:
    """Export the unit."""
    from ..materials.library import load_material, read_material
    from ..usecases.export.print_offsets import taken_off
    from ..usecases.export.run import Job, export, path_of

    unit = modelled_unit(options, progress, context)
    path, name = path_of(unit, options.path, options.path_row)
    offsets, source = taken_off(unit, options.compensate)
    resin = options.resin or "elastic-50a-v1"
    job = Job(
        unit=unit,
        resin=read_material(Path(resin)) if resin.endswith(".toml") else load_material(resin),
        path=path,
        path_name=name,
        formats=tuple(dict.fromkeys(options.formats)),
        quality=options.quality,
        take_off=offsets,
        offset_source=source,
    )
    export(job, Path(options.out), progress, context)


def console_summary(summary: dict[str, Any]) -> list[str]:
    """What was written, in a few lines."""
    from ..usecases.export.run import console_summary

    return console_summary(summary)
