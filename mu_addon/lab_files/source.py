"""A laboratory's file as sheets of cells, in the first of the formats that its content has."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from ..reading import file_bytes, unreadable
from .formats import FORMATS
from .sheet import Content, Sheet

# Bytes that a file may have.
_LONGEST = 1 << 26


def read_sheets(path: Path, decimal: str | None = None) -> tuple[Sheet, ...]:
    """Sheets of a workbook, or the one of a text file; raises InputError with the remedy.

    decimal: the decimal sign of a text, "." or ",", where it is known.
    """
    try:
        data = file_bytes(path, _LONGEST)
    except OSError as error:
        raise InputError(
            f"cannot read the file: {unreadable(error)}", str(path), "check path and file"
        ) from error
    if not data.strip():
        raise InputError("the file is empty", str(path), "export it again")
    return _sheets(Content(path, data, decimal or ""))


def sheet_of_text(text: str, decimal: str | None = None, where: str = "") -> Sheet:
    """Sheet of a text, or of the tables in HTML; raises InputError for HTML without one."""
    return _sheets(Content(Path(where), text.encode("utf-8", "surrogatepass"), decimal or ""))[0]


def _sheets(content: Content) -> tuple[Sheet, ...]:
    return next(sheets for read in FORMATS if (sheets := read(content)) is not None)
