"""Measurement files of LabVIEW (.lvm): headers within the file, times perhaps by their step alone."""

from __future__ import annotations

from collections.abc import Sequence

import attrs

from ...table_cells.dialect import Row
from ...table_cells.notation import number
from ..columns import column
from ..sheet import Content, Sheet
from ..units import is_unit
from . import text_table

TEXT = 1
_MAGIC, _TITLES = "LabVIEW Measurement", "X_Value"


def read(content: Content) -> tuple[Sheet, ...] | None:
    """The one sheet of a measurement file of LabVIEW."""
    if not content.text.startswith(_MAGIC):
        return None
    (sheet,) = text_table.read(content)
    return (attrs.evolve(sheet, rows=_with_times(sheet.rows)),)


def _with_times(rows: Sequence[Row]) -> tuple[Row, ...]:
    """The rows with headers as lines of text, units in the titles, and a time in each row."""
    found: list[Row] = []
    header: dict[str, tuple[str, ...]] = {}
    count = -1
    for row in rows:
        if row.cells[:1] == (_TITLES,):
            count = 0
            found.append(attrs.evolve(row, cells=_titles(row.cells, header)))
        elif row.cells and not row.cells[0] and row.numeric and count >= 0:
            time, computed = _time(header, count)
            found.append(attrs.evolve(row, cells=(time, *row.cells[1:]), computed=computed))
            count += 1
        elif row.numeric and not row.cells[0][:1].isalpha() and count >= 0:
            found.append(row)
        else:
            # A segment has a header of its own.
            count = -1
            if row.filled:
                header[row.cells[0]] = row.cells[1:]
            found.append(attrs.evolve(row, cells=(" ".join(row.filled),) if row.filled else ()))
    return tuple(found)


def _titles(cells: Sequence[str], header: dict[str, tuple[str, ...]]) -> tuple[str, ...]:
    """Titles, with units from the header where they lack one."""
    units, dimensions = header.get("Y_Unit_Label", ()), header.get("X_Dimension", ())
    named = []
    for k, title in enumerate(cells):
        unit = units[k - 1] if 0 < k <= len(units) else ""
        if title == _TITLES:
            unit = "s" if dimensions[k : k + 1] == ("Time",) else ""
        named.append(f"{title} [{unit}]" if is_unit(unit) and column(title).factor is None else title)
    return tuple(named)


def _time(header: dict[str, tuple[str, ...]], count: int) -> tuple[str, str]:
    """Time of a row by the beginning and step of its segment, and how; "" where these are not numbers."""
    decimal = (header.get("Decimal_Separator") or (".",))[0]
    texts = [(header.get(key) or ("",))[0] for key in ("X0", "Delta_X")]
    begin, step = (number(text, decimal) for text in texts)
    if begin is None or step is None:
        return "", ""
    time = f"{begin + count * step:.12g}".replace(".", decimal)
    return time, f"computed from X0 = {begin:g} and Delta_X = {step:g}, as no row has it"
