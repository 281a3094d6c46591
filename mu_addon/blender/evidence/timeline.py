"""Measured and simulated motion together on the timeline: a dial of the angle, markers on the unit.

Objects are identified by the custom property `EVIDENCE`: "SERIES|WHAT", where SERIES is measured, model or
extended, and WHAT the angle, a marker, the dial or the key to the colours. Their parent is a hidden child of
the unit's root: Blender draws a dashed line to a visible parent.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import bpy
import numpy as np

from ..preview import materials, skeletons
from ..shared import displays, timeline
from ..shared.compat import set_curve
from ..shared.displays import EVIDENCE
from ..unit.properties import to_unit
from .state import Course

EXPERIMENT = "mu_experiment"
START = "mu_starts_s"
ANGLE, DIAL, FRAME = "angle", "dial", "|frame"
LOOKS = {
    "measured": ("Measured", "MU Measured"),
    "model": ("Model", "MU Model"),
    "extended": ("Extended Model", "MU Extended Model"),
}
RANGE_DEG = 70
"""Half of the dial's range."""


def parts(root: Any) -> list[Any]:
    """Objects that show a unit's measured motion."""
    return [child for child in root.children_recursive if child.get(EVIDENCE)]


def shown(root: Any) -> str:
    """Name of the experiment that is shown, or ""."""
    return next((part[EXPERIMENT] for part in parts(root)), "")


def hide(root: Any) -> None:
    """Remove the measured motion from the scene."""
    for part in parts(root):
        displays.remove(part)


def show(root: Any, name: str, course: Course, scene: Any) -> None:
    """Show an experiment on the scene's timeline, in its time, replacing any other."""
    hide(root)
    frame = _linked(root, FRAME, "Evidence", None)
    frame.hide_viewport = frame.hide_render = True
    d = to_unit(root.mu_unit).dimensions
    frames = timeline.frames_at(scene, course.time_s - course.time_s[0])
    long = 0.55 * d.height
    # The dial is below the unit, since other motions stand beside it, and off the plane of the grid, which
    # would show through it.
    pivot = (0.02 * long, 0.0, -d.inlet_length - 1.45 * long)
    angles = _angles(frame, course, frames, long)
    for part in angles:
        part.location = pivot
    made = [frame, *angles, *_markers(frame, course, frames, 0.09 * d.cell)]
    for part in made:
        part[EXPERIMENT], part[START] = name, float(course.time_s[0])
    scene.frame_end = max(scene.frame_end, int(np.ceil(frames[-1])))


def _angles(frame: Any, course: Course, frames: Any, long: float) -> list[Any]:
    """A dial with a needle for each series, and the key to the colours, around the pivot of the needles."""
    if not any("angle_deg" in channels for channels in course.series.values()):
        return []
    made = [_part(frame, "|" + DIAL, "Angle Dial", *_dial(long), "MU Dial")]
    for degrees in range(-60, 61, 30):
        at = _on_dial(degrees, 1.14 * long)
        made.append(_text(frame, f"|{degrees}", f"{degrees}°", 0.09 * long, at))
    for row, (series, channels) in enumerate(course.series.items()):
        title, colour = LOOKS[series]
        key = np.array([0.0, 0.3 * long, (0.02 - 0.14 * row) * long])
        made.append(_text(frame, f"{series}|key", title, 0.1 * long, key, colour, middle=False))
        if "angle_deg" not in channels:
            continue
        needle = _part(frame, f"{series}|{ANGLE}", f"{title} Angle", *_needle(long, row), colour)
        # Positive toward +y: as a right-hand turn about x it is negative.
        _animate(needle, "rotation_euler", {0: -np.radians(channels["angle_deg"])}, frames)
        made.append(needle)
    return made


def _markers(frame: Any, course: Course, frames: Any, radius: float) -> list[Any]:
    """A ball for each marker as measured, a ring around it for each model's.

    One that was not seen along x moves in the plane of bending.
    """
    made, whole = [], skeletons.ball(radius)
    ball = whole.vertices, [face for faces in whole.faces for face in faces]
    for row, (series, channels) in enumerate(course.series.items()):
        title, colour = LOOKS[series]
        numbers = sorted({int(c[6 : c.index("_")]) for c in channels if c.startswith("marker")})
        shape = _ring((1.2 + 0.6 * row) * radius) if row else ball
        for number in numbers:
            places = {i: channels.get(f"marker{number}_{a}_mm") for i, a in enumerate("xyz")}
            known = {i: values for i, values in places.items() if values is not None}
            part = _part(frame, f"{series}|marker {number}", f"{title} Marker {number}", *shape, colour)
            _animate(part, "location", known, frames)
            made.append(part)
    return made


