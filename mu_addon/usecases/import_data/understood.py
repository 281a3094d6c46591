"""What experiments files hold, with the answers that were given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import attrs

from ...errors import InputError
from ...lab_files.blocks import blocks
from ...lab_files.cells import DECIMALS
from ...lab_files.proposal import Proposal, Question, answers_for, propose
from ...lab_files.source import read_sheets

# One answer for all of a file: its decimal sign.
DECIMAL = "decimal"
# Keys that answer a question or change what was concluded; others are a slip of the pen.
KEYS = (
    "kind",
    "mode",
    "section_mm",
    "length_mm",
    "interval_s",
    "zero",
    "specimen",
    "role",
    "plates",
    "axis",
    "valve",
    "pressure",
    "cells",
    "temperature_C",
    "scale",
    "orientation_deg",
    "orientation_axis",
    "gap_mm",
    "mass_g",
    "chamber_volume_mm3",
)


@attrs.frozen
class Understood:
    """What files come to: an experiment each, and tables that are none, in words."""

    proposals: tuple[Proposal, ...]
    left_out: tuple[str, ...]

    @property
    def open(self) -> tuple[tuple[Proposal, Question], ...]:
        """The questions that are not answered."""
        return tuple((p, question) for p in self.proposals for question in p.questions)

    @property
    def asked(self) -> tuple[tuple[Proposal, Question], ...]:
        """Each of them once, of the first experiment that has it: one answer serves all."""
        first: dict[str, tuple[Proposal, Question]] = {}
        for p, question in self.open:
            first.setdefault(question.key, (p, question))
        return tuple(first.values())


def understand(files: Sequence[Path], answers: Mapping[str, str]) -> Understood:
    """What experiments files hold; raises InputError for what cannot be read, and for answers without use.

    answers: by key, or by name of an experiment, a point and key, as text.
    """
    proposals: list[Proposal] = []
    left_out: list[str] = []
    decimal = answers.get(DECIMAL)
    if decimal is not None and decimal not in DECIMALS:
        raise InputError(f"decimal = {decimal!r} is not known", "--set", "write decimal=. or decimal=,")
    for path in files:
        before = len(proposals)
        for sheet in read_sheets(path, decimal):
            tables = blocks(sheet)
            for number, block in enumerate(tables, 1):
                where = f"{path}{f', sheet {sheet.name!r}' if sheet.name else ''}, line {block.lines[0]}"
                known = [c for c in block.columns if c.quantity not in ("", "count")]
                if block.columns[0].title and len(known) < 2:
                    left_out.append(f"{where}: a table without two known quantities was left out")
                    continue
                parts = [path.stem, sheet.name if len(tables) == 1 else "", block.label]
                if len(tables) > 1 and not block.label:
                    parts.append(str(number))
                name = _unlike(" ".join(part for part in parts if part), [p.name for p in proposals])
                found = propose(path, block, name, answers_for(name, answers))
                if sheet.unsure:
                    question = Question(
                        DECIMAL,
                        f"are numbers like 1,234 of {path.name} written with a point or a comma?",
                        DECIMALS,
                    )
                    found = attrs.evolve(found, questions=(question, *found.questions))
                proposals.append(found)
        if len(proposals) == before:
            raise InputError(
                "the file holds no table of measured data",
                str(path),
                "give a file with columns of numbers, and their names above them",
            )
    _require_used(answers, proposals)
    return Understood(tuple(proposals), tuple(left_out))


def _unlike(name: str, others: Sequence[str]) -> str:
    """The name, numbered where others have it."""
    new, again = name, 2
    while new in others:
        new, again = f"{name} {again}", again + 1
    return new


def _require_used(answers: Mapping[str, str], proposals: Sequence[Proposal]) -> None:
    """Raise InputError for answers to no question: unknown keys, experiments and columns."""
    names = [p.name for p in proposals]
    titles = {title for p in proposals for title in p.titles}
    for given in answers:
        name = next((n for n in names if given.startswith(n + ".")), "")
        key = given[len(name) + 1 :] if name else given
        kind, _, title = key.partition(".")
        known = kind in ("unit", "column") and title in titles
        if not (known or key in KEYS or (key == DECIMAL and not name)):
            raise InputError(
                f"{given!r} answers no question",
                "--set",
                f"experiments: {', '.join(names)}; keys: {', '.join(KEYS)}, decimal, unit.TITLE and "
                f"column.TITLE with a title of {', '.join(sorted(titles))}",
            )
