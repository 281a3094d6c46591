"""What a study shows, as parts: report, terminal, panel and summary.json render the same ones.

A part states values and words, never how a face draws them. What takes time to make (a chart, a picture) is
a function, called by a face that shows it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import attrs

from ..errors import MuError
from ..files import csv_text


@attrs.frozen
class Fact:
    """A figure with its name.

    shown: its text with the unit, "" where no face shows it as a figure; key: its place in summary.json,
    levels separated by dots, "" if it is not there.
    """

    name: str
    value: Any
    shown: str = ""
    key: str = ""


def recorded(key: str, value: Any) -> Fact:
    """A value of summary.json that no other face shows."""
    return Fact(key, value, key=key)


@attrs.frozen
class Sentence:
    """A sentence; answer: it answers the study's question; terminal: it is printed at the end of a command.

    page: it stands in the report, with `note` in the box at its head; strong: words of it to be set off;
    found: a first finding, told as soon as it is there; heading: it stands over the parts that follow.
    """

    text: str
    answer: bool = False
    terminal: bool = False
    page: bool = True
    note: bool = False
    strong: str = ""
    found: bool = False
    heading: bool = False


def echo(*lines: str) -> list[Sentence]:
    """Lines at the end of a command, which the report leaves out."""
    return [Sentence(line, terminal=True, page=False) for line in lines]


def _columns(head: Sequence[Sequence[str]]) -> list[tuple[str, str]]:
    return [(one, "") if isinstance(one, str) else (one[0], one[1]) for one in head]


@attrs.frozen
class Table:
    """A table of texts.

    head: title of each column, or with it "n" for numbers, "text" for long texts, "line" for texts of one
    line; best: rows to mark; groups: titles over so many columns each; stacked: a phone shows each row as a
    block.
    """

    caption: str
    head: Sequence[tuple[str, str]] = attrs.field(converter=_columns)
    rows: Sequence[Sequence[Any]]
    best: Sequence[int] = ()
    groups: Sequence[tuple[str, int]] = ()
    stacked: bool = False

    @staticmethod
    def numbers(*titles: str) -> list[tuple[str, str]]:
        """Columns of numbers."""
        return [(title, "n") for title in titles]


@attrs.frozen
class File:
    """A file of the run's folder; make: its bytes or text, or what makes them or writes the path.

    of: what it is made of: a file, or a folder of files, that takes long is not made again of the same.
    """

    name: str
    make: bytes | str | Callable[[Path], bytes | str | None]
    of: Any = None


def csv(name: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> File:
    """A CSV file; numbers to their last digit."""

    return File(name, lambda path: csv_text(columns, rows))


@attrs.frozen
class Chart:
    """A chart; make: its SVG text; file: that it is, too; kind: "bar" for a scale, "best" to set it off."""

    make: Callable[[], str]
    caption: str
    alt: str = ""
    file: str = ""
    kind: str = ""


@attrs.frozen
class Pictures:
    """Pictures side by side, each also a file of the folder, if it has a name; make: name and picture.

    shown: False of files that no page shows. scale: of the pictures' colours, above them; it is drawn after
    them.
    """

    make: Callable[[], Sequence[tuple[str, Any]]]
    shown: bool = True
    scale: Chart | None = None


@attrs.frozen
class Beside:
    """Columns side by side, each a part or a list of parts; across: 2, 3 or more in a row of the page."""

    parts: Sequence[Any]
    across: int = 2


@attrs.frozen
class Warn:
    """A warning, told when it is found; repeated in the report, unless that shows it otherwise.

    where, remedy: as those of an error.
    """

    text: str
    where: str = ""
    remedy: str = ""
    repeated: bool = True


@attrs.frozen
class Fault:
    """An error that is a study's result: it ends the run once all is shown."""

    error: MuError


Part = Fact | Sentence | Table | File | Chart | Pictures | Beside | Warn | Fault


def flat(parts: Sequence[Part]) -> list[Part]:
    """The parts, those side by side included, in order."""
    found: list[Part] = []
    for part in parts:
        found += flat(columns(part)) if isinstance(part, Beside) else [part]
    return found


def columns(beside: Beside) -> list[Part]:
    """The parts of all columns in order."""
    return [part for one in beside.parts for part in (one if isinstance(one, list) else [one])]


def listed(names: Sequence[str], last: str = "and") -> str:
    """Names in a row: "a, b and c"."""
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + f" {last} " + names[-1]
