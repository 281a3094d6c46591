"""Charts of a study: the light signal for its report, and square ones with large letters for a panel."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from ..report.heatmaps import draw_deviation
from ..report.plots import BY_LENGTH, CHOSEN, INK, QUIET, WIDTH, canvas, label, signed, styled
from ..report.results import Floats, Picture, Signals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def front_chart(found: Signals, chosen: str) -> str:
    """Disturbance against sensitivity of every path, the Pareto-optimal ones joined by a line."""
    sense = 100 * np.abs([r.sensitivity_per_deg for r in found.responses])
    with canvas(WIDTH, 3.0) as (figure, svg):
        axes = figure.add_axes((0.13, 0.17, 0.83, 0.79))
        # A path of which only a lower bound is known lies to the right of its ring.
        on = np.flatnonzero([bool(f) and s for f, s in zip(found.front, found.solved, strict=True)])
        on = on[np.argsort(found.j_hat[on])]
        axes.plot(found.j_hat[on], sense[on], "-", color=QUIET, lw=1, zorder=1)
        for k, name in enumerate(found.names):
            color = CHOSEN if name == chosen else INK if found.front[k] else QUIET
            fill = "full" if found.solved[k] else "none"
            axes.plot(found.j_hat[k], sense[k], "o", ms=5, color=color, fillstyle=fill, zorder=2)
            axes.annotate(
                label(name) if found.solved[k] else f"{label(name)} →",
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


ANGLE = "angle.png"
INCHES, DPI = 2.6, 200


def delta_name(path: str) -> str:
    """Name of the picture of a path's deviation."""
    return f"delta-{path}.png"


def angle_picture(pressure_kPa: Floats, angle_deg: Floats) -> Picture:
    """The bending angle over the pressure, (s,) each."""
    with _square() as (_, axes, png):
        axes.axhline(0, color=QUIET, linewidth=0.8)
        axes.axvline(0, color=QUIET, linewidth=0.8)
        axes.plot(pressure_kPa, angle_deg, "-o", color=BY_LENGTH[0], markersize=4, linewidth=2)
        axes.set(xlabel="pressure [kPa]", title="bending angle [deg]")
        for i, aside in ((angle_deg.argmin(), 10), (angle_deg.argmax(), -10)):
            axes.annotate(
                signed(f"{angle_deg[i]:.1f}°"),
                (pressure_kPa[i], angle_deg[i]),
                (aside, 0),
                textcoords="offset points",
                ha="left" if aside > 0 else "right",
                va="center",
                fontsize=10,
            )
    return Picture(png(), "Bending angle against pressure.", "Bending angle against pressure.")


def delta_picture(path: str, delta_mm: Floats, time_s: Floats, top_mm: float) -> Picture:
    """A path's deviation (k, j) over length and time, colours from 0 to `top_mm`."""
    with _square() as (figure, axes, png):
        image = draw_deviation(axes, delta_mm, top_mm, (float(time_s[0]), float(time_s[-1])))
        axes.set(xlabel="length [%]", ylabel="time [s]", title=f"{label(path)}: deviation [mm]")
        axes.set_xticks((0, 50, 100))
        bar = figure.colorbar(image, ax=axes, fraction=0.07, pad=0.04)
        bar.ax.tick_params(labelsize=8, length=2)
        bar.outline.set_linewidth(0.6)
    words = f"Deviation of {path} over length and time."
    return Picture(png(), words, words)


@contextmanager
def _square() -> Iterator[tuple[Figure, Axes, Callable[[], bytes]]]:
    """A figure, its axes, and what gives its PNG once the body has drawn it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with styled(INCHES, INCHES) as figure:
        FigureCanvasAgg(figure)
        figure.set_layout_engine("constrained")
        axes: Any = figure.subplots()
        stream = io.BytesIO()
        yield figure, axes, stream.getvalue
        figure.savefig(stream, format="png", dpi=DPI, facecolor="white", metadata={"Software": None})
