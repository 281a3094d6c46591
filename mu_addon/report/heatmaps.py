"""Deviation heatmaps, and the colour scales of heatmaps and fields, as SVG text."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .plots import CHOSEN, QUIET, WIDTH, canvas
from .results import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.image import AxesImage

MAP = "viridis"  # perceptually uniform, and monotone in grey
FIELD_MAP = "YlOrRd"  # small values are light: a shaded surface in a dark colour shows no shape


def heatmap(delta: Floats, top: float, chosen: bool = False) -> str:
    """SVG of one path's deviation delta (k, j) in mm at k times and j stations, coloured from 0 to `top` mm.

    Arc length is to the right, time upward, both in percent. chosen: draw its frame in colour.
    """
    with canvas(1.75, 1.75) as (figure, svg):
        axes = figure.add_axes((0.20, 0.18, 0.74, 0.76))
        draw_deviation(axes, delta, top, (0, 100))
        axes.set(xticks=(0, 50, 100), yticks=(0, 50, 100))
        axes.tick_params(labelsize=7, length=2)
        for spine in axes.spines.values():
            spine.set_visible(True)
            spine.set(color=CHOSEN if chosen else QUIET, linewidth=2.5 if chosen else 0.8)
    return svg()


def draw_deviation(axes: Axes, delta: Floats, top: float, time: tuple[float, float]) -> AxesImage:
    """Draw a deviation delta (k, j) in mm over 0 to 100 % of length and, upward, a range of time.

    Colour is by square root from 0 to `top` mm, so that small deviations remain visible.
    """
    axes.grid(False)
    return axes.imshow(
        delta,
        origin="lower",
        extent=(0, 100, *time),
        aspect="auto",
        cmap=MAP,
        norm=_deviation_norm(top),
        interpolation="nearest",
    )


def _deviation_norm(top: float) -> Normalize:
    from matplotlib.colors import PowerNorm

    return PowerNorm(0.5, 0.0, top)


def color_bar(top: float) -> str:
    """SVG of the colour scale from 0 to `top` mm that the heatmaps share."""
    from matplotlib.cm import ScalarMappable

    series = np.outer(10.0 ** np.arange(-6, 6), [1.0, 2.0, 5.0]).ravel()
    ticks = [0.0, *series[(series > 0.01 * top) & (series <= top)]]
    return _bar(ScalarMappable(_deviation_norm(top), MAP), "deviation Δ [mm]", ticks=ticks, format="%g")


def _bar(colors: ScalarMappable, name: str, **more: Any) -> str:
    with canvas(WIDTH, 0.62) as (figure, svg):
        axes = figure.add_axes((0.04, 0.68, 0.92, 0.26))
        bar = figure.colorbar(colors, cax=axes, orientation="horizontal", **more)
        bar.set_label(name, fontsize=8, labelpad=2)
        bar.outline.set_linewidth(0.6)
    return svg()


def field_colors(values: Floats, low: float, top: float) -> Floats:
    """sRGB (n, 3) of a field's values (n,) from `low` to `top`, as in `field_bar`."""
    from matplotlib import colormaps

    return np.asarray(colormaps[FIELD_MAP](np.clip((values - low) / (top - low), 0.0, 1.0))[:, :3])


def field_bar(low: float, top: float, name: str) -> str:
    """SVG of the colour scale of a field from `low` to `top`; name: with its unit, if it has one."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return _bar(ScalarMappable(Normalize(low, top), FIELD_MAP), name, format="%.3g", extend="max")
