"""Pressures of a chain's units over time, and their file."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..fem.protocol import read_protocol_text


@attrs.frozen(eq=False)
class Pressures:
    """Piecewise linear gauge pressures over time: corner points in s (c,) and kPa (c, n), a column a unit."""

    time_s: Array
    pressure_kPa: Array

    def sample(self, count: int) -> tuple[Array, Array]:
        """Times (count,) in s, evenly spaced, and pressures (count, n) in kPa there."""
        time = np.linspace(self.time_s[0], self.time_s[-1], count)
        columns = [np.interp(time, self.time_s, column) for column in self.pressure_kPa.T]
        return time, np.round(np.stack(columns, axis=1), 9)

    def text(self) -> str:
        """The corner points as CSV, to their last digit."""
        names = ",".join(columns_of(self.pressure_kPa.shape[1]))
        rows = zip(self.time_s, self.pressure_kPa, strict=True)
        return names + "\n" + "".join(",".join(repr(float(v)) for v in (t, *p)) + "\n" for t, p in rows)


def columns_of(count: int) -> list[str]:
    """Columns of a chain's protocol."""
    return ["time_s", *(f"pressure_{n}_kPa" for n in range(1, count + 1))]


def read_pressures(path: Path, count: int) -> Pressures:
    """A chain's protocol: columns time_s, pressure_1_kPa and so on, one a unit, `#` comments allowed.

    Raises InputError naming file and line.
    """
    wanted = columns_of(count)
    text = read_protocol_text(path, wanted)
    if len(text.names) != len(wanted):
        raise InputError(
            f"the protocol of {count} units has the columns {', '.join(text.names)}",
            str(path),
            f"name the columns {', '.join(wanted)}",
        )
    table = text.values(wanted)
    return Pressures(table[:, 0], table[:, 1:])
