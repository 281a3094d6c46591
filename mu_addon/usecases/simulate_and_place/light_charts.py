"""Charts of the light signal of candidate paths."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...report.charts import CHOSEN, INK, QUIET, WIDTH, canvas, label
from ...report.results import Signals


def front_chart(found: Signals, chosen: str) -> str:
    """Disturbance against sensitivity of every path, the Pareto-optimal ones joined by a line."""
    sense = 100 * np.abs([r.sensitivity_per_deg for r in found.responses])
    with canvas(WIDTH, 3.0) as (figure, svg):
        axes = figure.add_axes((0.13, 0.17, 0.83, 0.79))
        on = np.flatnonzero(found.front)
        on = on[np.argsort(found.j_hat[on])]
        axes.plot(found.j_hat[on], sense[on], "-", color=QUIET, lw=1, zorder=1)
        for k, name in enumerate(found.names):
            color = CHOSEN if name == chosen else INK if found.front[k] else QUIET
            axes.plot(found.j_hat[k], sense[k], "o", ms=5, color=color, zorder=2)
            axes.annotate(
                label(name),
                (found.j_hat[k], sense[k]),
                (5, 3),
                textcoords="offset points",
                fontsize=8,
                color=color,
            )
        axes.set_xlim(left=0)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("mean deviation Ĵ [mm]")
        axes.set_ylabel("signal [% of light per degree]")
    return svg()


def response_chart(found: Signals, chosen: str) -> str:
    """Share of light lost against bending angle, the chosen path in colour, dots where rays were followed."""
    with canvas(WIDTH, 2.8) as (figure, svg):
        axes = figure.add_axes((0.13, 0.18, 0.83, 0.78))
        for k, name in enumerate(found.names):
            r = found.responses[k]
            mine = name == chosen
            style: dict[str, Any] = {"color": CHOSEN if mine else QUIET, "lw": 1.8 if mine else 0.8}
            axes.plot(r.angle_deg, 100 * r.delta, zorder=2 if mine else 1, **style)
        c = found.checks
        axes.errorbar(
            c.angle_deg, 100 * c.delta, 200 * c.errors, fmt="o", ms=4, color=INK, elinewidth=0.8, zorder=3
        )
        axes.axhline(0, color=QUIET, lw=0.6)
        axes.set_xlabel("bending angle [deg]")
        axes.set_ylabel("light loss [% of light at rest]")
    return svg()
