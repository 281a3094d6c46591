"""Arrows on the active unit that are dragged in millimetres, and on its result in kPa: sizes in the view.

A drag is an operator: from an arrow, a menu or the search, with its value in the header, as one undo step.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from collections.abc import Callable
from contextlib import suppress
from typing import Any

import attrs
import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Matrix, Vector

from ...design.dimensions import Dimensions
from ...design.quantity import Description
from ...errors import InputError
from ..live_bending import state as live
from ..results import motion as motion_parts
from ..results.operators import NO_MOTION
from ..shared import timeline, viewports
from ..shared.blender_property import Choice, step_of
from ..shared.displays import editable
from ..shared.registration import at_end, at_start
from ..shared.wording import in_panel, label
from ..unit import object as unit_object
from ..unit.base_classes import UnitPoll
from ..unit.fields import description, field
from ..unit.properties import to_unit

PRESSURE = "pressure"
FINE = 0.1
"""Factor of a drag with Shift held."""


@attrs.frozen
class Handle:
    """An arrow of a parameter of the chambers (or the pressure): place and way in the unit's frame, gain."""

    name: str
    stand: Callable[[Dimensions], tuple[tuple[float, float, float], tuple[float, float, float]]]
    gain: float
    colour: tuple[float, float, float]


HANDLES = {
    "wall": Handle("wall_mm", lambda d: ((0.0, d.R, 1.5 * d.cell), (0.0, 1.0, 0.0)), 1.0, (1.0, 0.55, 0.1)),
    "bladder": Handle(
        "bladder_diameter_mm", lambda d: ((0.0, -d.R, 0.5 * d.cell), (0.0, -1.0, 0.0)), 2.0, (0.2, 0.75, 0.3)
    ),
    "cell": Handle(
        "cell_mm", lambda d: ((0.0, d.bounds[1][1], d.height), (0.0, 0.0, 1.0)), 0.0, (0.25, 0.5, 1.0)
    ),
    PRESSURE: Handle(
        "", lambda d: ((0.0, 0.0, -d.inlet_length - d.cell), (0.0, 0.0, 1.0)), 1.0, (0.95, 0.3, 0.6)
    ),
}
"""A cell is one of `count` along the unit, by which its end moves: a gain of 0 denotes that."""
ITEMS = [
    ("wall", "Wall", "Thickness of the chambers' wall"),
    ("bladder", "Bladder Ø", "Diameter of the bladders, with the cell that they are tied to"),
    ("cell", "Cell", "Cell of the lattice, with the bladders that are tied to it"),
    (PRESSURE, "Pressure", "Pressure of the shown motion: jumps to its frame"),
]


def described(name: str) -> Description:
    """Description of the parameter that a handle drags."""
    return description("chambers", HANDLES[name].name)


def parameter_of(root: Any, name: str) -> tuple[Any, str]:
    """Group and name of the property that a handle drags."""
    return root.mu_unit.chambers, field(root.mu_unit.chambers, described(name))


def pressure_of(root: Any, scene: Any) -> float:
    """Pressure in kPa of a unit bent live, or at the scene's frame of the motion that it shows."""
    if live.is_seen(root):
        return float(root.mu_live.pressure_kPa)
    motion = motion_parts.motion_of(root)
    assert motion is not None
    return float(np.interp(motion_parts.time_of(motion, scene), motion.time_s, motion.pressure_kPa))


def to_pressure(root: Any, scene: Any, kPa: float) -> None:
    """Bend a unit live by a pressure, or go to the motion's frame with it, of several the nearest in time."""
    if live.is_seen(root):
        root.mu_live.pressure_kPa = kPa
        return
    motion = motion_parts.motion_of(root)
    assert motion is not None
    frames = np.arange(scene.frame_start, motion_parts.last_frame(motion, scene) + 1)
    times = motion.time_s[0] + timeline.seconds_at(scene, frames)
    off = np.abs(np.interp(times, motion.time_s, motion.pressure_kPa) - kPa)
    near = frames[off <= off.min() + 0.25 * float(np.ptp(motion.pressure_kPa)) / max(len(frames), 1)]
    scene.frame_set(int(near[np.abs(near - scene.frame_current).argmin()]))


