"""Previews that follow their parameters: at most one rebuild every few hundredths of a second.

Undo, redo and loading can bring back parameters whose preview was rebuilt later than the undo step was
taken; handlers look for such units and rebuild them.
"""

from __future__ import annotations

import time
from contextlib import contextmanager

import bpy
from bpy.app.handlers import persistent

from ..shared import handlers

INTERVAL_S = 0.03

_held = 0
_flushed = 0.0
_pending: set[str] = set()


@contextmanager
def held():
    """While the body sets parameters, none of them starts a rebuild; the body does that itself."""
    global _held
    _held += 1
    try:
        yield
    finally:
        _held -= 1


def holds() -> bool:
    """Whether parameters are being set that must start no rebuild."""
    return _held > 0


def schedule(root) -> None:
    """Have the preview of a unit rebuilt soon; at once in background, where timers never fire."""
    if _held or not root.mu_unit.uuid:
        return
    if bpy.app.background:
        _rebuild(root)
        return
    _pending.add(root.mu_unit.uuid)
    if not bpy.app.timers.is_registered(_flush):
        # The first change is followed at once, those that come after it while a slider moves at intervals.
        wait = max(0.0, INTERVAL_S - (time.monotonic() - _flushed))
        bpy.app.timers.register(_flush, first_interval=wait)


def show(root) -> None:
    """Show the parts that belong to what the user wants to see, preview or solid."""
    from . import object as unit_object

    if not _held and root.mu_unit.uuid:
        unit_object.show_parts(root)


def _flush():
    from . import object as unit_object

    global _flushed
    pending, names = set(_pending), []
    _pending.clear()
    # By UUID: undo may have deleted the object that asked, or brought back another in its place.
    for root in unit_object.roots():
        if root.mu_unit.uuid in pending:
            _rebuild(root)
            names.append(root.name)
    if names:
        redraw()
    _flushed = time.monotonic()


def _rebuild(root) -> None:
    from . import object as unit_object

    unit_object.rebuild(root)


def redraw() -> None:
    """Have every 3D viewport and its panels drawn again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


@persistent
def _catch_up(*_):
    catch_up()


def catch_up() -> None:
    """Have every preview rebuilt that is behind its parameters or its study."""
    from . import object as unit_object

    for root in unit_object.roots():
        if unit_object.behind(root):
            schedule(root)


_HANDLERS = dict.fromkeys(("undo_post", "redo_post", "load_post"), _catch_up)


def register():
    """Handlers for undo, redo and load."""
    handlers.add(_HANDLERS)


def unregister():
    """Take out handlers and a waiting rebuild."""
    handlers.remove(_HANDLERS)
    if bpy.app.timers.is_registered(_flush):
        bpy.app.timers.unregister(_flush)
    _pending.clear()
