"""Charts of recorded columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..arrays import Array
from . import plots

# Axes of the chart, the first pair that is present.
_PAIRS = (
    ("displacement_mm", "force_N"),
    ("strain", "stress_kPa"),
    ("displacement_mm", "stress_kPa"),
    ("strain", "force_N"),
    ("angle_deg", "voltage_V"),
    ("added_mass_g", "tip_deflection_mm"),
    ("time_s", "pressure_kPa"),
    ("time_s", "angle_deg"),
    ("time_s", "force_N"),
    ("time_s", "stress_kPa"),
)
_MOST_POINTS = 2000


def pairs_of(columns: Mapping[str, Array], kind: str) -> list[tuple[str, str]]:
    """Names of the columns to draw against each other: one curve, and what was recorded over time.

    Of a unit what was recorded over time alone.
    """
    pairs = [pair for pair in _PAIRS if set(pair) <= set(columns)]
    over_time = [pair for pair in pairs if pair[0] == "time_s"]
    of_unit = kind in ("unit_pressure", "pressure_step", "blocked_force")
    return list(dict.fromkeys(over_time[:2] if of_unit else [*pairs[:1], *over_time[:1]]))


def columns_chart(columns: Mapping[str, Array], pairs: Sequence[tuple[str, str]]) -> str:
    """SVG of columns (n,) against each other, a diagram for each pair of names."""
    with plots.canvas(8.8, 2.8) as (drawing, svg):
        for i, (x, y) in enumerate(pairs, 1):
            axes = drawing.add_subplot(1, len(pairs), i)
            step = max(1, len(columns[x]) // _MOST_POINTS)
            axes.plot(columns[x][::step], columns[y][::step], color="#0072B2", linewidth=1.0)
            axes.set(xlabel=_titled(x), ylabel=_titled(y))
        drawing.tight_layout()
    return str(svg())


def _titled(column: str) -> str:
    """Title of an axis from a column's name."""
    head, _, unit = column.rpartition("_")
    return f"{head.replace('_', ' ')}, {unit}" if head else column
