"""Pressure protocols: piecewise linear pressure over time, from CSV."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from ..reading import file_text, require_rows

Array = np.ndarray[Any, Any]

COLUMNS = ("time_s", "pressure_kPa")
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


def read_protocol(path: Path) -> Protocol:
    """Read a protocol: columns time_s and pressure_kPa, `#` comments allowed.

    Raises InputError naming file and line where the file is unreadable, a value is missing or not a
    finite number, time does not increase, or the protocol does not start at atmospheric pressure.
    """
    try:
        lines = file_text(path, _LONGEST).splitlines()
    except OSError as error:
        raise InputError(f"cannot read the protocol: {error.strerror}", str(path), "check the path") from None
    except UnicodeDecodeError:
        raise InputError("the protocol is not a text file", str(path), "save it as UTF-8 CSV") from None
    require_rows(sum(1 for line in lines if line.split("#")[0].strip()) - 1, str(path))
    rows = [(i, line) for i, line in enumerate(lines, 1) if line.split("#")[0].strip()]
    if not rows:
        raise InputError("the protocol is empty", str(path), f"give the columns {', '.join(COLUMNS)}")
    header = [name.strip() for name in next(csv.reader([rows[0][1].split("#")[0]]))]
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise InputError(
            f"the protocol lacks the column {missing[0]}",
            f"{path}, line {rows[0][0]}: {rows[0][1].strip()}",
            f"name the columns {', '.join(COLUMNS)}",
        )
    values: list[list[float]] = []
    for number, line in rows[1:]:
        cells = next(csv.reader([line.split("#")[0]]))
        where = f"{path}, line {number}: {line.strip()}"
        try:
            row = [float(cells[header.index(name)]) for name in COLUMNS]
        except (ValueError, IndexError):
            raise InputError("a value is missing or not a number", where, "give numbers only") from None
        if not np.isfinite(row).all():
            raise InputError("a value is not finite", where, "give finite numbers only")
        if values and row[0] <= values[-1][0]:
            raise InputError("time does not increase", where, "sort the rows and remove repeated times")
        values.append(row)
    if len(values) < 2:
        raise InputError(
            "the protocol has fewer than two rows", str(path), "give at least a start and an end"
        )
    if values[0][1] != 0:
        raise InputError(
            "the protocol does not start at 0 kPa",
            f"{path}, line {rows[1][0]}",
            "start at atmospheric pressure (gauge 0)",
        )
    time, pressure = np.array(values).T
    return Protocol(time, pressure)
