"""Tables in the rows of a file: blocks of numbers with the titles, units and remarks above them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from .cells import Row, Sheet, is_numeric, number
from .quantities import Column, column, is_unit, plain

Array = np.ndarray[Any, Any]

# A line that names the specimen whose table follows, such as "Specimen 2".
_SPECIMEN = re.compile(
    r"(specimen|sample|probe|probekorper|eprouvette|provino|probeta|probka)\W*[\w.-]{1,20}"
)
# A line of one cell is kept, such as "Compression test", but no prose.
_LONGEST_LINE = 80
# Fewer rows of numbers are a table of results or settings, not a record.
FEWEST = 3
# Rows of titles, units and names of specimens directly above the numbers.
_MOST_TITLE_ROWS = 3


@attrs.frozen(eq=False)
class Block:
    """A table of one record.

    columns: what each holds; values (n, columns) as they stand, nan where one is missing; lines (n,) in the
    file; label: name above its columns, "" without one; facts: what the rows above say, by name in small
    letters: the cells after it, none of a line of one cell; decimal: the sign in these.
    """

    sheet: str
    label: str
    decimal: str
    columns: tuple[Column, ...]
    values: Array
    lines: Array
    facts: dict[str, tuple[str, ...]]


def blocks(sheet: Sheet) -> tuple[Block, ...]:
    """The records of a sheet, in their order; records side by side in one table are divided."""
    found: list[Block] = []
    begin = facts_from = 0
    facts: dict[str, tuple[str, ...]] = {}
    specimen = ""
    rows = sheet.rows
    while begin < len(rows):
        if not is_numeric(rows[begin], sheet.decimal):
            begin += 1
            continue
        end = begin
        while end < len(rows) and is_numeric(rows[end], sheet.decimal):
            end += 1
        if end - begin < FEWEST:
            begin = end
            continue
        above = _titles(rows[facts_from:begin], sheet.decimal)
        remarks_above = rows[facts_from : begin - len(above)]
        facts = facts | _facts(remarks_above)
        specimen = _specimen(remarks_above) or specimen
        new = [
            attrs.evolve(block, label=block.label or specimen)
            for block in _block(sheet, above, rows[begin:end], facts)
        ]
        # A recorder that writes its titles again and again goes on with one record.
        if found and _goes_on(found[-1], new):
            found[-1] = _joined(found[-1], new[0])
        else:
            found += new
        begin = facts_from = end
    return tuple(found)


def _titles(above: Sequence[Row], decimal: str) -> list[Row]:
    """The rows of titles directly above numbers: text in several cells, or a row of units below one."""
    found: list[Row] = []
    for row in reversed(above):
        words = [cell for cell in row.filled if number(cell, decimal) is None or is_unit(cell)]
        units = bool(row.filled) and all(is_unit(cell) for cell in row.filled)
        if len(found) == _MOST_TITLE_ROWS or len(words) < len(row.filled) or len(row.filled) < 2:
            break
        # Titles are one row; what stands above them is a row of specimens' names, with cells left empty.
        if found and not _all_units(found[0]) and not _is_label_row(row, found[0]):
            break
        if units and found:
            break
        found.insert(0, row)
    return found


def _all_units(row: Row) -> bool:
    return all(is_unit(cell) for cell in row.filled)


def _is_label_row(row: Row, titles: Row) -> bool:
    """Whether a row names the specimens of several columns each."""
    return 2 <= len(row.filled) < len(titles.filled) and len(row.cells) > len(row.filled)


def _block(
    sheet: Sheet, titles: Sequence[Row], rows: Sequence[Row], facts: dict[str, tuple[str, ...]]
) -> list[Block]:
    width = max(len(row.cells) for row in rows)
    values = np.full((len(rows), width), np.nan)
    for i, row in enumerate(rows):
        for k, cell in enumerate(row.cells):
            found = number(cell, sheet.decimal)
            values[i, k] = np.nan if found is None else found
    units = next((row for row in titles if _all_units(row)), None)
    named = [row for row in titles if row is not units]
    heads = named[-1].cells if named else ()
    labels = named[-2].cells if len(named) > 1 else ()
    used = [k for k in range(width) if np.isfinite(values[:, k]).any()]
    columns = {k: column(_cell(heads, k), _cell(units.cells if units else (), k)) for k in used}
    lines = np.array([row.line for row in rows])
    parts = []
    for group in _side_by_side(columns):
        chosen = values[:, group]
        keep = np.isfinite(chosen).sum(axis=1) >= min(2, len(group))
        if keep.sum() < FEWEST:
            continue
        label = next((_cell(labels, k) for k in range(group[0], -1, -1) if _cell(labels, k)), "")
        parts.append(
            Block(
                sheet=sheet.name,
                label=label,
                decimal=sheet.decimal,
                columns=tuple(columns[k] for k in group),
                values=chosen[keep],
                lines=lines[keep],
                facts=facts,
            )
        )
    return parts


def _cell(cells: Sequence[str], k: int) -> str:
    return cells[k] if k < len(cells) else ""


def _side_by_side(columns: dict[int, Column]) -> list[list[int]]:
    """Groups of columns, a new one wherever the title of a group's first column comes again."""
    groups: list[list[int]] = []
    for k, one in columns.items():
        first = columns[groups[-1][0]].title if groups else None
        if not groups or (one.title and one.title == first):
            groups.append([])
        groups[-1].append(k)
    return groups


def _facts(rows: Sequence[Row]) -> dict[str, tuple[str, ...]]:
    """What rows above a table say, as in `Thickness;3.0;mm`, `Thickness: 3.0 mm` and `Thickness = 3.0`."""
    found: dict[str, tuple[str, ...]] = {}
    for row in rows:
        cells = list(row.filled)
        if not cells:
            continue
        match = re.match(r"([^:=]{2,60})[:=]\s*(.*)$", cells[0])
        if match:
            cells = [match[1], *([match[2]] if match[2] else []), *cells[1:]]
        if len(cells) == 2:
            # A value with its unit in one cell.
            apart = re.match(r"([+-]?[\d.,]+)\s*([^\d\s].*)$", cells[1])
            if apart:
                cells = [cells[0], apart[1], apart[2]]
        if len(cells) >= 2 or len(cells[0]) <= _LONGEST_LINE:
            found[plain(cells[0]).strip()] = tuple(cells[1:])
    return found


def _specimen(rows: Sequence[Row]) -> str:
    """The name of a specimen that stands on a line of its own, the last one; "" for none."""
    lines = [row.filled[0] for row in rows if len(row.filled) == 1]
    return next((line for line in reversed(lines) if _SPECIMEN.fullmatch(plain(line))), "")


def _goes_on(last: Block, new: Sequence[Block]) -> bool:
    """Whether a table goes on with the record before it: equal columns, and a time that runs on."""
    if len(new) != 1 or [c.title for c in new[0].columns] != [c.title for c in last.columns]:
        return False
    time = next((k for k, c in enumerate(last.columns) if c.quantity == "time"), None)
    return time is not None and bool(new[0].values[0, time] > last.values[-1, time])


def _joined(one: Block, other: Block) -> Block:
    return attrs.evolve(
        one,
        values=np.concatenate([one.values, other.values]),
        lines=np.concatenate([one.lines, other.lines]),
    )
