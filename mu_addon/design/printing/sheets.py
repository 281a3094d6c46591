"""Sheets filled in at the bench, CSV with an empty last column: the gauge's sizes and a printer's limits.

The print offset comes from the gauge's sheet or the unit's [print].
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from ...errors import InputError
from ...reading import text_in
from ...table_cells.own_tables import own_lines, own_rows, own_text
from ..coupons import FEATURES, offsets
from ..parameters import Unit
from .limit_parts import LimitPart
from .printer import MEANING, Limit

GAUGE_COLUMNS = ("feature", "kind", "axis", "nominal_mm", "measured_mm")
LIMIT_COLUMNS = ("limit", "meaning", "best", "sizes", "measured")
# Between the sizes of a row.
_BETWEEN = " "
# Bytes of a filled sheet: a hundred times as many as the empty ones have.
_LONGEST = 1 << 17


def _sheet_text(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """An empty sheet as CSV text: its rows without the last column's cell, which is to be filled in."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([*row, ""] for row in rows)
    return text.getvalue()


def _sheet_rows(path: Path, remedy: str) -> list[tuple[str, dict[str, str]]]:
    """Rows of a filled sheet, each with its location; raises InputError with the remedy."""
    try:
        rows = own_rows(own_lines(text_in(path, "sheet", remedy, _LONGEST, own_text)))
    except csv.Error as error:
        raise InputError(f"cannot read the sheet: {error}", str(path), remedy) from error
    names = rows[0][1] if rows else []
    return [(f"{path}, line {number}", dict(zip(names, cells, strict=False))) for number, cells in rows[1:]]


def gauge_sheet() -> str:
    """The gauge's sheet as CSV text, its last column to be filled in."""
    return _sheet_text(GAUGE_COLUMNS, [(f.name, f.kind, f.axis, f"{f.nominal_mm:g}") for f in FEATURES])


def read_sheet(path: Path) -> dict[str, tuple[float, float, float]]:
    """Offset, its standard error and scale, for "xy" and "z", of a filled sheet; raises InputError."""
    known = {feature.name: feature for feature in FEATURES}
    chosen, sizes = [], []
    for where, row in _sheet_rows(path, "give the gauge's CSV file"):
        name, value = row.get("feature") or "", (row.get("measured_mm") or "").strip()
        if name not in known:
            raise InputError(
                f"the gauge has no feature {name!r}",
                where,
                "the features are those of `specimens`",
            )
        if not value:
            continue
        try:
            size = float(value)
        except ValueError:
            size = math.nan
        if not 0.0 < size < 3.0 * known[name].nominal_mm:
            raise InputError(
                f"{name} measured as {value!r}, nominal {known[name].nominal_mm:g} mm",
                where,
                "give millimetres, or leave it empty",
            )
        chosen.append(known[name])
        sizes.append(size)
    found = offsets(chosen, sizes)
    if set(found) != {"xy", "z"}:
        raise InputError(
            f"{len(chosen)} sizes were measured, which is too few in {'z' if 'xy' in found else 'the plane'}",
            str(path),
            "measure at least three along x and y, and three along z",
        )
    return found


def compensation_offsets(unit: Unit, source: str | None) -> tuple[tuple[float, float], str]:
    """Offsets in mm, in the plane and along z, to subtract from a drawing, and their source.

    source: None for no compensation, "unit" for the unit's [print], else the gauge's filled sheet. Raises
    InputError.
    """
    if source is None:
        return (0.0, 0.0), ""
    if source == "unit":
        found = unit.print.offset_xy_mm, unit.print.offset_z_mm
        if not any(found):
            raise InputError(
                "the unit's [print] has no print offset to compensate",
                "--compensate",
                "give a --model with overcure, or the filled CSV sheet of the gauge",
            )
        return found, "the unit's [print]"
    of = read_sheet(Path(source))
    (xy, xy_error, _), (z, z_error, _) = of["xy"], of["z"]
    return (
        round(xy, 4),
        round(z, 4),
    ), f"{Path(source).name}: {xy:.3f} +- {xy_error:.3f} in the plane, {z:.3f} +- {z_error:.3f} along z"


def limit_sheet(parts: Sequence[LimitPart]) -> str:
    """The sheet of some parts as CSV text, its last column to be filled in."""
    return _sheet_text(
        LIMIT_COLUMNS,
        [(p.limit, MEANING[p.limit], p.best, _BETWEEN.join(f"{size:g}" for size in p.sizes)) for p in parts],
    )


def measured_limits(path: Path) -> dict[str, Limit]:
    """The limits in a filled sheet, by name and in their units; empty rows are left out.

    Raises InputError, also where no row is filled in.
    """
    found: dict[str, Limit] = {}
    for where, row in _sheet_rows(path, "give limits.csv of `specimens`"):
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