def usable(root: Any | None, name: str) -> bool:
    """Return True if a unit has that handle now: sizes with the design shown, pressure where it is bent."""
    if root is None or not editable(root) or root.mode != "OBJECT" or not root.visible_get():
        return False
    if name == PRESSURE and live.is_seen(root):
        return True
    return bool(unit_object.shows_result(root) == (name == PRESSURE))


class MU_OT_drag(UnitPoll, bpy.types.Operator):
    """Drag this with the mouse; Shift: finely, Ctrl: in whole steps, Esc or a right click: as it was"""

    bl_label = "Drag"
    bl_options = {"REGISTER", "UNDO", "BLOCKING", "GRAB_CURSOR"}

    what: Choice("What", "Quantity that the mouse changes", items=ITEMS)

    @classmethod
    def description(cls, context, properties):
        return next(f"{name}: {text}. {cls.__doc__}" for key, name, text in ITEMS if key == properties.what)

    def invoke(self, context, event):
        root = unit_object.active_root(context)
        if context.region_data is None:
            self.report({"ERROR"}, "Drag in a 3D view")
            return {"CANCELLED"}
        if not usable(root, self.what):
            words = NO_MOTION if motion_parts.motion_of(root) is None else "Show the result first"
            self.report({"ERROR"}, words if self.what == PRESSURE else "Show the preview first")
            return {"CANCELLED"}
        self._root = root
        self._start = self._read(context)
        self._mouse = Vector((event.mouse_region_x, event.mouse_region_y))
        try:
            self._pixels, self._per_pixel = self._scale(context)
        except InputError as error:
            self.report({"ERROR"}, in_panel(str(error)))
            return {"CANCELLED"}
        context.window_manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self._write(context, self._start)
            return self._end(context, {"CANCELLED"})
        if event.type in {"LEFTMOUSE", "RET", "NUMPAD_ENTER"}:
            changed = self._read(context) != self._start
            # The pressure is a frame, which is no state to undo.
            return self._end(context, {"FINISHED" if changed and self.what != PRESSURE else "CANCELLED"})
        if event.type == "MOUSEMOVE":
            moved = Vector((event.mouse_region_x, event.mouse_region_y)) - self._mouse
            along = moved.dot(self._pixels.normalized()) * (FINE if event.shift else 1.0)
            value, step = self._start + along * self._per_pixel, self._step()
            if event.ctrl:
                step *= 10.0
            self._write(context, round(value / step) * step)
            self._tell(context)
        return {"RUNNING_MODAL"}

    def _scale(self, context) -> tuple[Vector, float]:
        """Pixels (2,) on the screen of a millimetre along the arrow, and by how much a pixel changes it."""
        unit = to_unit(self._root.mu_unit)
        at, toward = _place(self._root, self.what, unit.dimensions)
        ends = [
            location_3d_to_region_2d(context.region, context.region_data, end) for end in (at, at + toward)
        ]
        pixels = Vector((0.0, 1.0)) if None in ends else ends[1] - ends[0]
        if pixels.length < 1e-3:  # it points at the eye
            pixels = Vector((0.0, 1.0))
        if self.what == PRESSURE:
            most = live.most_kPa(self._root)
            return pixels, (most or float(np.ptp(motion_parts.motion_of(self._root).pressure_kPa))) / 300.0
        if described(self.what).high <= 20.0:
            # A thin wall follows the mouse as its field in the panel does.
            return pixels, self._step()
        gain = HANDLES[self.what].gain or 1.0 / unit.dimensions.count
        return pixels, gain / pixels.length

    def _step(self) -> float:
        return 0.5 if self.what == PRESSURE else step_of(described(self.what).high) / 100.0

    def _read(self, context) -> float:
        if self.what == PRESSURE:
            return pressure_of(self._root, context.scene)
        return getattr(*parameter_of(self._root, self.what))

    def _write(self, context, value: float) -> None:
        if self.what == PRESSURE:
            to_pressure(self._root, context.scene, value)
        elif self._read(context) != value:
            setattr(*parameter_of(self._root, self.what), value)

    def _tell(self, context) -> None:
        value = self._read(context)
        if self.what == PRESSURE:
            words = f"Pressure: {value:.1f} kPa"
        else:
            words = f"{label(described(self.what))}: {value:.2f} mm"
        trouble = self._root.mu_unit.trouble.partition("\n")[0]
        context.area.header_text_set(f"{words}   {trouble}".rstrip())
        viewports.redraw()

    def _end(self, context, how):
        context.area.header_text_set(None)
        viewports.redraw()
        return how


