"""The legend as objects in the scene, so that renders have it: a ramp, its values, unit, time and pressure.

A bar next to the unit, a child of its root, with texts; a user may move, rotate or scale it. Its colours are
the field material's ramp, unlit, so that light does not change them.
"""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

from ...errors import InputError
from ..preview import materials, skeletons
from ..shared import displays
from ..shared.displays import LEGEND
from ..shared.registration import connected, handler
from ..unit import object as unit_object
from . import field_colours, legend
from . import motion as motion_parts

BAR, HEAD, TICK = "bar", "head", "tick"
"""Roles of the legend's objects: its bar, the text above it, or a value next to it."""
WIDTH, TEXT = 0.08, 0.065
"""Width of the bar and height of its letters, in heights of the bar."""
# Read from +x with z up: the side from which a cut unit shows its inside.
_FACING_X = Matrix(((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))).to_4x4()


def bar_of(root: Any) -> Any | None:
    """The unit's legend, or None."""
    return displays.part(root, LEGEND, BAR)


def show(root: Any) -> Any:
    """Put a legend next to the shown objects, or update it; raises InputError without a motion."""
    motion = motion_parts.motion_of(root)
    if motion is None or not motion_parts.parts(root):
        raise InputError("no motion is shown, so no colours", "On the Model", "show a motion first")
    bar = bar_of(root)
    if bar is None:
        low, high = motion.mesh.nodes.min(axis=0), motion.mesh.nodes.max(axis=0)
        bar = displays.add(root, LEGEND, BAR, bpy.data.meshes.new("Legend"))
        bar.matrix_local = (
            Matrix.Translation((0.0, float(high[1] + 0.4 * (high[1] - low[1])), float(low[2])))
            @ _FACING_X
            @ Matrix.Scale(float(high[2] - low[2]), 4)
        )
    update(root)
    return bar


def hide(root: Any) -> None:
    """Remove the legend from the scene."""
    bar = bar_of(root)
    if bar is not None:
        for obj in (*bar.children, bar):
            displays.remove(obj)


@connected(motion_parts.COLOURED)
def update(root: Any) -> None:
    """Write field, range and colours into the legend, if there is one."""
    bar = bar_of(root)
    motion = motion_parts.motion_of(root)
    if bar is None or motion is None:
        return
    settings = root.mu_motion
    low, high = settings.low, max(settings.high, settings.low + 1e-12)
    heights = np.linspace(0.0, 1.0, legend.PIECES + 1)
    corners = np.array([[x, y, 0.0] for y in heights for x in (0.0, WIDTH)])
    first = 2 * np.arange(legend.PIECES)[:, None]
    values = np.repeat(low + (high - low) * heights, 2)
    shape = skeletons.Skeleton(
        corners,
        faces=(first + np.array([0, 1, 3, 2]),),
        attributes={"share": corners[:, 1]},
        smooth=False,
    )
    skeletons.write(bar.data, shape)
    field_colours.write_colours(root, bar.data, values)
    wanted = field_colours.legend_material_of(root)
    if not bar.data.materials:
        bar.data.materials.append(wanted)
    for text in [child for child in bar.children if child.get(LEGEND) == TICK]:
        displays.remove(text)
    for value in legend.ticks(low, high):
        _put_text(bar, TICK, f"{value:.4g}", (WIDTH + 0.02, (value - low) / (high - low)))
    update_text(root, bpy.context.scene)


def update_text(root: Any, scene: Any) -> None:
    """Write the field's name, the frame's time and pressure, and the legend's remarks."""
    bar, motion = bar_of(root), motion_parts.motion_of(root)
    if bar is not None and motion is not None:
        _put_text(bar, HEAD, "\n".join(legend.lines(root, motion, scene)), (0.0, 1.05))


def _put_text(bar: Any, what: str, text: str, place: tuple[float, float]) -> None:
    """Write a text of the legend; each but the ticks exists once."""
    obj = next((child for child in bar.children if child.get(LEGEND) == what and what != TICK), None)
    if obj is None:
        obj = displays.add(bar.parent, LEGEND, what, bpy.data.curves.new("Legend Text", "FONT"), parent=bar)
        # Not by its location: Blender would draw a line from there to the bar.
        obj.data.offset_x, obj.data.offset_y = place
        obj.data.size = TEXT
        obj.data.align_y = "BOTTOM" if what == HEAD else "CENTER"
        obj.data.materials.append(materials.unlit("MU Legend Text"))
    if obj.data.body != text:
        obj.data.body = text


@handler("frame_change_pre")
def _before_frame(scene, *_):
    for root in unit_object.roots():
        update_text(root, scene)
