"""Tables that this program asks for, as any spreadsheet program saves them: rows with decimal points."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

from ..reading import file_bytes
from .dialect import lines_of
from .encoding import decoded
from .notation import is_like_number, judged, number, plain_signs

_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f\x7f-\x84\x86-\x9f]")
_LONGEST = 1 << 26


def own_text(path: Path, most: int = _LONGEST) -> str:
    r"""Text of a table, UTF-8, UTF-16 with its mark or Windows-1252; line ends as \n.

    Raises OSError, and UnicodeDecodeError if the file is not text.
    """
    data = file_bytes(path, most)
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = decoded(data, str(path))
    else:
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("cp1252")
            if _CONTROL.search(text):
                raise
    return text.replace("\r\n", "\n").replace("\r", "\n")


def own_lines(text: str) -> list[tuple[int, str]]:
    """Lines that are not empty, with their numbers, less comments and Excel's line `sep=;`.

    A spreadsheet's empty row is a line of separators.
    """
    numbered = [(n, line) for n, line in enumerate(lines_of(text), 1) if line.strip(' \t;,"')]
    numbered = [(n, line) for n, line in numbered if not line.lstrip().startswith("#")]
    if numbered and re.fullmatch(r'"?sep=.?"?', numbered[0][1].strip()):
        numbered.pop(0)
    return numbered


def own_rows(numbered: Sequence[tuple[int, str]]) -> list[tuple[int, list[str]]]:
    """The cells of lines whose first names the columns; numbers with a decimal point.

    The first line determines the separator: comma, semicolon or tab. A column determines its decimal sign;
    thousands are not divided in these tables, so that a single 1,234 is a decimal. Raises csv.Error.
    """
    if not numbered:
        return []
    heading = numbered[0][1]
    delimiter = max(",;\t", key=heading.count)
    rows = [
        (n, [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter), [])])
        for n, line in numbered
    ]
    if delimiter == "," and not any('"' in line or not line.isascii() for _, line in numbered):
        return rows
    for k in range(len(rows[0][1])):
        held = [(i, rows[i][1][k]) for i in range(1, len(rows)) if k < len(rows[i][1])]
        for (i, _), cell in zip(held, _pointed([cell for _, cell in held]), strict=True):
            rows[i][1][k] = cell
    if delimiter != ",":
        # A spreadsheet program fills rows up to the longest one.
        width = len(rows[0][1])
        for _, cells in rows:
            while len(cells) > width and not cells[-1]:
                cells.pop()
    return rows


def _pointed(cells: Sequence[str]) -> list[str]:
    """Cells of a column with decimal points, also in those that list numbers between spaces."""
    lists = [plain_signs(cell).split() for cell in cells]
    words = [word for words in lists if all(map(is_like_number, words)) for word in words]
    decimal = judged(words, "," if any("," in word for word in words) else ".").decimal
    return [
        " ".join(_point(word, decimal) for word in words)
        if words and all(map(is_like_number, words))
        else cell
        for words, cell in zip(lists, cells, strict=True)
    ]


def _point(word: str, decimal: str) -> str:
    if decimal == "." or "," not in word or number(word, decimal) is None:
        return word
    return word.replace(".", "").replace("'", "").replace(",", ".")