def _place(root: Any, name: str, dimensions: Dimensions) -> tuple[Vector, Vector]:
    """Position of a unit's handle, and its direction times a millimetre, in the scene."""
    at, toward = HANDLES[name].stand(dimensions)
    world = root.matrix_world
    return world @ Vector(at), world.to_3x3() @ Vector(toward)


class MU_GGT_handles(bpy.types.GizmoGroup):
    """Arrows on the active unit: wall, bladder, cell; on its result the pressure"""

    bl_label = "Sizes of the Unit"
    bl_space_type, bl_region_type = "VIEW_3D", "WINDOW"
    bl_options = {"3D", "PERSISTENT", "SHOW_MODAL_ALL"}

    @classmethod
    def poll(cls, context):
        root = unit_object.root_of(unit_object.active_object(context))
        # Not while something else is painted or edited that stands beside the unit.
        return context.mode == "OBJECT" and root is not None and any(usable(root, name) for name in HANDLES)

    def setup(self, context):
        self.arrows = {}
        for name, handle in HANDLES.items():
            arrow = self.arrows[name] = self.gizmos.new("GIZMO_GT_arrow_3d")
            arrow.target_set_operator("mu.drag").what = name
            arrow.color, arrow.alpha = handle.colour, 0.8
            arrow.color_highlight, arrow.alpha_highlight = (1.0, 1.0, 1.0), 1.0
            arrow.scale_basis, arrow.line_width = 0.6, 3.0

    def draw_prepare(self, context):
        root = unit_object.active_root(context)
        for name, arrow in self.arrows.items():
            arrow.hide = not usable(root, name)
        # A broken rule keeps the last good preview; its arrows wait where they were.
        with suppress(InputError):
            dimensions = to_unit(root.mu_unit).dimensions
            for name, arrow in self.arrows.items():
                at, toward = _place(root, name, dimensions)
                turn = toward.to_track_quat("Z", "Y").to_matrix().to_4x4()
                arrow.matrix_basis = Matrix.Translation(at) @ turn


class MU_WT_size(bpy.types.WorkSpaceTool):
    """Tool in the 3D view's toolbar: drags one of `HANDLES` from anywhere in the view; a click selects."""

    bl_space_type = "VIEW_3D"
    bl_context_mode = "OBJECT"
    bl_idname = "mu.size"
    bl_label = "Size the Unit"
    bl_description = "Drag wall, bladder, cell or pressure of the active Monolithic Unit; Shift: finely"
    bl_icon = "ops.transform.shrink_fatten"
    bl_widget = None
    bl_keymap = (
        ("mu.drag", {"type": "LEFTMOUSE", "value": "CLICK_DRAG", "any": True}, None),
        ("view3d.select", {"type": "LEFTMOUSE", "value": "CLICK"}, {"properties": [("deselect_all", True)]}),
    )

    @staticmethod
    def draw_settings(context, layout, tool):
        """Draw the quantity that the mouse changes, and its value."""
        chosen = tool.operator_properties("mu.drag")
        layout.row(align=True).prop(chosen, "what", expand=True)
        root = unit_object.active_root(context)
        if root is None:
            layout.label(text="Select a Monolithic Unit", icon="INFO")
        elif chosen.what != PRESSURE:
            layout.prop(*parameter_of(root, chosen.what), text="")


@at_start
def _add_tool() -> None:
    if not bpy.app.background:  # where there is no toolbar
        bpy.utils.register_tool(MU_WT_size, after={"builtin.transform"}, separator=True)


@at_end
def _remove_tool() -> None:
    if not bpy.app.background:
        bpy.utils.unregister_tool(MU_WT_size)
