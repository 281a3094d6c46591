"""A CSV file of one experiment: numbers by column; problems are reported with their row."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError, did_you_mean
from ..reading import require_rows
from ..table_cells.own_tables import own_lines, own_rows
from .kinds import STEADY, Kind, markers, may_be_missing, named, quantity_of, units_of

# Of a reading in any unit that is read; loggers write the largest number they have where there is none.
LARGEST = 1e15
# A text of more characters is read as numbers alone, if it holds nothing else, in so many rows at most: a
# hundred times as fast and in a tenth of the memory.
LONG, MOST_PLAIN = 1 << 20, 4_000_000
_PLAIN = re.compile(r"[-+0-9.eE, \n]*")
# A gap is an interval this many times as long as the usual one.
GAP = 5.0
# A spike leaves its neighbours' line by this many times the usual scatter about such lines, and by this
# share of the column's whole range.
SPIKE_SCATTER, SPIKE_RANGE = 10.0, 0.02
# Rows on either side of a jump by which its factor is told, fewer beside a corner; logarithms within which it
# is a unit's.
BESIDE, EXACT, UNSURE = (12, 9, 6), 0.01, 0.08


@attrs.frozen
class Remark:
    """An unusual feature of usable data: what, where, and what to do."""

    what: str
    where: str
    remedy: str


class Remarks(list[Remark]):
    """Remarks on data."""

    def add(self, what: str, where: str, remedy: str) -> None:
        """Add one; see `Remark`."""
        self.append(Remark(what, where, remedy))


@attrs.frozen(eq=False)
class Table:
    """Columns (n,) by name, in the units of their names; rows (n,): line in the file of each row; remarks."""

    columns: dict[str, Array]
    rows: Array
    remarks: tuple[Remark, ...]


def read_table(text: str, kind: Kind, path: Path) -> Table:
    """Read CSV text as an experiment of this kind; values are converted to the units that are read.

    Rows are numbered as an editor counts lines; lines that begin with # are comments. Rows that repeat the
    one before are left out of timed data. path: for messages. Raises InputError for a table that cannot be
    used.
    """
    remarks = Remarks()
    plain = _plain_numbers(text) if len(text) > LONG else None
    if plain is not None:
        header, rows, values = plain
        _check_names(header, int(rows[0]) - 1, path)
    else:
        header, body = _lines(text, path)
        rows = np.array([number for number, _ in body])
    kept = _header(header, kind, path, remarks)
    if len(rows) < kind.fewest:
        raise InputError(
            f"{len(rows)} rows of numbers, and {kind.name} needs at least {kind.fewest}",
            _at(path),
            "record more, or leave this experiment out",
        )
    columns = {
        name: factor
        * (values[:, i] if plain is not None else _numbers(body, i, header[i], len(header), path))
        for i, (name, factor) in kept.items()
    }
    columns, rows = _without_repeats(columns, rows, path, remarks)
    if "time_s" in columns:
        _check_time(columns["time_s"], rows, path, remarks)
    for name, values in columns.items():
        _check_missing(name, values, rows, path, remarks)
        if name not in ("time_s", "added_mass_g"):
            _check_spikes(name, values, columns.get("time_s"), rows, path, remarks)
    for name in STEADY.get(kind.name, ()):
        if name in columns:
            _check_switched(name, columns, rows, path)
    return Table(columns, rows, tuple(remarks))


def _at(path: Path, row: int | None = None, column: str = "") -> str:
    parts = [str(path), f"row {row}" if row is not None else "", f"column {column}" if column else ""]
    return ", ".join(part for part in parts if part)


def _lines(text: str, path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Cells of the header, and of every further line with its number."""
    numbered = own_lines(text)
    require_rows(len(numbered) - 1, _at(path))
    try:
        found = own_rows(numbered)
    except csv.Error as error:
        raise InputError(f"not CSV: {error}", _at(path), "separate columns by commas") from None
    if not found:
        raise InputError("the file contains no table", _at(path), "the first line must hold the column names")
    row, header = found[0]
    _check_names(header, row, path)
    return header, found[1:]


