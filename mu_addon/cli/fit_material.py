"""`fit-material`: laws from coupon tests."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_measured_folder, add_results, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from ..run.progress import Progress
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `fit-material`."""
    command = commands.add_parser(
        "fit-material",
        help="Fit hyperelastic laws to coupon tests and write the best one as a material for simulations.",
        epilog="example: run.py fit-material my-coupons --out out/resin",
    )
    add_measured_folder(command)
    add_results(command)
    command.add_argument(
        "--laws",
        nargs="+",
        default=(),
        metavar="LAW",
        help="Laws to fit: neo-hooke, mooney-rivlin, yeoh, ogden-1, ogden-2, ogden-3 (default: all).",
    )
    command.add_argument(
        "--hold-out",
        nargs="+",
        default=(),
        metavar="MODE",
        help="Test modes held out of the fit for validation: uniaxial, equibiaxial, pure_shear (default: "
        "none).",
    )
    command.add_argument(
        "--weights",
        choices=("absolute", "relative"),
        default="absolute",
        help="Weights of the residuals: absolute divides them by the test's largest stress, relative by the "
        "stress itself (default: absolute).",
    )


def run(options: argparse.Namespace, progress: Progress, context: RunContext) -> None:
    """Fit laws to the folder's coupons."""
    from ..usecases.fit_material.run import fit_material

    require_out(options)
    fit_material(
        Path(options.folder),
        Path(options.out),
        options.laws,
        options.hold_out,
        options.weights,
        progress=progress,
        context=context,
    )


def console_summary(summary: dict[str, Any]) -> list[str]:
    """What was found, in a few lines."""
    from ..usecases.fit_material.run import console_summary

    return console_summary(summary)
