"""Experiments in files, with the given answers."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import attrs

from ..errors import InputError
from ..table_cells.notation import DECIMALS
from .blocks import FEWEST, Block, tables
from .keys import ANSWERS
from .proposal import NoExperiment, Proposal, Question
from .sheet import Sheet
from .source import read_sheets
from .steps import answers_for, propose
from .tracked_table import NO_MARKERS, read_pixels

# One answer for all of a file: its decimal sign.
DECIMAL = "decimal"
_INTERVAL = "interval_s"
# Words of files whose pairs of x and y are positions, of those that hold nothing else, and of other ones.
_TRACKERS = re.compile(r"kinovea|bodyparts|\bmarker|track|trajector")
_PLACES = re.compile(r"[(\[](px|pixels?)[)\]]|optitrack|naturalpoint|marker_names|pathfiletype")
_NO_PLACES = re.compile(r"accel|\bacc\b|gyro|magnet|\bimu\b")
_HEAD = 60


@attrs.frozen
class Understood:
    """Experiments in files, and descriptions of tables and lines outside them."""

    proposals: tuple[Proposal, ...]
    left_out: tuple[str, ...]

    @property
    def open(self) -> tuple[tuple[Proposal, Question], ...]:
        """Questions that are not answered."""
        return tuple((p, question) for p in self.proposals for question in p.questions)

    @property
    def asked(self) -> tuple[tuple[Proposal, Question], ...]:
        """Each question once, with the first experiment that has it: one answer serves all."""
        first: dict[str, tuple[Proposal, Question]] = {}
        for p, question in self.open:
            first.setdefault(question.key, (p, question))
        return tuple(first.values())


def understand(
    files: Sequence[Path], answers: Mapping[str, str], read: Callable[[int], None] = lambda count: None
) -> Understood:
    """Read the experiments in files; raises InputError for unreadable files and unused answers.

    answers: by key, or by name of an experiment, a point and key, as text; read: called with the number of
    files that are read.
    """
    proposals: list[Proposal] = []
    left_out: list[str] = []
    decimal = answers.get(DECIMAL)
    if decimal is not None and decimal not in DECIMALS:
        raise InputError(f"decimal = {decimal!r} is not known", "--set", "write decimal=. or decimal=,")
    for count_read, path in enumerate(files, 1):
        before = len(proposals)
        refused: InputError | None = None
        known_tables, unknown = _tables(path, decimal, left_out)
        if not (known_tables or unknown) and any(k.rpartition(".")[2] == _INTERVAL for k in answers):
            known_tables, unknown = _tables(path, decimal, left_out, 1)
        for sheet, number, count, block in known_tables or unknown:
            parts = [path.stem, sheet.name if count == 1 else "", block.label]
            if count > 1 and not block.label:
                parts.append(str(number))
            name = _unlike(" ".join(part for part in parts if part), [p.name for p in proposals])
            try:
                found = propose(path, block, name, answers_for(name, answers))
            except NoExperiment as error:
                refused = refused or error
                left_out.append(f"{error.where}: {error.what}")
                continue
            if block.unsure:
                question = Question(
                    DECIMAL,
                    f"are numbers like 1,234 of {path.name} written with a point or a comma?",
                    DECIMALS,
                )
                found = attrs.evolve(found, questions=(question, *found.questions))
            proposals.append(found)
        if known_tables:
            left_out += [
                f"{path}, line {block.lines[0]}: a table without two known quantities was left out"
                for _, _, _, block in unknown
            ]
        new = proposals[before:]
        unknown_columns = all(any(q.key.startswith("column.") for q in p.questions) for p in new)
        if unknown_columns and not any(key.startswith("column.") for key in answers):
            _require_untracked(path)
        if not new:
            raise refused or _no_table(path, decimal)
        read(count_read)
    _require_used(answers, proposals)
    return Understood(tuple(proposals), tuple(left_out))


def _require_untracked(path: Path) -> None:
    """Raise InputError for a file of tracked markers, which another command reads.

    One pair of x and y may be any curve, and an accelerometer has three axes as well.
    """
    names: tuple[str, ...] = ()
    refused = remedy = ""
    try:
        names = read_pixels(path).names
    except InputError as error:
        refused, remedy = error.what, error.remedy
    head = [row for sheet in read_sheets(path) for row in sheet.rows[:_HEAD]]
    shown = " ".join(" ".join(row.filled) for row in head).casefold()
    by_name = (names or "not in pixels" in refused) and _TRACKERS.search(shown)
    places = len(names) > 1 or "three axes" in refused or by_name or _PLACES.search(shown)
    if _NO_PLACES.search(shown) or not places:
        return
    listed = ", ".join(names[:4]) or (refused if refused != NO_MARKERS else "an export of motion capture")
    raise InputError(
        f"the file holds positions of tracked markers: {listed}",
        str(path),
        f"`track` takes them otherwise: {remedy}"
        if remedy
        else f"`track {path.name} --markers bench.toml --pressure ladder.csv` makes an experiment of them",
    )


def _no_table(path: Path, decimal: str | None) -> InputError:
    """Error for a file without a table, with its content."""
    sheets = read_sheets(path, decimal)
    rows = [row for sheet in sheets for row in sheet.rows if row.filled]
    where = f"{path}, line {rows[0].line}" if rows else str(path)
    single = next((block for sheet in sheets for block in tables(sheet, 1).blocks), None)
    if single is not None:
        unread = "".join(f"; {one.words}" for one in single.unread)
        return InputError(
            "the file holds no table of measured data: "
            f"lines {single.lines[0]} to {single.lines[-1]} have one column of numbers, and a second one, "
            f"such as the time, is missing{unread}",
            where,
            f"export it as well, or give the time from row to row: --set {_INTERVAL}=SECONDS --set "
            "column.1=QUANTITY",
        )
    pairs = [row for row in rows if len(row.numeric) > 1]
    shown = " ".join((pairs or rows)[0].filled)[:60] if rows else ""
    line = (pairs or rows)[0].line if rows else 0
    return InputError(
        f"the file holds no table of measured data: {len(pairs)} of its {len(rows)} lines have two numbers "
        f"or more, and no {FEWEST} of them have these in the same columns; line {line} is {shown!r}",
        where,
        "give a file with two columns of numbers or more, and their names above them, divided by tabs, "
        "semicolons or commas",
    )


_Table = tuple[Sheet, int, int, Block]


def _tables(
    path: Path, decimal: str | None, left_out: list[str], fewest: int = 2
) -> tuple[list[_Table], list[_Table]]:
    """Tables of a file with `fewest` known quantities, and the others; lines in none go to left_out."""
    known_tables: list[_Table] = []
    unknown: list[_Table] = []
    for sheet in read_sheets(path, decimal):
        where = f"{path}, sheet {sheet.name!r}" if sheet.name else str(path)
        try:
            found = tables(sheet, fewest)
        except InputError as error:
            raise InputError(error.what, f"{where}, {error.where}", error.remedy) from error
        left_out += [f"{where}, {one.words}" for one in found.unread]
        for number, block in enumerate(found.blocks, 1):
            known = [c for c in block.columns if c.quantity not in ("", "count")]
            untitled = not any(c.title for c in block.columns)
            table = (sheet, number, len(found.blocks), block)
            (known_tables if len(known) >= fewest or untitled else unknown).append(table)
    return known_tables, unknown


def _unlike(name: str, others: Sequence[str]) -> str:
    """The name, numbered if others have it."""
    new, again = name, 2
    while new in others:
        new, again = f"{name} {again}", again + 1
    return new


def _require_used(answers: Mapping[str, str], proposals: Sequence[Proposal]) -> None:
    """Raise InputError for answers to no question: unknown keys, experiments and columns."""
    names = [p.name for p in proposals]
    titles = {title for p in proposals for c in p.block.columns for title in (c.name, str(c.place))}
    for given in answers:
        name = next((n for n in names if given.startswith(n + ".")), "")
        key = given[len(name) + 1 :] if name else given
        kind, _, title = key.partition(".")
        known = kind in ("unit", "column") and title in titles
        if not (known or key in ANSWERS or (key == DECIMAL and not name)):
            raise InputError(
                f"{given!r} answers no question",
                "--set",
                f"experiments: {', '.join(names)}; keys: {', '.join(ANSWERS)}, decimal, unit.TITLE and "
                f"column.TITLE with a title or number of {', '.join(sorted(titles))}",
            )