def _plain_numbers(text: str) -> tuple[list[str], Array, Array] | None:
    """Names (c,), line numbers (n,) and numbers (n, c) of a long table of plain numbers; else None.

    Tables with empty cells, quotes, comments between rows or numbers beyond `LARGEST` are read cell by cell,
    so that a fault is reported with its place.
    """
    above = 0
    while text.startswith(("#", "\n"), above):
        above = text.find("\n", above) + 1
        if not above:
            return None
    end = text.find("\n", above)
    if end < 0 or not _PLAIN.fullmatch(text, end):
        return None
    header = [cell.strip() for cell in text[above:end].split(",")]
    body = text[end + 1 :].rstrip("\n")
    count = body.count("\n") + 1
    if count > MOST_PLAIN or '"' in text[above:end] or "\n\n" in body or body.startswith("\n"):
        return None
    try:
        values = np.loadtxt(io.BytesIO(body.encode("ascii")), delimiter=",", ndmin=2, encoding="ascii")
    except ValueError:
        return None
    if values.shape != (count, len(header)) or not (np.abs(values) <= LARGEST).all():
        return None
    first = text.count("\n", 0, end) + 2
    return header, np.arange(first, first + count), values


def _check_names(header: Sequence[str], row: int, path: Path) -> None:
    """Raise InputError for a first line, at a row of the file, that does not name columns."""
    if all(_is_number(cell) for cell in header):
        raise InputError(
            "the first line holds numbers instead of the columns' names",
            _at(path, row),
            "name the columns with their units, such as time_s,pressure_kPa",
        )
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"column {name!r} occurs {header.count(name)} times", _at(path, row), "keep one")


def _header(header: Sequence[str], kind: Kind, path: Path, remarks: Remarks) -> dict[int, tuple[str, float]]:
    """Columns that are read and their factors, by position."""
    known = ", ".join(kind.columns) + (", marker1_x_mm, marker1_y_mm, ..." if kind.marked else "")
    kept: dict[int, tuple[str, float]] = {}
    for i, name in enumerate(header):
        if kind.knows(name):
            kept[i] = name, 1.0
            continue
        quantity = quantity_of(name)
        if quantity is not None and kind.knows(wanted := named(quantity[0])):
            units = units_of(quantity[0])
            if quantity[1] in units:
                kept[i] = wanted, units[quantity[1]]
                continue
            unit, *others = units
            unit_text = f"in {quantity[1]!r}" if quantity[1] else "without a unit"
            raise InputError(
                f"column {name!r} is {unit_text}; it is read "
                + (f"in {unit}" if unit else "as a bare number"),
                _at(path, None, name),
                f"name it {wanted}, or end its name with {' or '.join(others)}, in which it is read as well",
            )
        hint = did_you_mean(name, kind.columns, 0.75)
        if hint:
            raise InputError(f"unknown column {name!r}{hint}", _at(path), f"known here: {known}")
        remarks.add(f"column {name!r} is not known and was not read", _at(path), f"known here: {known}")
    names = [name for name, _ in kept.values()]
    for name in names:
        if names.count(name) > 1:
            twice = " and ".join(header[i] for i, (other, _) in kept.items() if other == name)
            raise InputError(f"{twice} are the same column in two units", _at(path), "keep one")
    if kind.timed and "time_s" not in names:
        raise InputError("column time_s is missing", _at(path), f"{kind.name} needs the time of every row")
    for number, axes in markers(names).items():
        # A camera that looks along x does not see it.
        if not {"y", "z"} <= axes:
            gone = ", ".join(f"marker{number}_{a}_mm" for a in "yz" if a not in axes)
            raise InputError(f"marker {number} lacks {gone}", _at(path), "give y and z, and x if measured")
    _check_needs(names, kind, path)
    return kept


def _check_needs(names: Sequence[str], kind: Kind, path: Path) -> None:
    have = set(names)
    if kind.marked and markers(names):
        # Any marker will do.
        have |= {f"marker1_{a}_mm" for a in "yz"}
    if any(have.issuperset(group) for group in kind.needs):
        return
    nearest = max(kind.needs, key=lambda group: len(have & set(group)) / len(group))
    missing = [column for column in nearest if column not in have]
    ways = " or ".join(", ".join(group) for group in kind.needs)
    raise InputError(
        f"column {' and '.join(missing)} is missing"
        if len(missing) == 1
        else f"columns {', '.join(missing)} are missing",
        _at(path),
        f"{kind.name} needs {ways}",
    )


