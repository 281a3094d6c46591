"""The chosen candidate path and the one under the mouse, drawn where they truly run, in the colour of J.

The bars of all candidates stand side by side beside the lattice, since in their true place they would cover
each other. A click on one chooses it. In the sidebar's list Blender tells what the mouse is over only when it
shows a tooltip.
"""

from contextlib import suppress
from typing import Any

import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Vector

from ...design.anchors import anchor_points, window
from ...errors import InputError
from ..results import legend
from ..shared import viewports
from ..shared.registration import timer
from ..shared.wording import path_symbol
from ..unit import object as unit_object
from ..unit.properties import to_unit
from . import candidates, ranking
from . import legend as paths

REACH = 7.0
"""Distance in pixels of the mouse from the middle of a bar, at a scale of 1."""
WIDTH, EDGE = 5.0, 3.0
"""Width in pixels of the drawn path, and of the white edge around it."""


SHOWN_S = 4.0
"""Seconds for which a path is drawn that the list's tooltip is shown of."""

_listed = ""


def point_out(name: str) -> None:
    """Draw a path in its true place for some seconds, as if the mouse were over its bar."""
    global _listed
    _listed = name
    _let_go.cancel()
    _let_go.soon(SHOWN_S)
    viewports.redraw_regions("WINDOW")


@timer()
def _let_go() -> None:
    global _listed
    _listed = ""
    viewports.redraw_regions("WINDOW")


def nearest(mouse: Any, bars: dict[str, Any], reach: float) -> str:
    """Name of the line, of points (k, 2), that is nearest to the mouse (2,) and within reach, or ""."""
    found = {name: _distance(np.asarray(mouse, float), np.asarray(points)) for name, points in bars.items()}
    best = min(found, key=found.__getitem__, default="")
    return best if best and found[best] <= reach else ""


def _distance(mouse: Any, points: Any) -> float:
    """Least distance of a point (2,) from a line through points (k, 2)."""
    start, along = points[:-1], np.diff(points, axis=0)
    length = np.maximum((along**2).sum(axis=1), 1e-12)
    share = np.clip(((mouse - start) * along).sum(axis=1) / length, 0.0, 1.0)
    return float(np.linalg.norm(start + share[:, None] * along - mouse, axis=1).min())


def true_place(root: Any, name: str) -> Any:
    """Points (k, 3) in the scene of the anchors along a path; raises InputError for one the unit lacks."""
    unit = to_unit(root.mu_unit)
    points = anchor_points(unit)[list(window(unit, name).indices)]
    return [root.matrix_world @ Vector(point) for point in points]


def _on_screen(context: Any, points: Any) -> Any | None:
    """Points (k, 2) in pixels of points (k, 3) in the scene; None if one is behind the eye."""
    seen = [location_3d_to_region_2d(context.region, context.region_data, point) for point in points]
    return None if None in seen else np.array(seen)


class MU_GT_candidate(bpy.types.Gizmo):
    """All bars of the active unit: the one under the mouse shows its true place"""

    __slots__ = ("choice", "path")

    def setup(self):
        self.path = ""
        self.choice = self.target_set_operator("mu.path")

    def test_select(self, context, location):
        root = unit_object.active_root(context)
        bars = {}
        for name, tube in paths.seen(root) if root is not None else ():
            vertices = tube.data.vertices
            ends = [tube.matrix_world @ vertices[k].co for k in (0, len(vertices) - 1)]
            bar = _on_screen(context, ends)
            if bar is not None:
                bars[name] = bar
        found = nearest(location, bars, REACH * context.preferences.system.ui_scale)
        if found != self.path:
            self.path = self.choice.name = found
            context.region.tag_redraw()
        return 0 if found else -1

    def draw(self, context):
        root = unit_object.active_root(context)
        pointed = (self.path if self.is_highlight else "") or _listed
        for name in dict.fromkeys([root.mu_unit.path if root is not None else "", pointed]):
            if name:
                _draw_path(context, root, name, named=name == pointed)


def _draw_path(context: Any, root: Any, name: str, named: bool) -> None:
    """Draw a path where it runs, in the colour of its bar; named: with its name and J."""
    line = None
    with suppress(InputError):
        line = _on_screen(context, true_place(root, name))
    tube = candidates.candidate(root, name)
    if line is None or tube is None:
        return
    scale = context.preferences.system.ui_scale
    pairs = np.repeat(line, 2, axis=0)[1:-1].tolist()
    shader = gpu.shader.from_builtin("POLYLINE_UNIFORM_COLOR")
    batch = batch_for_shader(shader, "LINES", {"pos": [(x, y, 0.0) for x, y in pairs]})
    shader.uniform_float("viewportSize", gpu.state.viewport_get()[2:])
    for width, colour in (
        (WIDTH + 2.0 * EDGE, legend.TEXT),
        (WIDTH, tuple(legend.display(np.array([tube.data.materials[0].diffuse_color]))[0])),
    ):
        shader.uniform_float("lineWidth", width * scale)
        shader.uniform_float("color", colour)
        batch.draw(shader)
    if not named:
        return
    size, known = round(13 * scale), ranking.known(root)
    words = path_symbol(name)
    if mean := known.mean(name):
        words += f": {mean} mm{', stale' if known.stale else ''}"
    x, y = line[-1]
    legend.write(words, x + 1.2 * size, y, size)


class MU_GGT_candidates(bpy.types.GizmoGroup):
    """Candidate paths of the active unit"""

    bl_label = "Candidate Paths"
    bl_space_type, bl_region_type = "VIEW_3D", "WINDOW"
    bl_options = {"PERSISTENT", "SCALE"}

    @classmethod
    def poll(cls, context):
        root = unit_object.active_root(context)
        return context.mode == "OBJECT" and root is not None and bool(paths.seen(root))

    def setup(self, context):
        self.gizmos.new(MU_GT_candidate.bl_idname)
