"""`resume`: the run that a folder's inputs describe, from where it stopped."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_device, add_scheduler, help_of, require_out

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands

KEPT = ("report", "workers", "device", "scheduler", "retry")
"""Options that decide no result: summary.json has those of a run's command, and no file of inputs does."""


def add(commands: Commands[Any]) -> None:
    """Add the parser of `resume`."""
    from ..simulate_and_place.settings import WORKERS

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
    command.add_argument(
        "--report",
        action=argparse.BooleanOptionalAction,
        help="Write pictures and report.html (default: as the command was given).",
    )
    add_device(command)
    add_scheduler(command)
    command.set_defaults(device=None)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Run a folder's inputs with its command's options, taking finished stages from the cache."""
    from ..fem.device import DEVICE, require_device
    from ..run.summary import SUMMARY, read_summary
    from ..studies.starting import resume

    require_out(options)
    before = read_summary(Path(options.out) / SUMMARY)
    kept = before.get("options", {})
    given = {name: kept[name] for name in KEPT if isinstance(kept, dict) and name in kept}
    if before.get("status") == "complete":
        # Of a run that has ended, to fail again is no option to go on with.
        given.pop("retry", None)
    # Workers get code from their scheduler, so a folder does not choose one.
    elsewhere = given.pop("scheduler", None)
    if elsewhere and options.scheduler is None:
        context.progress.warning(
            f"the run was started with --scheduler {elsewhere}, and continues on this machine",
            options.out,
            f"to continue there: resume {options.out} --scheduler {elsewhere}",
        )
    given |= {name: value for name in KEPT if (value := getattr(options, name, None)) is not None}
    if "device" in given:
        require_device(DEVICE.checked(given["device"]))
    context.wants_report = given.get("report") is not False
    context.summary["options"] = given
    resume(Path(options.out), context, given)
