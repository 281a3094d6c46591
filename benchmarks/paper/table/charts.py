"""The charts of a reproduction, in the form of the paper's figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from mu_addon.report.plots import GRID, INK, QUIET, WIDTH, canvas, label
from mu_addon.report.results import Path

from .published import Published
from .table_columns import TableColumn

Array = np.ndarray[Any, Any]

# The paper's red, blue and green, dark enough for lines, and dashes for who sees no colour.
SCALE_STYLE: Mapping[str, dict[str, Any]] = {
    "0.75x": {"color": "#C4281C", "linestyle": "-"},
    "1.0x": {"color": "#1B5FAA", "linestyle": "--"},
    "1.5x": {"color": "#23803A", "linestyle": "-."},
    "gripper": {"color": "#6B4C9A", "linestyle": ":"},
}
WIDE = 8.2  # inches: two columns of the page


def deviations(columns: Sequence[TableColumn], rule: str, paths: Sequence[Path], along: str) -> str:
    """Mean deviation of every path along "length" or over "time", a panel a path and a line a scale."""
    rows, across = 2, (len(paths) + 1) // 2
    with canvas(WIDE, 3.9) as (figure, svg):
        grid = figure.subplots(rows, across, sharex=True, sharey=True, squeeze=False)
        figure.subplots_adjust(left=0.07, right=0.99, top=0.86, bottom=0.13, wspace=0.2, hspace=0.30)
        for number, (axes, path) in enumerate(zip(grid.flat, paths, strict=False)):
            for c in columns:
                d = c.fine.deviations(rule)[number]
                values = d.over_length if along == "length" else d.over_time
                at = np.linspace(0, 100, len(values))
                axes.plot(at, values, linewidth=1.5, label=c.name, **SCALE_STYLE[c.name])
            axes.set_title(f"{label(path.name)}  {path.anchors}", fontsize=8.5, pad=3)
            axes.set(xlim=(0, 100), xticks=(0, 50, 100))
            axes.margins(y=0.08)
        grid[0, 0].set_ylim(bottom=0, auto=True)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="upper center", ncols=len(labels), handlelength=2.8)
        words = "actuation time" if along == "time" else "actuator length"
        figure.supxlabel(f"{words} [%]", fontsize=9)
        figure.supylabel("mean deviation [mm]", fontsize=9)
    return svg()


@contextmanager
def panels(
    names: Sequence[str], paths: Sequence[Path], height: float
) -> Iterator[tuple[list[Any], Callable[[], str]]]:
    """Axes side by side, one a column of the table, J_hat over its paths; and what gives them as SVG text."""
    with canvas(WIDE, height) as (figure, svg):
        grid = list(figure.subplots(1, len(names), sharey=True, squeeze=False)[0])
        figure.subplots_adjust(left=0.07, right=0.99, top=0.88, bottom=0.17, wspace=0.08)
        yield grid, svg
        for axes, name in zip(grid, names, strict=True):
            axes.set_title(name, fontsize=9, pad=3)
            axes.set_xticks(np.arange(len(paths)), [label(p.name) for p in paths], fontsize=7)
        grid[0].set_ylim(bottom=0, auto=True)
        grid[0].legend(loc="upper left")
        grid[0].set_ylabel("Ĵ [mm]")


def against_paper(table: Mapping[str, Array], paper: Published, paths: Sequence[Path]) -> str:
    """J_hat of every path, ours as a line with dots and the paper's as crosses, a panel a column."""
    with panels([*table], paths, 2.6) as (grid, svg):
        at = np.arange(len(paths))
        for axes, (name, ours) in zip(grid, table.items(), strict=True):
            style = SCALE_STYLE[name]
            axes.plot(at, paper.J_hat[name], "x", color=INK, markersize=6, label="paper")
            axes.plot(at, ours, "o", color=style["color"], markersize=4.5, label="here")
            axes.vlines(at, paper.J_hat[name], ours, color=GRID, linewidth=2, zorder=0)
    return svg()


def bending(columns: Sequence[TableColumn], paper: Published) -> str:
    """Angle against pressure of every scale, and the ends of the paper's ranges as bars of 5 degrees."""
    with canvas(WIDTH, 3.4) as (figure, svg):
        axes = figure.add_axes((0.15, 0.14, 0.82, 0.82))
        axes.axhline(0, color=QUIET, linewidth=0.8)
        axes.axvline(0, color=QUIET, linewidth=0.8)
        for number, c in enumerate(columns):
            style = SCALE_STYLE[c.name]
            axes.plot(c.fine.pressure_kPa, c.fine.angle_deg, linewidth=1.6, label=c.name, **style)
            # Beside each other, as the three ends nearly agree.
            for end, sign in zip((0, 1), (-1, 1), strict=True):
                x = paper.bending_kPa[end] + sign * (2.0 + 1.6 * number)
                y = paper.bending_deg[c.scale][end]
                axes.errorbar(x, y, yerr=2.5, color=style["color"], marker="x", markersize=6, elinewidth=1.4)
        axes.set(xlabel="pressure [kPa]", ylabel="bending angle [deg]", xlim=(-28, 58))
        axes.legend(loc="upper left")
    return svg()
