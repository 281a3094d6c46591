"""Charts of a parameter study: effects of its inputs, and Pareto fronts."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ...arrays import Array
from ...report.plots import CHOSEN, INK, QUIET, canvas
from .main_effects import Effect


def effect_chart(effect: Effect, values: list[Any], y: Array, name: str, output: str) -> str:
    """Every study's figure against one input, and the means by its values."""
    with canvas(2.9, 2.3) as (drawn, svg):
        axes = drawn.add_axes((0.25, 0.22, 0.72, 0.73))
        places = {label: i for i, label in enumerate(effect.labels)}
        x = np.array([places[str(v)] if places else float(v) for v in values])
        axes.plot(x, y, "o", color=QUIET, markersize=3.5, alpha=0.7)
        axes.errorbar(
            effect.places, effect.mean, yerr=np.nan_to_num(effect.error), color=CHOSEN, marker="s",
            markersize=4, linewidth=1.6, elinewidth=1, capsize=2, linestyle="none" if places else "-",
        )  # fmt: skip
        if places:
            axes.set_xticks(range(len(places)), list(places))
            axes.set_xlim(-0.5, len(places) - 0.5)
        else:
            axes.locator_params(axis="x", nbins=5)
        axes.set(xlabel=name, ylabel=output)
    return svg()


def front_chart(
    rows: list[dict[str, Any]], first: tuple[str, float], second: tuple[str, float], front: Array
) -> str:
    """Studies by two figures; the Pareto-optimal ones are joined and numbered."""
    x, y = (np.array([float(row[name]) for row in rows]) for name, _ in (first, second))
    with canvas(4.0, 3.2) as (drawn, svg):
        axes = drawn.add_axes((0.16, 0.15, 0.80, 0.80))
        axes.plot(x, y, "o", color=QUIET, markersize=4, alpha=0.7)
        order = front[np.argsort(x[front], kind="stable")]
        # Between two points of a front nothing better is known than the corner that both leave.
        step: Literal["post", "pre"] = "post" if first[1] > 0 else "pre"
        axes.step(x[order], y[order], where=step, color=CHOSEN, linewidth=1.4)
        axes.plot(x[order], y[order], "s", color=CHOSEN, markersize=5.5)
        for n in order if len(order) <= 12 else order[:: max(1, len(order) // 12)]:
            axes.annotate(
                str(rows[n]["point"]), (x[n], y[n]), (4, 4), textcoords="offset points", fontsize=7, color=INK
            )
        words = [f"{name} ({'less' if sign > 0 else 'more'} is better)" for name, sign in (first, second)]
        axes.set(xlabel=words[0], ylabel=words[1])
    return svg()
