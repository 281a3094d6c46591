"""Sheets to be filled in at the bench: CSV whose last column is left empty."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path

from ...cells.own import own_lines, own_rows, own_text
from ...errors import InputError
from ...reading import unreadable

# Bytes of a filled sheet: a hundred times as many as the empty ones have.
_LONGEST = 1 << 17


def sheet_text(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """An empty sheet as CSV text: its rows without the last column's cell, which is to be filled in."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([*row, ""] for row in rows)
    return text.getvalue()


def sheet_rows(path: Path, remedy: str) -> list[tuple[str, dict[str, str]]]:
    """Rows of a filled sheet, each with its location in words; raises InputError with the remedy."""
    try:
        rows = own_rows(own_lines(own_text(path, _LONGEST)))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the sheet: {unreadable(error)}", str(path), remedy) from error
    except csv.Error as error:
        raise InputError(f"cannot read the sheet: {error}", str(path), remedy) from error
    names = rows[0][1] if rows else []
    return [(f"{path}, line {number}", dict(zip(names, cells, strict=False))) for number, cells in rows[1:]]
