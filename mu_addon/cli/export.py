"""`export`: files of a unit for printers and CAD."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_model, add_setting, add_unit, modelled_unit

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `export`."""
    from ..usecases.export.settings import FORMATS, QUALITY, RESIN

    command = commands.add_parser(
        "export",
        help="Export a unit as STL, 3MF, STEP and node list. Each file is read back and verified; a "
        "manifest lists them.",
        epilog="example: run.py export --preset mu-1.0x --path alpha4 --out out/print",
    )
    add_unit(command)
    add_model(command)
    command.add_argument(
        "--path",
        metavar="NAME|CSV",
        help="Path of the waveguide: alpha1, alpha2, ..., or a paths.csv of `place --paths graph`, whose "
        "best path is taken.",
    )
    command.add_argument(
        "--path-row", metavar="NAME", help="Take this path of the paths.csv instead of the best one."
    )
    command.add_argument(
        "--formats",
        nargs="+",
        choices=FORMATS,
        default=FORMATS,
        metavar="F",
        help=f"File formats: {', '.join(FORMATS)} (default: all).",
    )
    add_setting(command, QUALITY)
    command.add_argument(
        "--compensate",
        nargs="?",
        const="unit",
        metavar="CSV",
        help="Compensate the print offset: subtract it from the nominal geometry. Without a value: the "
        "[print] offset of the unit or of --model. With a CSV file: the offset measured on the "
        "calibration coupon of `specimens`.",
    )
    command.add_argument(
        "--vent-along",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="Vent the cups that trap resin when the unit is built along this direction, away from the "
        "platform: a hole through the wall for each cup, in STL and 3MF, and plug-1.stl, ... to close it.",
    )
    command.add_argument(
        "--deformed",
        nargs=2,
        metavar=("KPA", "RUN"),
        help="Also write the unit as it is at a pressure, by the motion in the folder of a `simulate` or "
        "`place` run of it (with --path: of a `place` run).",
    )
    add_setting(command, RESIN, "NAME|FILE")


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Export the unit."""
    from ..design.printing.sheets import compensation_offsets
    from ..usecases.export.job import Job, deformed_in, path_of, resin_of
    from ..usecases.export.run import USE_CASE

    unit = modelled_unit(options, context)
    path, name = path_of(unit, options.path, options.path_row)
    offsets, source = compensation_offsets(unit, options.compensate)
    job = Job(
        unit=unit,
        resin=resin_of(options.resin),
        path=path,
        path_name=name,
        formats=tuple(dict.fromkeys(options.formats)),
        quality=options.quality,
        take_off=offsets,
        offset_source=source,
        vent_along=None if options.vent_along is None else tuple(options.vent_along),
        deformed=None
        if options.deformed is None
        else deformed_in(Path(options.deformed[1]), unit, _pressure_kPa(options.deformed[0])),
    )
    USE_CASE.start(job, Path(options.out), context)


def _pressure_kPa(words: str) -> float:
    from ..errors import InputError

    try:
        return float(words)
    except ValueError:
        raise InputError(f"{words!r} is not a number", "--deformed", "give kPa, then a folder") from None
