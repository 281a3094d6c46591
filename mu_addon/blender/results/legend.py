"""Key to a motion's colours, drawn over the viewport: ramp, values, unit, time and pressure.

Names are drawn above the shown objects. It is drawn with the viewport and is not part of a render; if the
legend is in the scene (`legend_object`), only names are drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import blf
import bpy
import gpu
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from gpu_extras.batch import batch_for_shader
from mathutils import Vector

from ..shared import displays, viewports
from ..shared.displays import LEGEND
from ..shared.registration import overlay
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from . import field_colours, places
from . import motion as motion_parts

PIECES = 48
"""Number of flat pieces of the drawn ramp."""
WIDTH, HEIGHT, LEFT, BOTTOM = 18, 190, 24, 30
LEAST = 40
"""Least height of a ramp that is drawn, as the sizes above in pixels at a scale of 1."""
LINE = 18
"""Height of a line of text."""
NO_COLOURS = ("This view's shading shows no colours:", "press Show Colours in its header")
AS_SAVED = "its run is not here, coloured as at the frame that was saved"
TEXT = (0.92, 0.92, 0.92, 1.0)


def ticks(low: float, high: float) -> list[float]:
    """Three to seven round numbers from `low` to `high`."""
    step = 10.0 ** np.floor(np.log10((high - low) / 3.0))
    step *= next(f for f in (5, 2, 1) if (high - low) / (f * step) >= 3 or f == 1)
    first = np.ceil(low / step - 1e-9)
    return [float(step * n) + 0.0 for n in np.arange(first, np.floor(high / step + 1e-9) + 1)]


@attrs.frozen
class Room:
    """Where a legend is drawn, in pixels: left end, foot of its ramp, and height of the ramp, 0 for none."""

    left: float
    foot: float
    height: float
    scale: float

    def beside(self, width: float) -> Room:
        """The room to the right of a legend of that width at a scale of 1."""
        return attrs.evolve(self, left=self.left + width * self.scale)


def room(context: Any, count: int) -> Room:
    """Room for a legend with so many lines of text, clear of what Blender draws over a viewport.

    That are the toolbar, the redo panel and the asset shelf below, and the headers and texts above.
    """
    scale, area, region = context.preferences.system.ui_scale, context.area, context.region
    below = [
        other.y + other.height - region.y
        for other in area.regions
        if other.type in ("HUD", "ASSET_SHELF", "ASSET_SHELF_HEADER") and other.height > 1
    ]
    # Above the foot's line of words, see `live_bending.words`.
    foot = max([BOTTOM * scale, *(top + 10 * scale for top in below)]) + 30 * scale
    overlay = area.spaces.active.overlay
    texts = 2 * overlay.show_text + 7 * overlay.show_stats if overlay.show_overlays else 0
    top = below_headers(area, region) - (texts + 1) * LINE * scale
    height = min(HEIGHT * scale, top - foot - (14 + LINE * count) * scale)
    return Room(beside_tools(area) + LEFT * scale, foot, height if height >= LEAST * scale else 0.0, scale)


def lines(root: Any, motion: Any, scene: Any) -> list[str]:
    """Lines of the legend: field, time and pressure, contact forces, and a note on stale results.

    A unit that is not the active one is named.
    """
    field = field_colours.BY_NAME[root.mu_motion.field]
    time = motion_parts.time_of(motion, scene)
    found = [field.title]
    if root != unit_object.active_root(bpy.context):
        found.insert(0, root.name)
    other = studies.run_by_key(root, root.mu_unit.study.against)
    if field.name == motion_parts.DIFFERENCE and other is not None:
        itself = other.folder == motion.folder.parent
        found.append("the run compared with itself" if itself else f"to the run {other.title}")
    known = motion.is_reached(time)
    found.append(motion_parts.moment(motion, scene) + ("" if known else ": not solved yet"))
    found += [motion.so_far] if motion.so_far else []
    for contact in studies.contact_forces(root):
        force = float(np.interp(time, contact.time_s, contact.force_N))
        found.append(f"{contact.name}: {force:.2f} N")
    findings = studies.findings(root)
    if findings is None or findings.stale:
        found.append("stale: of other parameters")
    elif findings.caveat:
        found.append(findings.caveat.partition(":")[0])
    return found


@overlay
def _draw() -> None:
    context = bpy.context
    root = subject(context)
    if root is None or not root.mu_motion.legend:
        return
    motion = motion_parts.motion_of(root)
    if motion is None:
        texts = [f"{root.name}: {AS_SAVED}", *(() if viewports.shows_colours(context) else NO_COLOURS)]
        above(texts, attrs.evolve(room(context, len(texts)), height=0.0))
        return
    shown = places.seen(root)
    scale = context.preferences.system.ui_scale
    size = round(12 * scale)
    in_scene = any(part.visible_get() for part in displays.parts(root, LEGEND))
    if not in_scene:
        texts = lines(root, motion, context.scene)
        place = room(context, len(texts))
        if any(root.mu_motion.field in part.data.attributes for part in shown):
            field_ramp(root, (root.mu_motion.low, root.mu_motion.high), place)
        above(texts, place)
    _names(context, root, motion, size)


def above(texts: Sequence[str], place: Room) -> None:
    """Write lines above the ramp."""
    foot = place.foot + place.height + (14 * place.scale if place.height else 0.0)
    for line, text in enumerate(reversed(texts)):
        write(text, place.left, foot + LINE * place.scale * line, round(12 * place.scale))


def subject(context: Any) -> Any | None:
    """Unit of the legend: the active one, or another if that shows none."""
    return unit_object.first_that(context, places.seen)


def beside_tools(area: Any) -> float:
    """Width in pixels of the toolbar over the viewport's left, 0 without one."""
    tools = next((region for region in area.regions if region.type == "TOOLS"), None)
    return 0.0 if tools is None or tools.width <= 1 else float(tools.width)


