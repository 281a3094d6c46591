"""Charts of a diagnosis: measurement and prediction, the residual, and the effects that explain it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..evidence.effect import readable
from ..evidence.gain_on_unseen import Errors
from ..evidence.residual_tests.dependence import Dependence
from ..report.plots import BY_LENGTH, CHOSEN, INK, QUIET, WIDTH, canvas, signed
from .judged_data import Curve

# Column against which an experiment of a kind is drawn.
AXES = {
    "unit_pressure": ("time_s", "time [s]"),
    "pressure_step": ("time_s", "time [s]"),
    "unit_pose": ("orientation_deg", "orientation [deg]"),
    "blocked_force": ("time_s", "time [s]"),
    "lattice_compression": ("strain", "compression"),
    "coupon": ("strain", "strain"),
    "pressure_hold": ("time_s", "time [s]"),
    "beam_deadweight": ("added_mass_g", "added mass [g]"),
    "waveguide_bending": ("time_s", "time [s]"),
}
QUANTITIES = {
    "angle": "bending angle",
    "stress": "nominal stress",
    "force": "force on the load cell",
    "tip_deflection": "deflection of the tip",
}
BASE = BY_LENGTH[0]
# Dots of a panel: more would hide the lines.
DOTS = 160
# Beyond this a probability is as good as none.
LEAST_P = 1e-12


def titled(channel: str) -> str:
    """Title of an axis from a column's name: "bending angle [deg]" from angle_deg."""
    head, _, unit = channel.rpartition("_")
    if head.startswith("marker"):
        number, _, axis = head[6:].partition("_")
        return f"marker {number}, {axis} [{unit}]"
    return f"{QUANTITIES.get(head, readable(head))} [{unit}]"


def panel(curve: Curve, extends: bool) -> str:
    """Chart of one experiment: measured dots and predictions above, residuals beneath."""
    column, title = AXES[curve.experiment.kind]
    x = curve.experiment[column]
    every = max(1, math.ceil(len(x) / DOTS))
    spread = curve.spread
    with canvas(2.75, 2.5) as (figure, svg):
        # Long numbers at the ticks would push the axis's title out of the picture.
        digits = len(f"{float(np.nanmax(np.abs(curve.measured), initial=0.0)):.0f}")
        aside = 0.22 + 0.02 * max(digits - 4, 0)
        above = figure.add_axes((aside, 0.45, 0.97 - aside, 0.44))
        beneath = figure.add_axes((aside, 0.17, 0.97 - aside, 0.22), sharex=above)
        above.tick_params(labelbottom=False)
        order = np.argsort(x, kind="stable")
        if spread is not None:
            low, high = curve.measured - spread, curve.measured + spread
            above.fill_between(x[order], low[order], high[order], color=QUIET, alpha=0.3, linewidth=0)
            beneath.fill_between(x[order], -spread[order], spread[order], color=QUIET, alpha=0.3, linewidth=0)
        above.plot(x[::every], curve.measured[::every], "o", color=INK, markersize=2.2, zorder=1)
        above.plot(x, curve.before, "--", color=BASE, linewidth=1.5, zorder=2)
        beneath.axhline(0, color=QUIET, linewidth=0.8)
        _left(beneath, x, curve.measured - curve.before, BASE, "--")
        if extends:
            above.plot(x, curve.after, "-", color=CHOSEN, linewidth=1.7, zorder=3)
            _left(beneath, x, curve.measured - curve.after, CHOSEN, "-")
        above.set_ylabel(titled(curve.channel), fontsize=8)
        beneath.set_ylabel("residual", fontsize=8)
        beneath.set_xlabel(title, fontsize=8)
        for axes in (above, beneath):
            axes.tick_params(labelsize=7)
            axes.yaxis.set_major_locator(_few(4 if axes is above else 3))
        figure.align_ylabels([above, beneath])
        held = ", held out" if curve.experiment.role == "held_out" else ""
        above.set_title(_short(curve.experiment.name) + held, loc="left", fontsize=8.5, fontweight="bold")
    return svg()


