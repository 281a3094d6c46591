"""Sheet of a printer's limits: written with test parts, read back with their results."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from ...design.printing.limit_parts import LimitPart
from ...design.printing.printer import MEANING, Limit
from ...errors import InputError
from .sheet import sheet_rows, sheet_text

COLUMNS = ("limit", "meaning", "best", "sizes", "measured")
# Between the sizes of a row.
_BETWEEN = " "


def limit_sheet(parts: Sequence[LimitPart]) -> str:
    """The sheet of some parts as CSV text, its last column to be filled in."""
    return sheet_text(
        COLUMNS,
        [(p.limit, MEANING[p.limit], p.best, _BETWEEN.join(f"{size:g}" for size in p.sizes)) for p in parts],
    )


def measured_limits(path: Path) -> dict[str, Limit]:
    """The limits that a filled sheet gives, by name and in their units; empty rows give none.

    Raises InputError, also where no row is filled in.
    """
    found: dict[str, Limit] = {}
    for where, row in sheet_rows(path, "give limits.csv of `specimens`"):
        name, written = row.get("limit") or "", (row.get("measured") or "").strip()
        if name not in MEANING:
            raise InputError(
                f"there is no limit {name!r}", where, "the limits are those of limits.csv of `specimens`"
            )
        if name in found:
            raise InputError(f"{name} is given twice", where, "leave one of the rows out")
        if written:
            found[name] = Limit(_measured(row, name, written, where), f"measured, {path.name}", False, True)
    if not found:
        raise InputError("no limit was measured", str(path), "fill in the last column, or leave --limits out")
    return found


def _measured(row: dict[str, str], name: str, written: str, where: str) -> float:
    """Number in a row, within the sizes of its part."""
    numbers = []
    for text in (written, *(row.get("sizes") or "").split(_BETWEEN)):
        try:
            numbers.append(float(text))
        except ValueError:
            numbers.append(math.nan)
    value, *sizes = numbers
    if not (sizes and all(0.0 < size < math.inf for size in sizes)):
        raise InputError(f"{name} has no sizes", where, "keep the column `sizes` as `specimens` wrote it")
    if not min(sizes) <= value <= max(sizes):
        raise InputError(
            f"{name} measured as {written!r}; the part has {min(sizes):g} to {max(sizes):g}",
            where,
            "give a size of the part, or leave the cell empty; where none was made, print the parts of a "
            "printer file with another limit",
        )
    return value
