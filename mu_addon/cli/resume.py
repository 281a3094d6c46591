"""`resume`: the run that a folder's inputs describe, from where it stopped."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_device, add_report, help_of, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `resume`."""
    from ..usecases.simulate_and_place.settings import WORKERS

    command = commands.add_parser(
        "resume",
        help="Resume a stopped run, or repeat a run from the inputs in its folder.",
        epilog="example: run.py resume out/mu-1.0x",
    )
    command.add_argument(
        "out",
        metavar="FOLDER",
        help="Folder of any run: its --out folder, or a folder that holds only its inputs.",
    )
    command.add_argument(
        "--json", action="store_true", help="Write one JSON message per line to standard output."
    )
    command.add_argument("--workers", type=int, metavar="N", help=help_of(WORKERS, "that of the command"))
    add_report(command)
    add_device(command)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Run a folder's inputs, taking finished stages from the cache."""
    from ..fem.device import DEVICE, require_device
    from ..usecases.resume import resume

    require_out(options)
    require_device(options.device)
    # The folder's own value, if the command gives none.
    given = {
        "workers": options.workers,
        "device": None if options.device == DEVICE.default else options.device,
    }
    resume(Path(options.out), context, {name: value for name, value in given.items() if value is not None})
