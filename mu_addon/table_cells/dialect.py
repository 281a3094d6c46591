"""Rows of cells from text: the separator by which most lines hold numbers, and quotes over several lines."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Sequence

import attrs

from .clock import is_clock
from .notation import is_like_number, unit_behind

DELIMITERS = ("\t", ";", ",", "|", "spaces")
# Number of lines by which a file's separator is judged, from its beginning and from its middle.
_JUDGED = 400
# Lines that a title in quotes may have.
_MOST_LINES = 5
_SPACES = re.compile(r"\s{2,}|\t")
# Between a title and its unit, not between two units.
BRACKET = re.compile(r"(?<=[^\s)\]])\s+(?=[(\[])")
# As loggers write a cell that a spreadsheet shall not change.
_TEXT_FORMULA = re.compile(r'="+([^"]*)"*')
_HALVES = re.compile(r"\s*([-+]?\d+),(\d+)\s*")
_LINE_END = re.compile(r"\r\n|\n|\r")


@attrs.frozen
class Row:
    """One row of a file or spreadsheet: its line, its cells as text, its last line where it has several.

    computed: how its first cell was computed, "" where it was read.
    """

    line: int
    cells: tuple[str, ...]
    last: int = 0
    computed: str = ""

    @property
    def filled(self) -> tuple[str, ...]:
        """Cells that are not empty."""
        return tuple(cell for cell in self.cells if cell)

    @property
    def lines(self) -> tuple[int, ...]:
        """Numbers of the file's lines that it spans."""
        return tuple(range(self.line, max(self.line, self.last) + 1))

    @property
    def numeric(self) -> frozenset[int]:
        """Positions of the cells that hold a number, a date or a time of day."""
        return frozenset(k for k, cell in enumerate(self.cells) if cell and is_reading(cell))


def is_reading(cell: str) -> bool:
    """Return True if a cell looks like a number, a date or a time of day."""
    return is_like_number(cell) or is_clock(cell)


def lines_of(text: str) -> list[str]:
    """Lines of a text as an editor counts them."""
    lines = _LINE_END.split(text)
    if not lines[-1]:
        lines.pop()
    return lines


def rows_of(text: str) -> tuple[tuple[Row, ...], str]:
    """A text as rows of cells, and their separator."""
    lines = lines_of(text)
    delimiter = delimiter_of(lines)
    if '"' not in text:
        return tuple(Row(n, split(line, delimiter)) for n, line in enumerate(lines, 1)), delimiter
    rows = []
    n = 0
    while n < len(lines):
        count = _quoted(lines, n, delimiter)
        row = "\n".join(lines[n : n + count])
        rows.append(Row(n + 1, split(row, delimiter), n + count))
        n += count
    return tuple(rows), delimiter


def delimiter_of(lines: Sequence[str]) -> str:
    """The separator that leaves the largest share of numbers in most lines."""
    middle = max(0, len(lines) // 2 - _JUDGED // 2)
    sample = [*lines[:_JUDGED], *lines[max(_JUDGED, middle) : max(_JUDGED, middle) + _JUDGED]]
    if _has_decimal_commas(sample):
        return "\t"
    return max(DELIMITERS, key=lambda delimiter: sum(_worth(line, delimiter) for line in sample))


def _has_decimal_commas(lines: Sequence[str]) -> bool:
    """True for one column such as 20,51: as many digits behind each comma, and no count or time before it."""
    halves = [found.groups() for line in lines if (found := _HALVES.fullmatch(line))]
    if 2 * len(halves) < len(lines) or len({len(tail) for _, tail in halves}) > 1:
        return False
    heads = [int(head) for head, _ in halves]
    return not all(a < b for a, b in itertools.pairwise(heads))


def _worth(line: str, delimiter: str) -> float:
    """Share of numbers in a line, less for spaces where tabs are: cells between these may be empty."""
    share = _share(split(line, delimiter))
    return 0.9 * share if delimiter == "spaces" and "\t" in line.strip() else share


def _share(cells: Sequence[str]) -> float:
    """Share of numbers among the cells of a row of two or more, 0 for other rows or with tabs in cells."""
    filled = [cell for cell in cells if cell]
    if any("\t" in cell for cell in filled):
        return 0.0
    numbers = sum(is_reading(cell) or bool(unit_behind(cell)) for cell in filled)
    return numbers / len(filled) if numbers > 1 or (numbers and len(filled) > 1) else 0.0


def _quoted(lines: Sequence[str], begin: int, delimiter: str) -> int:
    """Number of lines of a row: more than one if quotes contain line ends, as in titles, and no numbers.

    A quote that is never closed, or is in a row of numbers, ends with its line.
    """
    open_ = lines[begin].count('"') % 2
    count = 1
    while open_ and count < _MOST_LINES and begin + count < len(lines):
        open_ = (open_ + lines[begin + count].count('"')) % 2
        count += 1
    if open_ or count == 1:
        return 1
    parts = (split(line, delimiter) for line in lines[begin : begin + count])
    return 1 if any(sum(map(is_reading, cells)) > 1 for cells in parts) else count


def split(line: str, delimiter: str) -> tuple[str, ...]:
    """Cells of a line without the spaces around them, and without empty ones at its end."""
    if delimiter == "spaces":
        words = line.split()
        numbers = sum(map(is_reading, words))
        # Titles have single spaces in them, and their units in brackets.
        cells = (
            words
            if 2 * numbers >= len(words) and numbers > 1
            else _SPACES.split(BRACKET.sub(" ", line.strip()))
        )
    elif '"' in line and line.count('"') % 2 == 0:
        try:
            cells = next(
                csv.reader([line] if "\n" not in line else line.splitlines(True), delimiter=delimiter), []
            )
        except csv.Error:
            cells = line.split(delimiter)
    else:
        # A quote that is never closed divides nothing.
        cells = line.split(delimiter)
    # Line ends in a title are spaces; other spaces keep their kind, which may divide thousands.
    cells = [cell.replace("\r", "").replace("\n", " ").strip().strip('"').strip() for cell in cells]
    if '="' in line:
        cells = [_TEXT_FORMULA.sub(r"\1", cell) for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return tuple(cells)
