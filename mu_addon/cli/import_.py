"""`import`: files of test machines and data loggers into a folder of measured data."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .options import add_results, require_out

if TYPE_CHECKING:
    from ..lab_files.proposal import Proposal, Question
    from ..run.context import RunContext
    from .options import Commands


def add(commands: Commands[Any]) -> None:
    """Add the parser of `import`."""
    command = commands.add_parser(
        "import",
        help="Import files of test machines and data loggers (CSV, text, Excel, HTML): propose kind, "
        "columns, units and signs, ask for what is missing, and write a folder of measured data.",
        epilog="example: run.py import tension.csv --set mode=uniaxial --set length_mm=40 --out measured",
    )
    command.add_argument(
        "files",
        nargs="+",
        metavar="FILE",
        help="CSV, text, workbook (.xlsx, .xls, .ods) or HTML table, recognised by content.",
    )
    command.add_argument(
        "--set",
        dest="answers",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="Answer to a question, such as kind=coupon, section_mm=12.5x3, length_mm=40, unit.Load=N, "
        "column.Ch1=force, column.2=none, decimal=, or, for one experiment alone, NAME.KEY=VALUE. Name a "
        "column by its title or its number. Repeat the option for each answer.",
    )
    command.add_argument(
        "--dry-run",
        action="store_true",
        help="Show how the files were read, in the terminal and in import.html, and import nothing.",
    )
    add_results(command)


def run(options: argparse.Namespace, context: RunContext) -> None:
    """Import the files; in a terminal, ask the open questions."""
    from ..errors import InputError
    from ..usecases.import_data.run import import_files

    require_out(options)
    answers = {}
    for given in options.answers:
        key, equals, value = given.partition("=")
        if not equals or not key.strip():
            raise InputError(f"{given!r} is not an answer", "--set", "write it as KEY=VALUE")
        answers[key.strip()] = value.strip()
    asks = sys.stdin.isatty() and sys.stderr.isatty() and not options.json
    import_files(
        [Path(name) for name in options.files],
        Path(options.out),
        answers,
        context,
        _asked_in_terminal if asks else None,
        (lambda lines: None) if options.json or (options.quiet and not asks) else _show,
        options.dry_run,
    )


def _show(lines: list[str]) -> None:
    """Print lines to the terminal, before the questions."""
    from ..run.progress import printable

    sys.stderr.write(printable("\n".join(lines), sys.stderr) + "\n")


def _asked_in_terminal(proposal: Proposal, question: Question) -> str:
    """Read the answer to a question; an empty line takes the proposed one."""
    proposed = f" [{question.proposed}]" if question.proposed else ""
    while True:
        sys.stderr.write(f"{proposal.name}: {question.text}{proposed} ")
        sys.stderr.flush()
        line = sys.stdin.readline()
        if not line:
            from ..errors import InputError

            raise InputError(
                "the questions were not answered", "standard input", "answer with --set KEY=VALUE"
            )
        answer = line.strip() or question.proposed
        if answer and (not question.choices or answer in question.choices):
            return answer
