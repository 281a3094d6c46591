"""A laboratory's file as sheets of cells, by its content: text in any encoding, a workbook, HTML."""

from __future__ import annotations

import math
import zipfile
from datetime import date, datetime, time, timedelta
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import attrs

from ..errors import InputError
from ..reading import file_bytes, require_rows, unreadable
from ..table_cells.dialect import Row, rows_of
from ..table_cells.encoding import decoded
from .columns import known_words
from .labview import is_labview, rows_of_labview

# Bytes that a file may have, and that a workbook, which is a ZIP archive, may unpack to.
_LONGEST, _MOST_UNPACKED = 1 << 26, 1 << 28
# What workbooks begin with: a ZIP archive (.xlsx, .xlsm, .xlsb, .ods), and Excel's older format (.xls).
_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")


@attrs.frozen
class Sheet:
    """Rows of a file, or of one sheet of a workbook (name "").

    delimiter: between the cells of a text; usual: the decimal sign of ambiguous cells; forced: the sign in
    any case; "" for neither.
    """

    name: str
    rows: tuple[Row, ...]
    delimiter: str = ""
    usual: str = ""
    forced: str = ""


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
    if data.startswith(_WORKBOOKS):
        return _workbook(path, data)
    text = decoded(data, str(path), known_words)
    require_rows(text.count("\n"), str(path))
    return (sheet_of_text(text, decimal, str(path)),)


def sheet_of_text(text: str, decimal: str | None = None, where: str = "") -> Sheet:
    """Sheet of a text, or of the tables in HTML; raises InputError for HTML without one."""
    if not is_markup(text):
        rows, delimiter = rows_of(text)
        # A comma between columns is not a decimal sign but in quotes.
        usual = "." if delimiter == "," and '"' not in text else ""
        if is_labview(rows):
            rows = rows_of_labview(rows)
        return Sheet("", rows, delimiter, usual, decimal or "")
    cells = rows_of_markup(text)
    if not cells:
        raise InputError(
            "the file is HTML or XML without a table", where, "export the table as CSV or a workbook"
        )
    rows = tuple(Row(n, tuple(" ".join(cell.split()) for cell in row)) for n, row in enumerate(cells, 1))
    return Sheet("", rows, "", "", decimal or "")


def _workbook(path: Path, data: bytes) -> tuple[Sheet, ...]:
    """Every sheet that is not empty; numbers as text with a decimal point."""
    import io

    from python_calamine import CalamineError, CalamineWorkbook

    _require_small(path, data)
    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        sheets = []
        for name in book.sheet_names:
            cells = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
            require_rows(len(cells), f"{path}, sheet {name!r}")
            rows = tuple(Row(i, tuple(_text(cell) for cell in row)) for i, row in enumerate(cells, 1))
            if any(row.filled for row in rows):
                sheets.append(Sheet(name, rows, usual="."))
    except (CalamineError, ValueError, OSError) as error:
        raise InputError(
            f"the workbook cannot be read: {str(error)[:200]}",
            str(path),
            "open it in a spreadsheet program and save it as .xlsx or CSV",
        ) from error
    return tuple(sheets)


def _require_small(path: Path, data: bytes) -> None:
    """Raise InputError for a workbook that unpacks to more than the limit."""
    if not data.startswith(b"PK"):
        return
    import io

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except zipfile.BadZipFile as error:
        raise InputError(
            "the workbook is cut off, or is not a workbook", str(path), "export it again, or save it as CSV"
        ) from error
    if unpacked > _MOST_UNPACKED:
        raise InputError(
            f"the workbook unpacks to {unpacked / 1e6:.0f} MB, more than the "
            f"{_MOST_UNPACKED / 1e6:.0f} MB that are read",
            str(path),
            "save the sheets with the measured data as CSV",
        )


def _text(cell: Any) -> str:
    """A cell as text."""
    if isinstance(cell, bool):
        return str(cell)
    if isinstance(cell, float | int):
        return "" if isinstance(cell, float) and not math.isfinite(cell) else repr(cell).removesuffix(".0")
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, datetime | date | time):
        return cell.isoformat()
    return " ".join(str(cell).split("\n")).strip()


_ROWS, _CELLS, _TABLES = ("tr", "row", "ss:row"), ("td", "th", "cell", "ss:cell"), ("table", "worksheet")


def is_markup(text: str) -> bool:
    """Return True if a text is HTML, or XML of a spreadsheet."""
    head = text[:2000].lstrip("\ufeff \r\n\t").casefold()
    return head.startswith(("<html", "<!doctype html", "<table", "<?xml", "<meta", "<head", "<style"))


def rows_of_markup(text: str) -> list[list[str]]:
    """Rows of all its tables as cells, in order; empty without a table."""
    reader = _Reader()
    reader.feed(text)
    reader.close()
    return reader.rows


class _Reader(HTMLParser):
    """Collects cells; an unclosed one ends with the next."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.rows: list[list[str]] = []
        self.within = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Start a row or a cell, at its named position and with its span."""
        if tag in _ROWS or (tag in _TABLES and self.rows):
            self.rows.append([])
            self.within = False
        elif tag in _CELLS and self.rows:
            given = {name.rpartition(":")[2]: value for name, value in attrs}
            at = given.get("index") or ""
            if at.isdigit() and len(self.rows[-1]) < int(at) - 1 < 1000:
                self.rows[-1] += [""] * (int(at) - 1 - len(self.rows[-1]))
            span = given.get("colspan") or "1"
            self.rows[-1] += [""] * (min(int(span), 1000) if span.isdigit() and int(span) > 1 else 1)
            self.at = len(self.rows[-1]) - (int(span) if span.isdigit() and 1 < int(span) <= 1000 else 1)
            self.within = True
        elif tag == "br" and self.within:
            self.rows[-1][self.at] += " "

    def handle_endtag(self, tag: str) -> None:
        """End a cell."""
        if tag in _CELLS:
            self.within = False

    def handle_data(self, data: str) -> None:
        """Add text to a cell."""
        if self.within:
            self.rows[-1][self.at] = f"{self.rows[-1][self.at]}{data}".strip("\r\n\t")
