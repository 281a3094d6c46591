"""Pictures and charts of a chain: its units bent, the way of its tip, angles and pressures over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..chain import ChainState, Shape
from ..meshing.mesh import LATTICE, MEMBRANE
from . import plots
from .render import Part, framed, png, render
from .results import Picture
from .shapes import ball
from .unit_pictures import LATTICE_COLOR, MEMBRANE_COLOR, WHITE, region_skin

_TARGET_COLOR = (0.835, 0.369, 0.0)
# The base is above where the chain hangs, and stands where it is turned round.
_UP = (0.0, 0.0, -1.0)
_TOWARDS = (1.0, 0.35, -0.15)


def moments(states: Sequence[ChainState]) -> list[tuple[str, int]]:
    """Names and numbers of the instants to show: first, most bent, last; equal ones once."""
    angles = [state.angle_deg for state in states]
    wanted = {"start": 0, "most bent": int(np.argmax(angles)), "end": len(states) - 1}
    found: dict[int, str] = {}
    for name, number in wanted.items():
        found.setdefault(number, name)
    return [(name, number) for number, name in sorted(found.items())]


def pictures(
    shape: Shape, states: Sequence[ChainState], target: Sequence[float], hangs: bool, height: int = 620
) -> list[tuple[str, Picture]]:
    """Names of files and pictures, all to one scale, of the chain at its `moments`.

    target (3,) in mm, or empty; hangs: the base is above.
    """
    mesh = shape.mesh()
    skins = {MEMBRANE: region_skin(mesh, MEMBRANE), LATTICE: region_skin(mesh, LATTICE)}
    owner = np.repeat(np.arange(len(shape.meshes)), [len(one.nodes) for one in shape.meshes])
    # Neighbours in two shades, so that a unit is told from the next.
    shade = np.where(owner % 2 == 0, 1.0, 0.86)[:, None]
    scenes = []
    for _, number in moments(states):
        x = shape.places(states[number])
        parts = [
            Part(x, skins[LATTICE], np.asarray(LATTICE_COLOR) * shade, opacity=0.45),
            Part(x, skins[MEMBRANE], np.asarray(MEMBRANE_COLOR) * shade),
        ]
        if target:
            parts.append(Part(*ball(np.array(target), 4.0), _TARGET_COLOR, whole=True))
        scenes.append(parts)
    every = [part for scene in scenes for part in scene]
    up = _UP if hangs else (0.0, 0.0, 1.0)
    camera, aspect = framed(every, _TOWARDS, up, margin=0.03)
    found = []
    for scene, (name, number) in zip(scenes, moments(states), strict=True):
        state = states[number]
        image = render(scene, camera, round(height * aspect), height, background=WHITE)
        p = ", ".join(f"{v:.3g}" for v in state.pressures_kPa)
        caption = f"{name}: {p} kPa, tip turned by {state.angle_deg:.1f}°"
        words = f"The chain of {len(shape.meshes)} units, {name}"
        found.append((f"chain_{name.replace(' ', '_')}.png", Picture(png(image), caption, words)))
    return found


def over_time(time_s: Array, values: dict[str, Array], label: str, error: Array | None = None) -> str:
    """Lines of values (t,) by name against time (t,) in s, as SVG; error (t,): half a band of the first."""
    colors = (plots.CHOSEN, *plots.BY_LENGTH)
    with plots.canvas(plots.WIDTH, 2.7) as (figure, svg):
        axes = figure.add_axes((0.16, 0.17, 0.80, 0.78))
        axes.axhline(0, color=plots.QUIET, linewidth=0.8)
        for k, (name, line) in enumerate(values.items()):
            color, style = colors[k % len(colors)], plots.BY_START[(k // len(colors)) % len(plots.BY_START)]
            axes.plot(time_s, line, style, color=color, linewidth=1.7, label=name)
            if error is not None and k == 0:
                axes.fill_between(time_s, line - error, line + error, color=color, alpha=0.25, linewidth=0)
        axes.set(xlabel="time [s]", ylabel=label, xlim=(time_s[0], time_s[-1]))
        axes.legend(loc="best", ncols=2 if len(values) > 4 else 1)
    return svg()


def tip_way(states: Sequence[ChainState], target: Sequence[float]) -> str:
    """The way of the tip in the planes y-z and x-z, as SVG, with the error at its end."""
    tips = np.array([state.tip_mm for state in states])
    last = states[-1].tip_error_mm
    with plots.canvas(plots.WIDTH, 3.4) as (figure, svg):
        for k, (axis, name) in enumerate(((1, "y"), (0, "x"))):
            axes = figure.add_axes((0.14 + 0.46 * k, 0.14, 0.36, 0.80))
            for state in states:
                middles = state.plates[:, :3, 3]
                axes.plot(middles[:, axis], middles[:, 2], "-", color=plots.GRID, linewidth=1.0)
            axes.plot(tips[:, axis], tips[:, 2], "-o", color=plots.CHOSEN, linewidth=1.6, markersize=2.5)
            axes.errorbar(
                tips[-1, axis], tips[-1, 2], last[2], last[axis], color=plots.INK, linewidth=1.2, capsize=2
            )
            if target:
                axes.plot([target[axis]], [target[2]], "x", color=plots.INK, markersize=8)
            axes.set_aspect("equal", adjustable="datalim")
            axes.invert_yaxis()
            axes.set(xlabel=f"{name} [mm]", ylabel="z, down [mm]" if k == 0 else "")
    return svg()
