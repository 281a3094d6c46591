"""A file of a laboratory as sheets of cells: text in the usual encodings, or a workbook."""

from __future__ import annotations

import math
import zipfile
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..reading import file_bytes, require_rows, unreadable
from .cells import Row, Sheet, rows_of_text

# Bytes that a file may have, and that a workbook, which is a ZIP archive, may unpack to.
_LONGEST, _MOST_UNPACKED = 1 << 26, 1 << 28
WORKBOOKS = (".xlsx", ".xlsm", ".xls", ".xlsb", ".ods")


def read_sheets(path: Path, decimal: str | None = None) -> tuple[Sheet, ...]:
    """The sheets of a workbook, or the one of a text file; raises InputError with what to do.

    decimal: the decimal sign of a text, "." or ",", where it is known.
    """
    try:
        data = file_bytes(path, _LONGEST)
    except OSError as error:
        raise InputError(
            f"cannot read the file: {unreadable(error)}", str(path), "check path and file"
        ) from error
    if path.suffix.lower() in WORKBOOKS:
        return _workbook(path, data)
    text = decoded(data, path)
    require_rows(text.count("\n"), str(path))
    return (rows_of_text(text, decimal),)


def decoded(data: bytes, path: Path) -> str:
    """Text of a file: by its byte order mark, as UTF-8, else as Windows-1252 (of which Latin-1 is a part)."""
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            try:
                return data.decode(encoding)
            except UnicodeDecodeError as error:
                raise InputError(
                    f"the file begins like {encoding} and goes on otherwise", str(path), "export it again"
                ) from error
    if b"\0" in data:
        raise InputError(
            "the file holds NUL bytes: it is no text",
            str(path),
            "export it as CSV or text, or give a workbook its ending (.xlsx, .xls, .ods)",
        )
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def _workbook(path: Path, data: bytes) -> tuple[Sheet, ...]:
    """Every sheet with something in it; numbers as text with a decimal point."""
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
                sheets.append(Sheet(name, rows, "."))
    except (CalamineError, ValueError, OSError) as error:
        raise InputError(
            f"the workbook cannot be read: {str(error)[:200]}",
            str(path),
            "open it in a spreadsheet program and save it as .xlsx or CSV",
        ) from error
    return tuple(sheets)


def _require_small(path: Path, data: bytes) -> None:
    """Raise InputError for a workbook that unpacks to more than is read."""
    if not data.startswith(b"PK"):
        return
    import io

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
    except zipfile.BadZipFile as error:
        raise InputError(
            "the workbook is cut off, or is none", str(path), "export it again, or save it as CSV"
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
    return str(cell).strip()
