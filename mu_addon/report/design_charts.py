"""Charts of an optimisation: the front, its course, and each unit's half section."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..design.body import Body, covering, envelope, section
from ..design.dimensions import Dimensions
from ..design.lattice import lattice_of
from ..design.parameters import Unit
from ..design.profile import cavity_polygon, outer_polygon
from ..design.section_picture import struts_beside_section
from .plots import BY_LENGTH, CHOSEN, INK, QUIET, canvas, styled

if TYPE_CHECKING:
    from ..optimization import Design, Found


ALONG = 6
STATIONS = np.linspace(0.0, 1.0, 7)
"""Number of positions along a strut at which its outline is drawn."""


def front(design: Design, found: Found, proposed: Sequence[int], first: int, second: int) -> str:
    """SVG of all computed designs by two judged targets (numbers); proposals are numbered squares."""
    with canvas(4.6, 3.5) as (drawn, svg):
        _front(drawn, design, found, proposed, first, second)
    return svg()


def front_picture(design: Design, found: Found, proposed: Sequence[int], first: int, second: int) -> bytes:
    """The same as a square PNG of 512 pixels, as a panel shows it."""
    return _png(3.6, 512, False, lambda drawn: _front(drawn, design, found, proposed, first, second))


def compared(design: Design, found: Found) -> tuple[int, int] | None:
    """Numbers of the two targets that a front is drawn for, objectives first; None without two."""
    if not any(o.sound for o in found.observed):
        return None
    targets = design.judged
    goals = [i for i, t in enumerate(targets) if t.goal is not None]
    first, second, *_ = [*goals, *(i for i in range(len(targets)) if i not in goals), -1, -1]
    return None if second < 0 else (first, second)


def _front(
    drawn: Any, design: Design, found: Found, proposed: Sequence[int], first: int, second: int
) -> None:
    targets = design.judged
    sound = [o for o in found.observed if o.sound]
    values = np.array([[o.values[first], o.values[second]] for o in sound])
    meets = np.array([all(t.met(v) for t, v in zip(targets, o.values, strict=True)) for o in sound])
    left = 0.69 / drawn.get_figwidth()  # inches, for numbers of four digits and the axis' name
    axes = drawn.add_axes((left, 0.14, 0.96 - left, 0.82))
    if (~meets).any():
        axes.plot(*values[~meets].T, "o", color=QUIET, markersize=3.5, alpha=0.8, label="misses a target")
    if meets.any():
        axes.plot(*values[meets].T, "o", color=BY_LENGTH[0], markersize=4, label="meets all")
    for place, number in enumerate(proposed, 1):
        x, y = found.observed[number].values[[first, second]]
        axes.plot(x, y, "s", color=CHOSEN, markersize=6.5, label="" if place > 1 else "proposed")
        axes.annotate(str(place), (x, y), (5, 5), textcoords="offset points", fontsize=8, color=INK)
    for target, line in ((targets[first], axes.axvline), (targets[second], axes.axhline)):
        for bound in (target.low, target.high, target.value):
            if not np.isnan(bound):
                line(bound, color=INK, linewidth=0.8, linestyle="--")
    axes.set(xlabel=_axis(targets[first]), ylabel=_axis(targets[second]))
    axes.legend(fontsize=7, frameon=False)


def course(design: Design, found: Found) -> str:
    """SVG of the largest misfit in tolerances by the number of designs computed, and of the best so far."""
    misfit = np.array(
        [
            max((abs(t.misfit(v)) for t, v in zip(design.judged, o.values, strict=True)), default=0.0)
            if o.sound
            else np.nan
            for o in found.observed
        ]
    )
    number = np.arange(1, len(misfit) + 1)
    with canvas(4.6, 2.6) as (drawn, svg):
        axes = drawn.add_axes((0.15, 0.19, 0.81, 0.76))
        shown = np.maximum(misfit, 1e-2)
        axes.plot(number, shown, "o", color=QUIET, markersize=4)
        axes.plot(number, np.fmin.accumulate(shown), color=CHOSEN, linewidth=1.6, drawstyle="steps-post")
        axes.set_yscale("log")
        axes.axhline(1.0, color=INK, linewidth=0.8, linestyle="--")
        axes.set(xlabel="units computed", ylabel="largest misfit, tolerances")
        axes.locator_params(axis="x", integer=True)
    return svg()


def thumbnail(unit: Unit, widest_mm: float, tallest_mm: float, body: Body | None = None) -> str:
    """SVG of a unit cut along its plane of bending, all units at one scale: wall, chambers, struts, envelope.

    Struts of the half cell on one side of the plane are drawn at their thickness. body: in place of the
    lattice's box.

    widest_mm, tallest_mm: size of the largest unit in the comparison.
    """
    with canvas(1.15, 1.15 * tallest_mm / widest_mm) as (drawn, svg):
        _half_section(drawn, unit, widest_mm, tallest_mm, body)
    return svg()


def picture(unit: Unit, body: Body | None = None) -> bytes:
    """A unit's half section as a square PNG of 256 pixels, as a panel shows it."""
    size = 1.05 * max(sizes([unit], body))
    return _png(2.56, 256, True, lambda drawn: _half_section(drawn, unit, size, size, body))


