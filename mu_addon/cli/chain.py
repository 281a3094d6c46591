"""`chain`: units in series."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_report, add_results, help_of, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `chain`."""
    from ..chain.settings import TIP_MASS

    command = commands.add_parser(
        "chain",
        help="Simulate units in series, one pressure each, under gravity and a tip load, or find the "
        "pressures that bring the tip to a point.",
        epilog="example: run.py chain assets/examples/trunk/chain.toml --out out/trunk",
    )
    command.add_argument(
        "file", metavar="FILE", help="The chain, a chain.toml: its units, loads, protocol or target."
    )
    add_results(command)
    add_report(command)
    command.add_argument(
        "--reach",
        nargs=3,
        type=float,
        metavar="MM",
        help="Point x y z that the tip is to reach, in place of the file's protocol or target.",
    )
    command.add_argument("--tip-mass", type=float, metavar="G", help=help_of(TIP_MASS, "that of the file"))


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Learn the joints and solve the chain."""
    from ..usecases.chain.job import read_chain
    from ..usecases.chain.run import USE_CASE

    require_out(options)
    changes: dict[str, Any] = {}
    if options.reach is not None:
        changes["target"] = {"reach": list(options.reach)}
    if options.tip_mass is not None:
        changes["tip_mass_g"] = options.tip_mass
    job = read_chain(Path(options.file), changes)
    USE_CASE.start(job, Path(options.out), context)
