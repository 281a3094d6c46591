"""Pressure protocols: piecewise linear pressure over time, from CSV."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..measured.kinds import CONVERTED
from ..reading import require_rows, text_in
from ..table_cells.own_tables import own_lines, own_rows, own_text

COLUMNS = ("time_s", "pressure_kPa")
LEAST_KPA, MOST_KPA = -101.325, 1000.0
"""Least gauge pressure of a protocol: vacuum. Largest: twenty times the design pressure of a unit."""
# Far longer than any protocol of a million corner points needs to be, in bytes.
_LONGEST = 1 << 25


@attrs.frozen(eq=False)
class Protocol:
    """A piecewise linear gauge pressure over time: corner points in s and in kPa, (c,) each.

    >>> import numpy as np
    >>> time_s, pressure_kPa = Protocol(np.array([0.0, 2.0]), np.array([0.0, 40.0])).sample(5)
    >>> pressure_kPa.tolist()
    [0.0, 10.0, 20.0, 30.0, 40.0]
    """

    time_s: Array
    pressure_kPa: Array

    def sample(self, count: int) -> tuple[Array, Array]:
        """Time (count,) in s and pressure (count,) in kPa at uniformly spaced instants, ends included."""
        time = np.linspace(self.time_s[0], self.time_s[-1], count)
        # Rounded, so that the same pressure met twice is recognised as one equilibrium.
        return time, np.round(np.interp(time, self.time_s, self.pressure_kPa), 9)

    def under_pressure(self) -> Protocol:
        """This protocol with 0 kPa where it has suction.

        >>> import numpy as np
        >>> found = Protocol(np.array([0.0, 2.0, 8.0]), np.array([0.0, -20.0, 40.0])).under_pressure()
        >>> found.time_s.tolist(), found.pressure_kPa.tolist()
        ([0.0, 2.0, 4.0, 8.0], [0.0, 0.0, 0.0, 40.0])
        """
        time, pressure = self.time_s, self.pressure_kPa
        n = np.flatnonzero(pressure[:-1] * pressure[1:] < 0.0)
        crossed = time[n] - pressure[n] * np.diff(time)[n] / np.diff(pressure)[n]
        every = np.union1d(time, crossed)
        kept = np.maximum(np.interp(every, time, pressure), 0.0)
        kept[np.isin(every, crossed)] = 0.0
        return Protocol(every, kept)


@attrs.frozen
class ProtocolText:
    """A protocol's file: the names of its columns with their line, and every row below them.

    heading, rows: number in the file and text without comment; rows hold their cells, too.
    """

    path: Path
    names: tuple[str, ...]
    heading: tuple[int, str]
    rows: tuple[tuple[int, str, tuple[str, ...]], ...]

    def values(self, names: Sequence[str]) -> Array:
        """Values (c, k) of k columns of numbers, the first of them time.

        Columns in other units, such as pressure_bar, are converted. Raises InputError with file and line if a
        column or value is missing, a value is not finite, a pressure (a column in kPa) is out of range, time
        does not increase, or there are fewer than two rows.
        """
        columns, factors = zip(*map(self._column, names), strict=True)
        found: list[list[float]] = []
        for number, line, cells in self.rows:
            where = f"{self.path}, line {number}: {line}"
            try:
                row = [float(cells[c]) * factor for c, factor in zip(columns, factors, strict=True)]
            except (ValueError, IndexError):
                raise InputError("a value is missing or not a number", where, "give numbers only") from None
            if not np.isfinite(row).all():
                raise InputError("a value is not finite", where, "give finite numbers only")
            for name, value in zip(names, row, strict=True):
                if name.endswith("kPa") and not LEAST_KPA <= value <= MOST_KPA:
                    raise InputError(
                        f"a pressure of {value:g} kPa",
                        where,
                        f"give gauge pressures in kPa, from {LEAST_KPA:g} to {MOST_KPA:g}",
                    )
            if found and row[0] <= found[-1][0]:
                raise InputError("time does not increase", where, "sort the rows and remove repeated times")
            found.append(row)
        if len(found) < 2:
            raise InputError(
                "the protocol has fewer than two rows", str(self.path), "give at least a start and an end"
            )
        return np.array(found)

    def _column(self, name: str) -> tuple[int, float]:
        """Position of a column, and the factor from its unit to that of `name`."""
        quantity, _, unit = name.rpartition("_")
        for other, factor in {unit: 1.0, **CONVERTED[unit]}.items():
            if f"{quantity}_{other}" in self.names:
                return self.names.index(f"{quantity}_{other}"), factor
        number, line = self.heading
        raise InputError(
            f"the protocol lacks the column {name}",
            f"{self.path}, line {number}: {line}",
            f"name it {name}, or with the unit it has: {', '.join(CONVERTED[unit])}",
        )


def read_protocol_text(path: Path, columns: Sequence[str]) -> ProtocolText:
    """Read a protocol's names and rows; `#` begins a comment.

    columns: the names to ask for. Raises InputError where the file is unreadable, too long or empty.
    """
    lines = own_lines(text_in(path, "protocol", "check the path", _LONGEST, own_text))
    numbered = [(n, words) for n, line in lines if (words := line.split("#")[0].strip())]
    require_rows(len(numbered) - 1, str(path))
    if not numbered:
        raise InputError("the protocol is empty", str(path), f"give the columns {', '.join(columns)}")
    try:
        cells = own_rows(numbered)
    except csv.Error as error:
        raise InputError(f"not CSV: {error}", str(path), "separate the columns by commas") from None
    rows = tuple((n, words, tuple(row)) for (n, words), (_, row) in zip(numbered, cells, strict=True))
    return ProtocolText(path, rows[0][2], rows[0][:2], rows[1:])


def read_protocol(path: Path) -> Protocol:
    """Read a protocol: columns time_s and pressure_kPa, or in other units; `#` comments allowed.

    Raises InputError with file and line if the file is unreadable, a value is missing or not finite, a
    pressure is out of range, time does not increase, or the protocol does not start at atmospheric pressure.
    """
    text = read_protocol_text(path, COLUMNS)
    time, pressure = text.values(COLUMNS).T
    if pressure[0] != 0:
        raise InputError(
            "the protocol does not start at 0 kPa",
            f"{path}, line {text.rows[0][0]}",
            "start at atmospheric pressure (gauge 0)",
        )
    return Protocol(time, pressure)