def before_sidebar(context: Any) -> float:
    """Width in pixels of the viewport to the left of the sidebar over it."""
    sidebar = next((region for region in context.area.regions if region.type == "UI"), None)
    over = context.preferences.system.use_region_overlap and sidebar is not None and sidebar.width > 1
    return float(context.region.width - (sidebar.width if over else 0))


def field_ramp(root: Any, ends: tuple[float, float], place: Room) -> None:
    """Draw a unit's ramp with the values of a range, or that this view shows no colours."""
    low, high = ends
    if not viewports.shows_colours(bpy.context):
        above(NO_COLOURS, attrs.evolve(place, height=max(place.height - 4 * LINE * place.scale, 0.0)))
    elif high > low:
        marks = [((value - low) / (high - low), f"{value:.4g}") for value in ticks(low, high)]
        ramp(field_colours.colours(root, np.linspace(low, high, PIECES + 1), ends), marks, place)


def ramp(colours: Any, marks: list[tuple[float, str]], place: Room) -> None:
    """Draw colours (PIECES + 1, 4), linear, from below to above; marks: share of the height, and text."""
    if not place.height:
        return
    x0, x1 = place.left, place.left + WIDTH * place.scale
    heights = place.foot + place.height * np.linspace(0.0, 1.0, PIECES + 1)
    corners = [(x, y) for y in heights for x in (x0, x1)]
    corner = np.array([[0, 1, 3], [0, 3, 2]], np.int32)
    triangles = np.concatenate([corner + 2 * piece for piece in range(PIECES)])
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    data = {"pos": corners, "color": display(np.repeat(colours, 2, axis=0)).tolist()}
    batch_for_shader(shader, "TRIS", data, indices=triangles).draw(shader)
    size = round(11 * place.scale)
    last = -size
    for share, text in sorted(marks):
        y = place.foot + place.height * share - 0.35 * size
        # In a low view only those that do not cover each other.
        if y - last >= size:
            write(text, x1 + 6 * place.scale, y, size)
            last = y


def display(linear: Any) -> Any:
    """Colours (c, 4) for a screen, sRGB and opaque, from linear ones."""
    linear = np.clip(linear, 0.0, 1.0)
    shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    shown[:, 3] = 1.0
    return shown


def _names(context: Any, root: Any, motion: Any, size: int) -> None:
    """The name of each motion above it."""
    top = float(motion.mesh.nodes[:, 2].max())
    middle = float(motion.mesh.nodes[:, 1].mean())
    for name, what in motion_parts.shown(root):
        part = motion_parts.one(root, name, what)
        place, base = (
            location_3d_to_region_2d(
                context.region, context.region_data, part.matrix_world @ Vector((0.0, middle, z))
            )
            for z in (1.32 * top, 0.0)
        )
        if place is not None:
            y = place.y
            if base is not None:
                y = name_height(y, base.y, below_headers(context.area, context.region) - 1.5 * size)
            text = motion_parts.owner(name) + (", print" if what == motion_parts.PRINT else "")
            write(text, place.x, y, size, share=0.5)


def name_height(above: float, base: float, limit: float) -> float:
    """Height of a name `above` an object whose foot is at `base`, at most `limit`.

    All in pixels. If the foot is above the limit, too, the name stays with the object.
    """
    return min(above, limit) if base < limit else above


def below_headers(area: Any, region: Any) -> float:
    """Height in pixels of a viewport below the headers over its upper end."""
    middle = region.y + region.height / 2
    lowest = [
        other.y
        for other in area.regions
        if other.type in ("HEADER", "TOOL_HEADER") and other.height > 1 and other.y > middle
    ]
    return float(min([*lowest, region.y + region.height]) - region.y)


def cross(x: float, y: float, side: float, colour: tuple[float, ...]) -> None:
    """Draw a ring of `side` pixels around x, y and the cross in it."""
    angle = np.linspace(0.0, 2.0 * np.pi, 25)
    ring = np.stack([x + side * np.cos(angle), y + side * np.sin(angle)], axis=1)
    pairs = [*np.repeat(ring, 2, axis=0)[1:-1].tolist()]
    pairs += [(x - 2 * side, y), (x - side, y), (x + side, y), (x + 2 * side, y)]
    pairs += [(x, y - 2 * side), (x, y - side), (x, y + side), (x, y + 2 * side)]
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.line_width_set(2.0)
    shader.uniform_float("color", colour)
    batch_for_shader(shader, "LINES", {"pos": pairs}).draw(shader)
    gpu.state.line_width_set(1.0)


def write(
    text: str, x: float, y: float, size: int, colour: tuple[float, ...] = TEXT, share: float = 0.0
) -> None:
    """Draw a text with a shadow, its lower edge at y in pixels, and a share of its width left of x."""
    blf.size(0, size)
    x -= share * blf.dimensions(0, text)[0]
    blf.color(0, *colour)
    blf.enable(0, blf.SHADOW)
    blf.shadow(0, 5, 0.0, 0.0, 0.0, 1.0)
    blf.position(0, x, y, 0)
    blf.draw(0, text)
    blf.disable(0, blf.SHADOW)
