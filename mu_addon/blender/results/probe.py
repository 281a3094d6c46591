"""The probe: a field's value under the mouse, with unit, time and position, and its maximum's mark."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from typing import Any, ClassVar

import blf
import bpy
import numpy as np
from bpy_extras.view3d_utils import (
    location_3d_to_region_2d,
    region_2d_to_origin_3d,
    region_2d_to_vector_3d,
)

from ..shared.registration import at_end, overlay
from ..unit import object as unit_object
from ..unit.base_classes import UnitPoll
from . import field_colours, legend, places
from . import motion as motion_parts
from .operators import NO_MOTION

SIDE = 5
"""Half the width of the mark at the largest value, in pixels at a scale of 1."""
MARK = (1.0, 0.16, 0.16, 1.0)


def value_text(field: field_colours.Field, value: float | None) -> str:
    """A field's value with its unit."""
    if value is None:
        return f"{field.label}: not known here"
    return f"{field.label}: {value:.4g} {field.unit}".rstrip()


def lines(root: Any, place: places.Place, scene: Any) -> list[str]:
    """Lines of the probe: value, owner, position at rest and now, time and pressure."""
    motion = motion_parts.motion_of(root)
    name = place.part[motion_parts.MOTION].partition("|")[0]
    whose = motion_parts.owner(name)
    found = [value_text(field_colours.BY_NAME[root.mu_motion.field], place.value)]
    for what, at in (("at rest", place.rest_mm), ("now", place.now_mm)):
        x, y, z = (float(v) + 0.0 for v in np.round(at, 2))
        found.append(f"{what}: x {x:.1f}, y {y:.1f}, z {z:.1f} mm")
    if motion is not None:
        found.append(f"{whose}, {motion_parts.moment(motion, scene)}")
    return found


class MU_OT_probe(UnitPoll, bpy.types.Operator):
    """Read the field under the mouse: value, place and time. Esc or a right click ends it"""

    bl_label = "Probe"
    bl_options = {"REGISTER"}

    running: ClassVar[Any] = None
    """The running probe; there is one at a time."""

    @classmethod
    def trouble(cls, root):
        shown = "" if places.seen(root) else "Show a motion first: Results, On the Model"
        return NO_MOTION if motion_parts.motion_of(root) is None else shown

    def invoke(self, context, event):
        if context.area is None or context.area.type != "VIEW_3D":
            self.report({"ERROR"}, "Probe in a 3D view")
            return {"CANCELLED"}
        if MU_OT_probe.running is not None:
            MU_OT_probe.running.end(context)
            return {"CANCELLED"}
        MU_OT_probe.running = self
        self.uuid = unit_object.active_root(context).mu_unit.uuid
        self.surfaces, self.state, self.found, self.mouse = None, None, None, (0, 0)
        self.ended = False
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Probe: move over the unit. Esc: end")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        root = unit_object.by_uuid(self.uuid)
        if self.ended or root is None or event.type in {"ESC", "RIGHTMOUSE"}:
            self.end(context)
            return {"CANCELLED"}
        # All other input works as usual: orbit, play, other fields.
        if event.type in {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE"}:
            self.look(context, root, event)
        return {"PASS_THROUGH"}

    def look(self, context, root, event):
        """Find the point under the mouse."""
        area = next(
            (a for a in context.window.screen.areas if _inside(a, event.mouse_x, event.mouse_y)), None
        )
        if area is None or area.type != "VIEW_3D":
            self.found = None
            return
        region = next(r for r in area.regions if r.type == "WINDOW")
        self.mouse = event.mouse_x - region.x, event.mouse_y - region.y
        settings = root.mu_motion
        shown = [part.name_full for part in places.seen(root)]
        state = context.scene.frame_current_final, settings.field, settings.low, settings.high, shown
        if state != self.state:
            self.surfaces, self.state = places.Surfaces(root), state
        view = area.spaces.active.region_3d
        origin = region_2d_to_origin_3d(region, view, self.mouse)
        self.found = self.surfaces.hit(origin, region_2d_to_vector_3d(region, view, self.mouse))
        self.area = area
        area.tag_redraw()

    def end(self, context):
        """Remove the text."""
        self.ended, self.found = True, None
        MU_OT_probe.running = None
        context.workspace.status_text_set(None)
        for area in context.window.screen.areas if context.window else ():
            area.tag_redraw()


def _inside(area: Any, x: int, y: int) -> bool:
    return bool(area.x <= x < area.x + area.width and area.y <= y < area.y + area.height)


@overlay
def _draw() -> None:
    context = bpy.context
    root = legend.subject(context)
    if root is None:
        return
    size = round(12 * context.preferences.system.ui_scale)
    if root.mu_motion.marker and motion_parts.motion_of(root) is not None:
        _mark(context, root, size)
    probe = MU_OT_probe.running
    if probe is None or probe.found is None or probe.area != context.area:
        return
    x, y = probe.mouse
    text = lines(root, probe.found, context.scene)
    for line, words in enumerate(reversed(text)):
        legend.write(words, x + 1.5 * size, y + 1.2 * size + 1.5 * size * line, size)


def _mark(context: Any, root: Any, size: int) -> None:
    """Draw a cross where the field is largest at this frame, and its value."""
    place = places.largest(root)
    at = place and location_3d_to_region_2d(context.region, context.region_data, place.world)
    if place is None or at is None:
        return
    side = SIDE * context.preferences.system.ui_scale
    legend.cross(at.x, at.y, side, MARK)
    field = field_colours.BY_NAME[root.mu_motion.field]
    text = f"largest {place.value:.4g} {field.unit}".rstrip()
    # To the left of a mark that is beside the sidebar.
    x, width = at.x + 2 * side, blf.dimensions(0, text)[0]
    x = x if x + width < legend.before_sidebar(context) else at.x - 2 * side - width
    legend.write(text, x, at.y - 0.35 * size, size)


@at_end
def _stop() -> None:
    MU_OT_probe.running = None