def _numbers(body: Sequence[tuple[int, list[str]]], place: int, name: str, width: int, path: Path) -> Array:
    values = np.empty(len(body))
    for i, (row, cells) in enumerate(body):
        if len(cells) != width:
            remedy = "write decimals with a point" if len(cells) > width else "fill every column"
            raise InputError(f"{len(cells)} values under {width} columns", _at(path, row), remedy)
        cell = cells[place]
        if cell == "" or cell.lower() == "nan":
            values[i] = np.nan
        elif _is_number(cell):
            values[i] = float(cell)
            if abs(values[i]) > LARGEST:
                raise InputError(
                    f"{cell} is not a reading",
                    _at(path, row, name),
                    "correct it, or leave the cell empty if there is no reading",
                )
        else:
            raise InputError(
                f"{cell!r} is not a number", _at(path, row, name), "correct it, or leave the row out"
            )
    return values


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell)) and "_" not in cell
    except ValueError:
        return False


def _without_repeats(
    columns: dict[str, Array], rows: Array, path: Path, remarks: Remarks
) -> tuple[dict[str, Array], Array]:
    """Rows of a timed record less those that repeat the row before to the last digit."""
    if "time_s" not in columns or len(rows) < 2:
        return columns, rows
    table = np.stack(list(columns.values()), axis=1)
    same = ((table[1:] == table[:-1]) | (np.isnan(table[1:]) & np.isnan(table[:-1]))).all(axis=1)
    if not same.any():
        return columns, rows
    first = rows[1:][same][0]
    remarks.add(
        f"{same.sum()} rows repeat the row before and were left out",
        _at(path, int(first)),
        "check the data logger",
    )
    keep = np.concatenate([[True], ~same])
    return {name: values[keep] for name, values in columns.items()}, rows[keep]


def _check_time(time: Array, rows: Array, path: Path, remarks: Remarks) -> None:
    bad = np.flatnonzero(np.isnan(time))
    if len(bad):
        raise InputError(
            "time_s is missing", _at(path, rows[bad[0]], "time_s"), "give it, or leave the row out"
        )
    step = np.diff(time)
    bad = np.flatnonzero(step <= 0)
    if len(bad):
        i = bad[0]
        what = "stands still" if step[i] == 0 else "runs backward"
        raise InputError(
            f"time {what}, from {time[i]:g} to {time[i + 1]:g} s",
            _at(path, rows[i + 1], "time_s"),
            "sort the rows by time; give two recordings as two experiments",
        )
    usual = np.median(step)
    gaps = np.flatnonzero(step > GAP * usual)
    if len(gaps):
        i = gaps[np.argmax(step[gaps])]
        remarks.add(
            f"{len(gaps)} gap{'s' if len(gaps) > 1 else ''} in time; the longest lasts {step[i]:.4g} s, "
            f"where {usual:.4g} s is usual",
            _at(path, int(rows[i + 1])),
            "rates and lags across the gap are not evaluated",
        )


def _check_missing(name: str, values: Array, rows: Array, path: Path, remarks: Remarks) -> None:
    bad = np.flatnonzero(np.isnan(values))
    if not len(bad):
        return
    if not may_be_missing(name) or len(bad) == len(values):
        raise InputError(f"{name} is missing", _at(path, rows[bad[0]], name), "give it, or leave the row out")
    remarks.add(
        f"{len(bad)} of {len(values)} values of {name} are missing",
        _at(path, int(rows[bad[0]]), name),
        "these rows are not used for this column",
    )


