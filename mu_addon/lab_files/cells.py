"""Rows of cells from text or a spreadsheet, and numbers in them, decimal comma or point."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence

import attrs

# A group of thousands begins with another digit than 0: "0,094" is a decimal.
_THOUSANDS = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}([. ]\d{3})+(,\d*)?"),
}
_PLAIN = {
    ".": re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?"),
    ",": re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?"),
}
DECIMALS = (".", ",")
DELIMITERS = ("\t", ";", ",", "spaces")
_MISSING = ("", "nan", "n/a", "---", "-")
# Lines of the file by which its separators are judged, from its beginning and from its middle.
_JUDGED = 400
_SPACES = re.compile(r"\s{2,}")


@attrs.frozen
class Row:
    """One line of a file or spreadsheet: its number, and its cells as text."""

    line: int
    cells: tuple[str, ...]

    @property
    def filled(self) -> tuple[str, ...]:
        """The cells that hold something."""
        return tuple(cell for cell in self.cells if cell)


@attrs.frozen
class Sheet:
    """Rows of a file, or of one sheet of a workbook (name ""), and its decimal sign.

    unsure: both decimal signs are possible, "1,234" being all there is.
    """

    name: str
    rows: tuple[Row, ...]
    decimal: str
    unsure: bool = False


def number(cell: str, decimal: str) -> float | None:
    """The number in a cell, nan where a value is missing, None for any other text."""
    if cell.lower() in _MISSING:
        return float("nan")
    if _PLAIN[decimal].fullmatch(cell):
        return float(cell.replace(decimal, "."))
    if _THOUSANDS[decimal].fullmatch(cell):
        for sign in ",. ":
            if sign != decimal:
                cell = cell.replace(sign, "")
        return float(cell.replace(decimal, "."))
    return None


def is_numeric(row: Row, decimal: str) -> bool:
    """Whether a row holds two numbers or more, and nothing else but missing values."""
    values = [number(cell, decimal) for cell in row.cells]
    return None not in values and sum(v == v for v in values) >= 2


def rows_of_text(text: str, decimal: str | None = None) -> Sheet:
    """A text as rows of cells, separated as most of its lines of numbers are.

    decimal: "." or "," where it is known.
    """
    lines = text.splitlines()
    middle = max(0, len(lines) // 2 - _JUDGED // 2)
    sample = [*lines[:_JUDGED], *lines[max(_JUDGED, middle) : max(_JUDGED, middle) + _JUDGED]]
    signs = (decimal,) if decimal else DECIMALS
    score = {}
    for delimiter in DELIMITERS:
        rows = [Row(0, _split(line, delimiter)) for line in sample]
        for sign in signs:
            # A comma between columns is no decimal sign but in quotes, which the reader of CSV has taken off.
            if not (delimiter == "," and sign == "," and '"' not in text):
                score[delimiter, sign] = sum(is_numeric(row, sign) for row in rows)
    most = max(score.values())
    best = [way for way in score if score[way] == most]
    delimiter, sign = best[0]
    unsure = most > 0 and decimal is None and _differ(sample, [way for way in best if way[0] == delimiter])
    return Sheet("", tuple(Row(n, _split(line, delimiter)) for n, line in enumerate(lines, 1)), sign, unsure)


def _differ(lines: Sequence[str], ways: Sequence[tuple[str, str]]) -> bool:
    """Whether these ways of reading lines give other numbers."""
    if len(ways) < 2:
        return False
    for line in lines:
        cells = _split(line, ways[0][0])
        for cell in cells:
            values = [number(cell, sign) for _, sign in ways]
            if None not in values and len({v for v in values if v == v}) > 1:
                return True
    return False


def _split(line: str, delimiter: str) -> tuple[str, ...]:
    """Cells of a line without the spaces around them, and without empty ones at its end."""
    if delimiter == "spaces":
        stripped = line.strip()
        cells = _SPACES.split(stripped)
        if len(cells) == 1 and " " in stripped and not re.search(r"[^\d\s.,eE+-]", stripped):
            cells = stripped.split()
    else:
        cells = next(csv.reader([line], delimiter=delimiter), [])
    cells = [cell.strip().strip('"').strip() for cell in cells]
    while cells and not cells[-1]:
        cells.pop()
    return tuple(cells)
