"""Choose the sensor path that the waveguide follows: by its button, or by a click on it in the 3D view.

Blender reports a selection by an update of its dependency graph, in which no operator may be called, so a
timer makes the choice a moment later.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

from typing import Any

import bpy
from bpy.app.handlers import persistent
from bpy.props import StringProperty

from ...design.anchors import window
from ..shared import updates
from ..shared.displays import PART
from ..shared.registration import add_handlers, remove_handlers
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator
from ..unit.properties import to_unit
from . import hover
from .candidates import CANDIDATE


class MU_OT_path(UnitOperator, bpy.types.Operator):
    """Lay the waveguide along this path"""

    bl_idname = "mu.path"
    bl_label = "Choose Sensor Path"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(
        name="Path",
        description="Name of a path, alpha1 ..; `none` removes the waveguide, "
        "nothing takes the candidate that is selected in the viewport",
    )

    @classmethod
    def description(cls, context, properties):
        """Text of the tooltip, which also shows the path in its true place."""
        root = unit_object.active_root(context)
        if root is not None and root.mu_unit.candidates:
            hover.point_out(root.mu_unit.path if properties.name == "none" else properties.name)
        return cls.__doc__ if properties.name != "none" else "Remove the waveguide along this path"

    def act(self, context, root):
        name = self.name or selected_candidate(context)
        if name and name != "none":
            name = window(to_unit(root.mu_unit), name).name
        with updates.paused():
            root.mu_unit.path = "" if name == "none" else name
        unit_object.rebuild(root)


def selected_candidate(context) -> str:
    """Name of the candidate path that is the active object, or ""."""
    obj = unit_object.active_object(context)
    part = obj.get(PART, "") if obj else ""
    return part.removeprefix(CANDIDATE) if part.startswith(CANDIDATE) else ""


_last = 0
"""Number of the object that was active at the last check: only another one is a click."""


_restoring = False
"""True during undo or redo: an object they make active was clicked before."""


def _active() -> int:
    found = unit_object.active_object(bpy.context)
    return 0 if found is None else int(found.session_uid)


@persistent
def _begin_restoring(*_: Any) -> None:
    global _restoring
    _restoring = True


@persistent
def _restored(*_: Any) -> None:
    global _restoring, _last
    _restoring, _last = False, _active()


@persistent
def _updated(*_: Any) -> None:
    global _last
    if _restoring or _active() == _last:
        return
    _last = _active()
    if selected_candidate(bpy.context) and not bpy.app.timers.is_registered(_choose):
        bpy.app.timers.register(_choose, first_interval=0.0)


def _choose() -> None:
    windows = bpy.context.window_manager.windows
    with bpy.context.temp_override(window=windows[0]) if windows else bpy.context.temp_override():
        choose_active()


def choose_active() -> None:
    """Choose the candidate path that is the active object, with one undo step."""
    context = bpy.context
    if unit_object.active_object(context) is None or context.mode != "OBJECT":
        return
    name, root = selected_candidate(context), unit_object.root_of(context.object)
    if name and root is not None and root.mu_unit.path != name and bpy.ops.mu.path.poll():
        bpy.ops.mu.path("EXEC_DEFAULT", True, name=name)


_HANDLERS = {
    "depsgraph_update_post": _updated,
    **dict.fromkeys(("undo_pre", "redo_pre"), _begin_restoring),
    **dict.fromkeys(("undo_post", "redo_post", "load_post"), _restored),
}


_add_class, _remove_class = bpy.utils.register_classes_factory((MU_OT_path,))


def register() -> None:
    """Register the operator, and handlers that watch the active object."""
    _add_class()
    add_handlers(_HANDLERS)


def unregister() -> None:
    """Unregister them."""
    remove_handlers(_HANDLERS)
    if bpy.app.timers.is_registered(_choose):
        bpy.app.timers.unregister(_choose)
    _remove_class()
