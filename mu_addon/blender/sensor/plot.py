"""The sensor's last seconds, drawn over the viewport: its angle with the 95 % band, and its channels.

Every column of pixels shows the extremes of its samples, see `sensing.traces`; the cost of drawing
does not grow with the sensor's rate. It is drawn with the viewport and is not part of a render.
"""

from __future__ import annotations

from typing import Any

import blf
import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Vector

from ...sensing.traces import steady_range, unbroken
from ..results import legend
from ..results.legend import TEXT, ticks, write
from ..shared.registration import overlay
from ..unit import object as unit_object
from . import state as sensor
from . import twin
from .session import Session

COLOURS = (
    (1.0, 0.58, 0.15, 1.0),
    (0.35, 0.70, 1.0, 1.0),
    (0.55, 0.90, 0.45, 1.0),
    (0.95, 0.55, 0.90, 1.0),
    (0.95, 0.90, 0.40, 1.0),
    (0.60, 0.85, 0.90, 1.0),
)
"""Colours of channels, in turn."""
ANGLE = (1.0, 1.0, 1.0, 1.0)
BAND = (1.0, 1.0, 1.0, 0.22)
PAPER, GRID = (0.05, 0.05, 0.06, 0.72), (1.0, 1.0, 1.0, 0.16)
WARNING = (1.0, 0.35, 0.3, 1.0)
HEIGHT, GAP, LEFT, RIGHT, WIDEST = 92, 26, 110, 20, 900
GAP_S = 0.5
"""Pause in s, or five samples', across which no curve is drawn."""


@overlay
def _draw() -> None:
    context = bpy.context
    root = unit_object.active_root(context)
    if root is None:
        return
    scale = context.preferences.system.ui_scale
    if twin.parts(root):
        _over_twin(context, root, scale)
    session = sensor.of(root)
    # It ends with its connection or the replayed file, so that it always shows the present.
    if session is None or not session.running or not root.mu_sensor.plot:
        return
    traces = session.frozen or session.traces
    if traces is not None:
        _plot(context, root.mu_sensor, session, traces, scale)


def shown(settings: Any, session: Session) -> list[tuple[int, str]]:
    """Number and name of the channels that are drawn."""
    hidden = settings.hidden.split(",")
    return [(k, name) for k, name in enumerate(session.channels) if name not in hidden]


def room(context: Any, scale: float) -> tuple[float, float, float]:
    """Left and right end and foot of the plot in pixels: beside toolbar, legend and sidebar."""
    width, left = legend.before_sidebar(context), LEFT * scale
    right = min(width - RIGHT * scale, left + WIDEST * scale)
    return left + 40 * scale, right, legend.room(context, 0).foot


def _plot(context: Any, settings: Any, session: Session, traces: Any, scale: float) -> None:
    left, right, bottom = room(context, scale)
    if right - left < 100 * scale:
        return
    age, low, high = traces.extremes()
    channels = shown(settings, session)
    seconds = traces.step_s * traces.bins
    rate = float(session.watched.status.get("rate_hz") or 0.0)
    runs = unbroken(age, max(GAP_S, 5 / rate if rate else GAP_S, 3 * traces.step_s))
    x = left + (1 + age / seconds) * (right - left)
    n = len(session.channels)
    axes = []
    if channels:
        axes.append(("channels", [(k, name, COLOURS[k % len(COLOURS)]) for k, name in channels], None))
    if np.isfinite(low[n:]).any():
        axes.append(("angle", [(n, "angle in °, with its 95 % band:", ANGLE)], (n + 1, n + 2)))
    for title, curves, band in axes:
        top = bottom + HEIGHT * scale
        places = [k for k, _, _ in curves] + list(band or ())
        known = np.isfinite(low[places]).any()
        ends = (np.nanmin(low[places]), np.nanmax(high[places])) if known else (np.nan, np.nan)
        session.ranges[title] = frame = steady_range(session.ranges.get(title), *map(float, ends))
        upward = (top - bottom) / (frame[1] - frame[0])
        low_y, high_y = (bottom + (values - frame[0]) * upward for values in (low, high))
        _paper((left, right), (bottom, top), frame, seconds, scale, title == axes[0][0])
        if band:
            _between("TRI_STRIP", x, low_y[band[0]], high_y[band[1]], runs, BAND)
        for k, _, colour in curves:
            _between("LINE_STRIP", x, low_y[k], high_y[k], runs, colour)
        at = left
        for k, name, colour in curves:
            text = name if len(age) == 0 else f"{name} {(low[k, -1] + high[k, -1]) / 2:.4g}"
            write(text, at, top + 6 * scale, round(11 * scale), colour)
            at += blf.dimensions(0, text)[0] + 18 * scale
        bottom = top + GAP * scale
    if session.frozen is not None:
        write("plot frozen, recording continues", left, bottom + 4 * scale, round(11 * scale))


