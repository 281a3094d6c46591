"""Questions of an import, asked in a terminal."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..lab_files import Understood
    from ..studies.import_ import Ask


def asker(options: argparse.Namespace) -> Ask | None:
    """What shows in a terminal how files were read, and asks what they leave open; None for no one."""
    asks = sys.stdin.isatty() and sys.stderr.isatty()
    return None if options.json or (options.quiet and not asks) else lambda found: _answers(found, asks)


def _answers(found: Understood, asks: bool) -> dict[str, str] | None:
    """Show how the files were read, and read the answers; an empty line takes the proposed one."""
    from ..errors import InputError
    from ..run.progress import printable
    from ..studies.import_ import terminal_lines

    sys.stderr.write(printable("\n".join(terminal_lines(found)), sys.stderr) + "\n")
    if not asks:
        return None
    answers: dict[str, str] = {}
    for proposal, question in found.asked:
        proposed = f" [{question.proposed}]" if question.proposed else ""
        answer = ""
        while not answer or (question.choices and answer not in question.choices):
            sys.stderr.write(f"{proposal.name}: {question.text}{proposed} ")
            sys.stderr.flush()
            line = sys.stdin.readline()
            if not line:
                what = "the questions were not answered"
                raise InputError(what, "standard input", "answer with --set KEY=VALUE")
            answer = line.strip() or question.proposed
        answers[question.key] = answer
    return answers
