"""`compare`: runs side by side."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..run.context import RunContext
    from .options import Commands


MOST = 30
"""Characters of a value in the terminal; compare.csv has it whole."""


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
    from ..files import make_folder, write_text
    from ..nodes.comparison import comparison_html, difference, of_runs, write_comparison
    from ..report.html_parts import number, page

    found = of_runs([Path(folder) for folder in options.runs])
    for name, status in found.unfinished:
        context.progress.warning(f"the run {name} is {status}: its results are those so far", name)
    if options.out:
        folder = make_folder(Path(options.out))
        write_comparison(found, folder / "compare.csv")
        title = f"Comparison of {', '.join(found.names)}"
        sections = [("compare", "Side by side", comparison_html(found))]
        write_text(folder / "report.html", page(title, found.remark(), "", "", sections))
    head = ["", *found.names, *(f"{name} - {found.names[0]}" for name in found.names[1:])]
    rows = [
        [what, *(number(v)[:MOST] for v in values), *(number(difference(values[0], v)) for v in values[1:])]
        for what, values in found.rows()
    ]
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    context.console_summary = lambda summary: [
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
        for row in [head, *rows]
    ]
