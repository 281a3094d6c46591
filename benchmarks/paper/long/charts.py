"""The pictures of the long studies: what random meshes and open values do to the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from mu_addon.report.plots import INK, canvas, label, signed
from mu_addon.report.results import Path

from ..table.charts import SCALE_STYLE, WIDE, panels
from .open_study import Effect
from .open_values import OPEN
from .scatter import Scatter


def mesh_scatter(found: Mapping[str, Scatter], paths: Sequence[Path]) -> str:
    """J_hat of every path on every mesh as dots, the paper's as crosses, a panel a column."""
    with panels([*found], paths, 2.7) as (grid, svg):
        for axes, (name, s) in zip(grid, found.items(), strict=True):
            at = np.arange(len(paths))
            # Side by side, so that meshes that agree do not hide each other.
            aside = np.linspace(-0.28, 0.28, len(s.J_hat))
            for dx, J in zip(aside, s.J_hat, strict=True):
                axes.plot(at + dx, J, "o", color=SCALE_STYLE[name]["color"], markersize=2, alpha=0.6)
            axes.plot(at, s.theirs, "x", color=INK, markersize=7, markeredgewidth=1.4, label="paper")
    return svg()


def orders(found: Mapping[str, Scatter], paths: Sequence[Path]) -> str:
    """In how many meshes two paths lie in the paper's order, a square a pair and a panel a column."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    with canvas(WIDE, 3.1) as (figure, svg):
        grid = figure.subplots(1, len(found), squeeze=False)[0]
        figure.subplots_adjust(left=0.05, right=0.90, top=0.90, bottom=0.12, wspace=0.16)
        names = [label(p.name) for p in paths]
        for axes, (name, s) in zip(grid, found.items(), strict=True):
            share = np.where(np.tri(len(paths), k=-1, dtype=bool), s.agree, np.nan)
            axes.imshow(share, cmap="cividis", vmin=0, vmax=1)
            for i, j in zip(*np.tril_indices(len(paths), -1), strict=True):
                if share[i, j] < 0.995:
                    ink = "white" if share[i, j] < 0.55 else INK
                    text = f"{100 * share[i, j]:.0f}"
                    axes.text(j, i, text, ha="center", va="center", fontsize=6, color=ink)
            axes.grid(False)
            axes.set_title(name, fontsize=9, pad=3)
            axes.set_xticks(range(len(paths)), names, fontsize=7)
            axes.set_yticks(range(len(paths)), names, fontsize=7)
            axes.tick_params(length=0)
        scale = ScalarMappable(Normalize(0, 1), "cividis")
        bar = figure.colorbar(scale, cax=figure.add_axes((0.92, 0.18, 0.014, 0.66)), ticks=[0, 0.5, 1])
        bar.ax.set_yticklabels(["0", "50", "100 %"])
        bar.outline.set_linewidth(0.6)
    return svg()


def shares(effects: Sequence[Effect]) -> str:
    """Total share of each figure's variance that each open value makes, a square each."""
    high = 0.75 + 0.36 * len(effects)
    with canvas(WIDE, high) as (figure, svg):
        axes = figure.add_axes((0.30, 0.03, 0.68, 0.97 - 0.70 / high))
        values = np.array([e.shares.total for e in effects])
        axes.imshow(values, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        for (i, j), value in np.ndenumerate(values):
            if value >= 0.015:
                ink = "white" if value > 0.6 else INK
                axes.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize=8, color=ink)
        axes.grid(False)
        axes.xaxis.tick_top()
        axes.set_xticks(range(len(OPEN)), [short(o.name) for o in OPEN], fontsize=7.5)
        axes.set_yticks(range(len(effects)), [signed(e.name) for e in effects], fontsize=8)
        axes.tick_params(length=0)
    return svg()


def short(name: str) -> str:
    """An open value's name without its section, a line a word, its unit last."""
    *words, last = name.split(".")[1].split("_")
    unit = {"mm": "[mm]", "kPa": "[kPa]"}.get(last, last)
    return "\n".join([*words, unit])
