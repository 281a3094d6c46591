"""Workbooks: .xlsx, .xlsm, .xlsb, .ods and Excel's older .xls."""

from __future__ import annotations

import io
import math
import re
import zipfile
import zlib
from datetime import date, datetime, time, timedelta
from html import unescape
from pathlib import Path
from typing import Any

from ...errors import InputError
from ...reading import require_rows
from ...table_cells.dialect import Row
from ..sheet import Content, Sheet

# Bytes that a workbook, which is a ZIP archive, may unpack to.
_MOST_UNPACKED = 1 << 28
# What workbooks begin with: a ZIP archive, and Excel's older format.
_BEGINNINGS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
# A cell with a formula and no value behind it.
_FORMULA = re.compile(r"<c( [^>]*)><f[^>]*?(?:/>|>([^<]*)</f>)(?:<v\s*/>|<v></v>)?</c>")


def read(content: Content) -> tuple[Sheet, ...] | None:
    """Every sheet that is not empty; numbers as text with a decimal point, formulas without value as text."""
    path, data = content.path, content.data
    if not data.startswith(_BEGINNINGS):
        return None
    from python_calamine import CalamineError, CalamineWorkbook

    _require_small(path, data)
    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        formulas = _formulas_without_value(data)
        sheets = []
        for name in book.sheet_names:
            cells = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
            require_rows(len(cells), f"{path}, sheet {name!r}")
            for (i, k), formula in formulas.get(name, {}).items():
                if i < len(cells) and k < len(cells[i]) and cells[i][k] in ("", 0):
                    cells[i][k] = formula
            rows = tuple(Row(i, tuple(_text(cell) for cell in row)) for i, row in enumerate(cells, 1))
            if any(row.filled for row in rows):
                sheets.append(Sheet(name, rows, usual="."))
    except (CalamineError, ValueError, OSError, zipfile.BadZipFile, zlib.error) as error:
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


def _formulas_without_value(data: bytes) -> dict[str, dict[tuple[int, int], str]]:
    """Formulas by row and column of each sheet's name whose values the file (.xlsx) does not hold."""
    found: dict[str, dict[tuple[int, int], str]] = {}
    if not data.startswith(b"PK"):
        return found
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        names = set(archive.namelist())
        if not {"xl/workbook.xml", "xl/_rels/workbook.xml.rels"} <= names:
            return found
        links = {
            _attribute(tag, "Id"): _attribute(tag, "Target").removeprefix("/xl/")
            for tag in re.findall(r"<Relationship .*?>", archive.read("xl/_rels/workbook.xml.rels").decode())
        }
        for tag in re.findall(r"<sheet .*?>", archive.read("xl/workbook.xml").decode()):
            file = f"xl/{links.get(_attribute(tag, 'r:id'), '')}"
            text = archive.read(file).decode() if file in names else ""
            if "<f" in text:
                found[unescape(_attribute(tag, "name"))] = {
                    _place(_attribute(cell[1], "r")): "=" + unescape(cell[2] or "")
                    for cell in _FORMULA.finditer(text)
                }
    return found


def _attribute(tag: str, name: str) -> str:
    match = re.search(rf'\s{name}="([^"]*)"', tag)
    return match[1] if match else ""


def _place(reference: str) -> tuple[int, int]:
    """Row and column from 0 of a cell such as B12."""
    letters = reference.rstrip("0123456789")
    column = 0
    for letter in letters:
        column = 26 * column + ord(letter) - 64
    return int(reference[len(letters) :] or 1) - 1, column - 1


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
