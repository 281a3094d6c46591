"""`check`: the printability check of a part."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_report, add_setting, add_solid, add_unit, unit_if_named

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `check`."""
    from ..design.settings import PRINTER, UP

    command = commands.add_parser(
        "check",
        help="Check the printability of a unit or an STL file and find the best build direction. Exit "
        "status 6 means not printable.",
        epilog="example: run.py check --preset mu-1.0x --path alpha4 --out out/check",
    )
    add_unit(command, required=False)
    add_report(command)
    command.add_argument(
        "--stl",
        metavar="FILE",
        help="STL file to check; if a unit is given too, the file is compared with the unit's nominal "
        "geometry.",
    )
    command.add_argument(
        "--repair",
        action="store_true",
        help="Repair the STL file before the check and write part.stl: flipped and doubled faces, tiny gaps. "
        "A fault with more than one remedy is refused.",
    )
    command.add_argument("--path", metavar="NAME", help="Path of the unit's waveguide: alpha1, alpha2, ...")
    add_setting(command, PRINTER, "NAME|FILE")
    command.add_argument(
        "--limits",
        metavar="FILE",
        help="Filled-in limits.csv of `specimens`: measured limits, which replace those of the printer.",
    )
    command.add_argument(
        "--up",
        nargs=3,
        type=float,
        default=UP,
        metavar=("X", "Y", "Z"),
        help="Build direction, pointing away from the platform (default: 0 0 1, inlet toward the platform).",
    )
    command.add_argument(
        "--layers",
        nargs="*",
        type=float,
        default=(),
        metavar="MM",
        help="Heights of the layers to draw, in mm above the part's lowest point (default: 12, evenly "
        "spaced).",
    )
    add_solid(command)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Check the part."""
    from ..design.anchors import window
    from ..design.printing.printer import load_printer
    from ..errors import InputError
    from ..usecases.check_print.job import Job, read_stl
    from ..usecases.check_print.run import USE_CASE
    from ..usecases.export.sheets import measured_limits

    unit = unit_if_named(options)
    if unit is None and options.stl is None:
        raise InputError("no part to check was given", "--preset, --unit or --stl", "give one of them")
    if unit is None and options.path is not None:
        raise InputError("--path needs a unit", "--path", "give --preset or --unit as well")
    if not 1e-6 < sum(x * x for x in options.up) < 1e12:
        raise InputError(f"{options.up} is not a direction", "--up", "give three numbers, such as 0 0 1")
    printer = load_printer(options.printer)
    if options.limits is not None:
        printer = printer.with_limits(measured_limits(Path(options.limits)))
    stl = None if options.stl is None else Path(options.stl)
    job = Job(
        printer=printer,
        unit=unit,
        window=None if options.path is None or unit is None else window(unit, options.path),
        quality=options.quality,
        stl=None if stl is None else read_stl(stl),
        stl_file=stl,
        direction=tuple(options.up),
        layers=tuple(options.layers),
        repair=options.repair,
    )
    USE_CASE.start(job, Path(options.out), context)