def reading(root: Any, scene: Any) -> tuple[float, dict[str, float]]:
    """Time in s and the angle in degrees by series, at the scene's frame."""
    found, start = {}, 0.0
    for part in parts(root):
        series, _, what = part[EVIDENCE].partition("|")
        if what == ANGLE and not part.hide_viewport:
            found[series] = -float(np.degrees(part.rotation_euler[0]))
        start = part[START]
    return start + timeline.seconds_at(scene), {series: found[series] for series in LOOKS if series in found}


def _animate(part: Any, path: str, channels: dict[int, Any], frames: Any) -> None:
    """Animate channels of a property by values (n,); where one is missing, the object is hidden."""
    values = np.array(list(channels.values()))
    seen = np.isfinite(values).all(axis=0)
    for index, row in zip(channels, values, strict=True):
        if seen.any():
            set_curve(part, path, index, frames[seen], row[seen])
    if not seen.all():
        changes = np.flatnonzero(np.diff(seen, prepend=not seen[0]))
        for path_hidden in ("hide_viewport", "hide_render"):
            set_curve(part, path_hidden, -1, frames[changes], ~seen[changes], constant=True)


def _part(frame: Any, mark: str, title: str, vertices: Any, faces: Any, colour: str) -> Any:
    mesh = bpy.data.meshes.new(title)
    mesh.from_pydata([tuple(map(float, v)) for v in vertices], [], [tuple(map(int, f)) for f in faces])
    materials.assign(mesh, colour)
    return _linked(frame, mark, title, mesh)


def _linked(parent: Any, mark: str, title: str, mesh: Any) -> Any:
    part = displays.add(displays.root_above(parent), EVIDENCE, mark, mesh, title, parent)
    part.hide_select = True
    return part


def _text(
    frame: Any, mark: str, text: str, size: float, at: Any, colour: str = "MU Dial", middle: bool = True
) -> Any:
    """Letters as a mesh in the plane of bending, read from +x."""
    curve = bpy.data.curves.new(text, "FONT")
    curve.body, curve.size = text, size
    curve.align_x, curve.align_y = "CENTER" if middle else "LEFT", "CENTER"
    written = bpy.data.objects.new(text, curve)
    mesh = bpy.data.meshes.new_from_object(written)
    bpy.data.objects.remove(written)
    bpy.data.curves.remove(curve)
    flat = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", flat.ravel())
    mesh.vertices.foreach_set("co", (flat[:, [2, 0, 1]] + np.asarray(at, np.float32)).ravel())
    mesh.materials.clear()
    materials.assign(mesh, colour)
    return _linked(frame, mark, text, mesh)


def _on_dial(degrees: float, radius: float) -> Any:
    a = np.radians(degrees)
    return np.array([0.0, radius * np.sin(a), radius * np.cos(a)])


def _dial(long: float) -> tuple[Any, Any]:
    """Ticks every 10 degrees, longer every 30, and an arc through their feet, as thin strips."""
    vertices: list[Any] = []
    faces: list[Any] = []

    def strip(one: Any, other: Any, wide: float) -> None:
        along = (other - one) / np.linalg.norm(other - one)
        aside = 0.5 * wide * np.array([0.0, -along[2], along[1]])
        first = len(vertices)
        vertices.extend([one - aside, other - aside, other + aside, one + aside])
        faces.append(range(first, first + 4))

    for degrees in range(-60, 61, 10):
        outer = 1.06 if degrees % 30 == 0 else 1.03
        strip(_on_dial(degrees, long), _on_dial(degrees, outer * long), 0.012 * long)
    rim = [_on_dial(degrees, long) for degrees in range(-RANGE_DEG, RANGE_DEG + 1, 5)]
    for one, other in pairwise(rim):
        strip(one, other, 0.01 * long)
    return vertices, faces


def _needle(long: float, row: int) -> tuple[Any, Any]:
    """A needle along z; later ones are shorter and in front, so that none hides another."""
    wide, x = 0.08 * long, 0.01 * long * (row + 1)
    tip = (1.0 - 0.25 * row) * long
    vertices = [(x, -wide / 2, 0.0), (x, wide / 2, 0.0), (x, 0.0, tip), (x, 0.0, -0.12 * long)]
    return vertices, [(0, 1, 2), (1, 0, 3)]


def _ring(radius: float, around: int = 32) -> tuple[Any, Any]:
    """A flat ring in the plane of bending."""
    turn = np.linspace(0.0, 2 * np.pi, around, endpoint=False)
    circle = np.stack([np.zeros(around), np.cos(turn), np.sin(turn)], axis=1)
    vertices = radius * np.concatenate([circle, 0.75 * circle])
    faces = [(i, (i + 1) % around, around + (i + 1) % around, around + i) for i in range(around)]
    return vertices, faces