def _check_spikes(
    name: str, values: Array, time: Array | None, rows: Array, path: Path, remarks: Remarks
) -> None:
    """Remark on single values that differ from both neighbours, unlike a corner or a step.

    d is the distance from the line through the neighbours; a lone spike of height h shows as d = h with
    -h/2 on either side.
    """
    seen = np.flatnonzero(np.isfinite(values))
    if len(seen) < 8:
        return
    x = values[seen]
    t = np.arange(len(x), dtype=float) if time is None else time[seen]
    share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
    d = np.zeros(len(x))
    d[1:-1] = x[1:-1] - (x[:-2] + share * (x[2:] - x[:-2]))
    scatter = 1.4826 * np.median(np.abs(d[1:-1]))
    least = max(SPIKE_SCATTER * scatter, SPIKE_RANGE * float(np.ptp(x)))
    i = np.arange(2, len(x) - 2)
    opposite = (d[i] * d[i - 1] < 0) & (d[i] * d[i + 1] < 0)
    beside = np.minimum(np.abs(d[i - 1]), np.abs(d[i + 1]))
    found = i[(np.abs(d[i]) > least) & opposite & (beside > 0.25 * np.abs(d[i]))]
    # Of a spike and the two echoes beside it only the largest is one.
    found = [k for k in found if np.abs(d[k]) >= np.abs(d[k - 1 : k + 2]).max()]
    if found:
        worst = max(found, key=lambda k: abs(d[k]))
        stand = "1 value lies" if len(found) == 1 else f"{len(found)} values lie"
        remarks.add(
            f"{stand} apart from both neighbours, the worst ({x[worst]:.6g}) by {abs(d[worst]):.4g}",
            _at(path, int(rows[seen[worst]]), name),
            "check it: an outlier that is not a reading should be removed",
        )


def _check_switched(name: str, columns: dict[str, Array], rows: Array, path: Path) -> None:
    """Raise InputError where one column alone jumps by the factor between two units.

    The factor is that of the lines through `BESIDE` rows on either side of the column's largest jump.
    """
    x = columns[name]
    i = int(np.argmax(np.abs(np.diff(x)))) if len(x) > 2 * max(BESIDE) else 0
    steps = [np.abs(np.diff(columns[c])) for c in ("time_s", "strain", "displacement_mm") if c in columns]
    if any(i >= len(d) - 1 or d[i] > 1.5 * np.delete(d, i).max() for d in steps):
        return
    t = columns.get("time_s", np.arange(len(x), dtype=float))
    ends, unsure = [], EXACT
    for y, s in ((x[i::-1], t[i::-1]), (x[i + 1 :], t[i + 1 :])):
        found = _at_its_end(y, s - t[i + 1])
        if found is None or found[0] == 0.0:
            return
        ends.append(found[0])
        unsure += 2.0 * abs(found[1] / found[0])
    quantity, unit = quantity_of(name) or ("", "")
    if unsure > UNSURE or ends[0] * ends[1] < 0.0:
        return
    ratio = ends[1] / ends[0]
    for other, factor in units_of(quantity).items():
        for before, after, expected in ((unit, other, 1.0 / factor), (other, unit, factor)):
            if factor != 1.0 and abs(math.log(ratio / expected)) < unsure:
                raise InputError(
                    f"{name} is {ratio:.3g} times as large from this row on, as if the unit changed from "
                    f"{before} to {after}",
                    _at(path, int(rows[i + 1]), name),
                    f"bring all rows to {unit}, or leave out those on one side",
                )


def _at_its_end(values: Array, time: Array) -> tuple[float, float] | None:
    """Value at time 0 of the line through the first rows of a column, and its standard deviation.

    Of as many as lie on a line, within their scatter or half of `EXACT`; None without.
    """
    if len(values) < min(BESIDE):
        return None
    scatter = 1.4826 * float(np.median(np.abs(np.diff(values, 2)))) / math.sqrt(6.0)
    for rows in (n for n in BESIDE if n <= len(values)):
        line = np.polyfit(time[:rows], values[:rows], 1)
        off = float(np.std(values[:rows] - np.polyval(line, time[:rows]), ddof=2))
        if off < max(2.0 * scatter, 0.5 * EXACT * abs(line[1])):
            # At the end of a line its variance is 4 over their number.
            return float(line[1]), 2.0 * max(off, scatter) / math.sqrt(rows)
    return None