def _paper(
    across: tuple[float, float],
    up: tuple[float, float],
    frame: tuple[float, float],
    seconds: float,
    s: float,
    lowest: bool,
) -> None:
    """Draw background, grid, and values: of time below the lowest axes only."""
    (left, right), (bottom, top) = across, up
    _shape("TRI_STRIP", [(left, bottom), (right, bottom), (left, top), (right, top)], PAPER)
    size = round(10 * s)
    lines: list[tuple[float, float]] = []
    for value in ticks(*frame):
        y = bottom + (value - frame[0]) / (frame[1] - frame[0]) * (top - bottom)
        lines += [(left, y), (right, y)]
        write(f"{value:.5g}", left - 6 * s, y - 0.35 * size, size, share=1.0)
    for value in ticks(-seconds, 0.0):
        x = left + (1 + value / seconds) * (right - left)
        lines += [(x, bottom), (x, top)]
        if lowest:
            write(f"{value:g} s", x, bottom - 1.3 * size, size, share=0.5)
    _shape("LINES", lines, GRID)


def _between(kind: str, x: Any, low: Any, high: Any, runs: list[slice], colour: Any) -> None:
    """Draw lines between low and high of each column: a line, a band if they differ, or the area."""
    for run in runs:
        seen = np.isfinite(low[run]) & np.isfinite(high[run])
        if np.count_nonzero(seen) < 2:
            continue
        points = np.repeat(x[run][seen], 2)[:, None].repeat(2, axis=1)
        points[0::2, 1], points[1::2, 1] = low[run][seen], high[run][seen]
        _shape(kind, points, colour)


def _shape(kind: str, points: Any, colour: Any) -> None:
    """Draw points (n, 2) in pixels as lines, a strip of lines or of triangles."""
    # Each time, since drawing text ends blending.
    gpu.state.blend_set("ALPHA")
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.uniform_float("color", colour)
    flat = np.zeros((len(points), 3), np.float32)
    flat[:, :2] = points
    batch_for_shader(shader, kind, {"pos": flat}).draw(shader)
    gpu.state.blend_set("NONE")


def _over_twin(context: Any, root: Any, scale: float) -> None:
    """Draw the twin's state above it: in red where the signal is out of range."""
    part = twin.parts(root)[0]
    if not part.visible_get():
        return
    corners = [Vector(corner) for corner in part.bound_box]
    top = max(corner.z for corner in corners)
    middle = sum(corner.y for corner in corners) / len(corners)
    at = part.matrix_world @ Vector((0.0, middle, 1.12 * top))
    place = location_3d_to_region_2d(context.region, context.region_data, at)
    if place is None:
        return
    state, words = twin.status(root)
    title = "Twin: OUT OF RANGE" if state == twin.OUTSIDE else "Twin"
    colour = WARNING if state == twin.OUTSIDE else TEXT
    size = round(12 * scale)
    for line, text in enumerate((words, title)):
        write(text, place.x, place.y + 1.5 * size * line, size, colour, share=0.5)