def _png(inches: float, pixels: int, clear: bool, draw: Callable[[Any], None]) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    stream = io.BytesIO()
    with styled(inches, inches) as drawn:
        FigureCanvasAgg(drawn)
        draw(drawn)
        drawn.savefig(
            stream, format="png", dpi=pixels / inches, transparent=clear, metadata={"Software": None}
        )
    return stream.getvalue()


def _half_section(drawn: Any, unit: Unit, widest_mm: float, tallest_mm: float, body: Body | None) -> None:
    """Draw a unit over a whole figure, so many mm wide and tall."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    d = unit.dimensions
    axes = drawn.add_axes((0.0, 0.0, 1.0, 1.0))
    (_, _), (y0, y1), (z0, z1) = d.bounds
    outlines, filled = [np.array([[y0, z0], [y1, z0], [y1, z1], [y0, z1]])], d
    if body is not None:
        own = envelope(body, d)
        outlines, filled = section(own), covering(d, own)
        (_, y0, _), (_, y1, _) = own.bounds.tolist()
    whole = Outline.make_compound_path(*(Outline(np.vstack([o, o[:1]]), closed=True) for o in outlines))
    inside = axes.add_patch(PathPatch(whole, facecolor="#dfe6ee", linewidth=0))
    for strut in axes.fill(*_strut_outlines(filled), color="#8a97a8", linewidth=0):
        strut.set_clip_path(inside)
    for polygon, color in ((outer_polygon(d, ALONG), "#c98a3a"), (cavity_polygon(d, ALONG), "#ffffff")):
        for sign in (1, -1):
            # The edge hides the seam between the halves.
            axes.fill(sign * polygon[:, 0], polygon[:, 1], color=color, linewidth=0.3)
    middle = 0.5 * (y0 + y1)
    axes.set_xlim(middle - 0.52 * widest_mm, middle + 0.52 * widest_mm)
    axes.set_ylim(-0.02 * tallest_mm, 1.02 * tallest_mm)
    axes.set_aspect("equal")
    axes.axis("off")


def _strut_outlines(d: Dimensions) -> list[Array]:
    """Outlines of the struts next to the plane of bending: y and z in mm of each in turn."""
    lattice = lattice_of(d)
    rows = struts_beside_section(lattice)
    first, last = (lattice.nodes[lattice.struts[rows, end]][:, None, 1:] for end in (0, 1))
    along = last - first
    length = np.linalg.norm(along, axis=2, keepdims=True)
    # A strut that is seen end on has no direction in the picture, and is hidden by others.
    shown = length[:, 0, 0] > 0
    aside = (along / np.where(length > 0, length, 1.0))[..., ::-1] * (1.0, -1.0)
    middle = first + STATIONS[:, None] * along
    wide = lattice.radii(STATIONS, rows)[..., None] * aside
    outline = np.concatenate([middle + wide, (middle - wide)[:, ::-1]], axis=1)[shown]
    return [strut[:, column] for strut in outline for column in (0, 1)]


def sizes(units: Sequence[Unit], body: Body | None = None) -> tuple[float, float]:
    """Largest width and height in mm of some units, in a body or in the box of their lattice."""
    bounds = [u.dimensions.bounds for u in units]
    width = max(y1 - y0 for _, (y0, y1), _ in bounds) if body is None else float(np.ptp(body.bounds[:, 1]))
    return width, max(z1 - z0 for _, _, (z0, z1) in bounds)


def _axis(target: Any) -> str:
    return f"{target.name} [{target.unit}]" if target.unit else str(target.name)
