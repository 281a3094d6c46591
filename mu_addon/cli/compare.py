"""`compare`: runs side by side."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `compare`."""
    command = commands.add_parser(
        "compare",
        help="Compare finished runs of one kind: inputs that differ, and results with their differences to "
        "the first run's.",
        epilog="example: run.py compare out/thin out/thick --out out/compared",
    )
    command.add_argument("runs", nargs="+", metavar="RUN", help="Folders of two or more runs.")
    command.add_argument(
        "--out", metavar="DIR", help="Also write compare.csv and report.html, with charts of the angle."
    )


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Print the comparison, and write it into a folder if one is named."""
    from ..nodes.comparison import Compared, of_runs
    from ..report.study_report import write_page
    from ..run.shown import Shown

    study = Compared(found=of_runs([Path(folder) for folder in options.runs]))
    shown = Shown(study, Path(options.out) if options.out else None, context)
    shown.put([(one, shown.made(one.method(study))) for one in study.sections()])
    context.console_summary = lambda summary: shown.lines
    if options.out:
        write_page(shown)
