"""A click on a candidate path in the 3D view chooses it, like its button in the panel.

Blender reports a selection by an update of its dependency graph, in which no operator may be called: a timer
makes the choice a moment later.
"""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.handlers import persistent

from ..shared.registration import add_handlers, remove_handlers
from ..unit import object as unit_object
from .operators import selected_candidate

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


def register() -> None:
    """Register handlers that watch the active object."""
    add_handlers(_HANDLERS)


def unregister() -> None:
    """Unregister them."""
    remove_handlers(_HANDLERS)
    if bpy.app.timers.is_registered(_choose):
        bpy.app.timers.unregister(_choose)
