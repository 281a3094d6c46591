"""Pictures of a print check: layers, build directions, places of the findings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..design.printing.check import PrintCheck
from ..design.printing.finding import counted
from ..design.printing.orientation import Build, direction_name
from ..design.printing.slices import Slice, signed_area
from ..design.surface import Triangles, Vertices
from . import plots
from .render import Part, fit, png, render
from .results import Picture
from .shapes import ball, tube

COLORS = {"error": (0.75, 0.05, 0.10), "warning": (0.95, 0.55, 0.0)}
GREY = (0.66, 0.70, 0.76)


def layer_pictures(found: Sequence[Slice]) -> str:
    """Sections of a part side by side, to one scale, as SVG text."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    across = 4
    rows = -(-len(found) // across)
    # Above the part there is nothing: an empty field of 1 mm.
    points = np.concatenate([ring for s in found for ring in s.outlines] or [np.eye(2)])
    low, high = points.min(axis=0), points.max(axis=0)
    wide = plots.WIDTH * 1.6
    tall = (0.4 + wide / across * float((high - low)[1] / (high - low)[0])) * rows
    with plots.canvas(wide, tall) as (chart, svg):
        for k, section in enumerate(found):
            axes = chart.add_subplot(rows, across, k + 1)
            blue = plots.BY_LENGTH[3]
            for ring in section.open_chamber:
                axes.add_patch(PathPatch(Outline(np.vstack([ring, ring[:1]]), closed=True), fc=blue, lw=0))
            # Holes last, filled: material may stand in them.
            for ring in sorted(section.outlines, key=lambda ring: abs(signed_area(ring)), reverse=True):
                edge = Outline(np.vstack([ring, ring[:1]]), closed=True)
                color = GREY if signed_area(ring) > 0 else blue
                axes.add_patch(PathPatch(edge, facecolor=color, edgecolor=plots.INK, linewidth=0.3))
            title = f"{section.height_mm:.1f} mm"
            inside_mm2 = section.enclosed_mm2 + section.open_mm2
            if inside_mm2 >= 1.0:
                title += f", {inside_mm2:.0f} mm²"
            axes.set_title(title, fontsize=8)
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
            axes.axis("off")
        chart.tight_layout(pad=0.3)
    return svg()


def trade_off(builds: Sequence[Build]) -> str:
    """Surface to support against the largest cup, as SVG text."""
    with plots.canvas(plots.WIDTH, 3.0) as (chart, svg):
        axes = chart.add_axes((0.15, 0.16, 0.81, 0.78))
        x = np.array([b.support_mm2 for b in builds]) / 100.0
        y = np.array([b.cup_ml for b in builds])
        optimal = np.array([b.best_among for b in builds])
        axes.plot(x[~optimal], y[~optimal], "o", color=plots.QUIET, markersize=4, alpha=0.7)
        axes.plot(x[optimal], y[optimal], "o", color=plots.BY_LENGTH[0], markersize=6)
        axes.plot(x[:1], y[:1], "o", color=plots.CHOSEN, markersize=9)
        axes.annotate(
            direction_name(builds[0].direction),
            (x[0], y[0]),
            (9, 7),
            textcoords="offset points",
            fontsize=8,
            color=plots.CHOSEN,
        )
        axes.set(xlabel="flat surface to support [cm²]", ylabel="largest cup [ml]")
        axes.set_xlim(0.0, 1.08 * float(x.max(initial=1.0)))
        axes.set_ylim(-0.04 * max(float(y.max()), 0.1), 1.08 * max(float(y.max()), 0.1))
    return svg()


def places_picture(
    vertices: Vertices, triangles: Triangles, found: PrintCheck, up: Sequence[float], width: int = 760
) -> Picture:
    """The part, seen through, with a ball at each place of each fault, and an arrow along the build."""
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    parts = [Part(vertices, triangles, GREY, opacity=0.15)]
    count = 0
    for f in found.findings:
        if f.is_fault:
            count += len(f.places)
            parts += [Part(*ball(place, 0.016 * size), COLORS[f.severity], whole=True) for place in f.places]
    way = np.asarray(up, float) / np.linalg.norm(up)
    foot = vertices.mean(axis=0) + np.array([0.0, -0.75 * np.ptp(vertices[:, 1]), 0.0])
    arrow = np.stack([foot - 0.1 * size * way, foot + 0.1 * size * way])
    parts.append(Part(*tube(arrow, 0.005 * size), plots_ink(), whole=True))
    parts.append(Part(*_cone(arrow[1], way, 0.015 * size, 0.05 * size), plots_ink(), whole=True))
    towards, aspect = (1.0, -0.45, 0.3), 0.85
    camera = fit(parts, towards, aspect=aspect)
    image = render(parts, camera, width, round(width / aspect), background=(1.0, 1.0, 1.0), layers=4)
    caption = (
        f"{counted(count, 'place', 'places')}; the arrow is the build direction, away from the platform."
    )
    return Picture(png(image), caption, "Transparent view of the part with spheres at the findings")


def plots_ink() -> tuple[float, float, float]:
    """The ink of charts as a colour of a picture."""
    ink = plots.INK
    return tuple(int(ink[k : k + 2], 16) / 255.0 for k in (1, 3, 5))  # type: ignore[return-value]


def _cone(base: Any, way: Any, radius: float, height: float, sides: int = 24) -> tuple[Any, Any]:
    from ..design.printing.voxels import frame_along

    x, y, z = frame_along(way)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rim = base + radius * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y)
    points = np.concatenate([rim, [base, base + height * z]])
    i = np.arange(sides)
    j = (i + 1) % sides
    sides_ = np.stack([i, j, np.full(sides, sides + 1)], 1)
    bottom = np.stack([j, i, np.full(sides, sides)], 1)
    return points, np.concatenate([sides_, bottom])