def _left(axes: Any, x: Array, left: Array, color: str, dashes: str) -> None:
    if len(x) <= 8:
        axes.plot(
            x, left, "o", color=color, markersize=3.5, markerfacecolor="none" if dashes == "--" else color
        )
        return
    every = max(1, len(x) // 400)
    axes.plot(x[::every], left[::every], color=color, linestyle=dashes, linewidth=1.1)


def _few(many: int) -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(many)


def _short(name: str, most: int = 34) -> str:
    return name if len(name) <= most else name[: most - 1] + "…"


def dependence_chart(
    before: Sequence[Dependence], after: Sequence[Dependence], level: float, extends: bool
) -> str:
    """P-value of each dependence of the residual; those beyond the line are structure."""
    names = [d.against for d in before]
    later = {d.against: d for d in after}
    high = 0.72 + 0.25 * len(names)
    with canvas(WIDTH, high) as (figure, svg):
        axes = figure.add_axes((0.34, 0.48 / high, 0.60, 1 - 0.70 / high))
        most = -math.log10(LEAST_P)
        axes.axvspan(-math.log10(level), most + 0.9, color=CHOSEN, alpha=0.08, linewidth=0)
        axes.axvline(-math.log10(level), color=CHOSEN, linewidth=1, linestyle=":")
        for row, d in enumerate(before):
            start = _unlikely(d.p_value)
            axes.plot(start, row, "o", color=BASE, markerfacecolor="white", markersize=6, zorder=3)
            if extends and d.against in later:
                end = _unlikely(later[d.against].p_value)
                axes.plot([start, end], [row, row], "-", color=QUIET, linewidth=1.2, zorder=1)
                axes.plot(end, row, "o", color=CHOSEN, markersize=4, zorder=4)
        axes.set_yticks(range(len(names)), [readable(n) for n in names], fontsize=8.5)
        axes.tick_params(axis="y", length=0)
        axes.grid(False, axis="y")
        ticks = [0, 3, 6, 9, 12]
        axes.set_xticks(ticks, ["certain", *(f"10$^{{-{t}}}$" for t in ticks[1:-1]), "less"])
        axes.set(xlim=(-0.4, most + 0.9), xlabel="p-value")
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.annotate(
            "structure",
            (1.0, 1.0),
            (0, 2),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="right",
            va="bottom",
            color=CHOSEN,
            fontsize=8,
        )
    return svg()


def _unlikely(p: float) -> float:
    return -math.log10(min(max(p, LEAST_P), 1.0))


@attrs.frozen(eq=False)
class Dependent:
    """Residuals (n,) of the base and the extended model against a quantity (n,), of one channel."""

    name: str
    unit: str
    x: Array
    before: Array
    after: Array
    structure: bool


def residual_panel(d: Dependent, extends: bool) -> str:
    """Residual against a quantity: means of its stretches with their scatter, before and after."""
    with canvas(2.45, 2.0) as (figure, svg):
        axes = figure.add_axes((0.24, 0.23, 0.73, 0.63))
        axes.axhline(0, color=QUIET, linewidth=0.8)
        for values, color, dashes, shown in (
            (d.before, BASE, "--", True),
            (d.after, CHOSEN, "-", extends),
        ):
            if shown:
                x, mean, low, high = _stretches(d.x, values)
                axes.fill_between(x, low, high, color=color, alpha=0.16, linewidth=0)
                axes.plot(x, mean, color=color, linestyle=dashes, marker="o", markersize=3, linewidth=1.4)
        axes.set_title(
            readable(d.name),
            loc="left",
            fontsize=8.5,
            fontweight="bold",
            color=CHOSEN if d.structure else INK,
        )
        axes.set_ylabel(f"residual [{d.unit}]", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.xaxis.set_major_locator(_few(4))
        axes.yaxis.set_major_locator(_few(4))
    return svg()


def _stretches(x: Array, values: Array, many: int = 14) -> tuple[Array, Array, Array, Array]:
    """Means (b,) and quartiles over stretches of x with equally many values."""
    distinct = np.unique(x)
    if len(distinct) <= many:
        parts = [np.flatnonzero(x == v) for v in distinct]
    else:
        parts = [p for p in np.array_split(np.argsort(x, kind="stable"), many) if len(p)]
    at = np.array([x[p].mean() for p in parts])
    mean = np.array([values[p].mean() for p in parts])
    low, high = np.array([np.quantile(values[p], [0.25, 0.75]) for p in parts]).T
    return at, mean, low, high


def rivals_chart(names: Sequence[str], left: Sequence[float], chosen: float, named: Sequence[str]) -> str:
    """Share of the base model's misfit left by each single effect; the named ones in colour."""
    high = 0.75 + 0.24 * len(names)
    with canvas(WIDTH, high) as (figure, svg):
        shown = [_short(readable(n), 52) for n in names]
        aside = (0.15 + 0.066 * max(map(len, shown))) / WIDTH
        axes = figure.add_axes((aside, 0.48 / high, 0.95 - aside, 1 - 0.58 / high))
        rows = np.arange(len(names))
        floor = max(min([*left, chosen]), 1e-6)
        wide = floor < 0.02
        start = 10 ** math.floor(math.log10(floor)) if wide else 0.0
        for row, name, share in zip(rows, names, left, strict=True):
            mine = name in named
            axes.barh(
                row,
                max(share, start) - start,
                left=start,
                height=0.62,
                color=CHOSEN if mine else "#B9C3CF",
            )
        axes.axvline(1.0, color=INK, linewidth=1.0)
        if chosen < 0.999:
            axes.axvline(max(chosen, start), color=CHOSEN, linewidth=1.2, linestyle="--")
        if wide:
            axes.set_xscale("log")
            axes.set_xlim(start, 1.5)
        else:
            axes.set_xlim(0, 1.08)
        from matplotlib.ticker import FuncFormatter, NullLocator

        axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{100 * v:g} %"))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_yticks(rows, shown, fontsize=8)
        axes.tick_params(axis="y", length=0)
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        axes.set_xlabel("remaining misfit relative to the base model", loc="right")
    return svg()


def gain_chart(errors: Errors) -> str:
    """Root mean square errors: the base model, the extended one, and the two without a cause."""
    bars = [
        ("base model", errors.before, BASE),
        ("extended model", errors.after, CHOSEN),
        ("permuted effect", errors.permuted, "#B9C3CF"),
        ("black-box model", errors.black_box, "#B9C3CF"),
    ]
    bars = [bar for bar in bars if math.isfinite(bar[1])]
    high = 0.62 + 0.3 * len(bars)
    with canvas(WIDTH, high) as (figure, svg):
        axes = figure.add_axes((0.46, 0.44 / high, 0.42, 1 - 0.5 / high))
        rows = np.arange(len(bars))
        most = max(value for _, value, _ in bars) or 1.0
        for row, (_, value, color) in zip(rows, bars, strict=True):
            axes.barh(row, value, height=0.64, color=color)
            axes.text(value + 0.03 * most, row, signed(f"{value:.3g}"), va="center", fontsize=8)
        axes.set_yticks(rows, [name for name, _, _ in bars], fontsize=8.5)
        axes.tick_params(axis="y", length=0)
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        axes.set(xlim=(0, 1.2 * most), xlabel=f"error [{errors.unit}]")
    return svg()
