"""Previews that follow their parameters: at most one rebuild every few hundredths of a second.

Undo, redo and loading can restore parameters whose preview was rebuilt after the undo step was taken;
handlers find such units and rebuild them.
"""

from __future__ import annotations

import time

import bpy

from ..shared import updates, viewports
from ..shared.registration import RESTORED, at_end, connected, handler, timer
from . import object as unit_object
from .properties import PARAMETERS_CHANGED, VIEW_CHANGED

INTERVAL_S = 0.03

_rebuilt_at = 0.0
_pending: set[str] = set()


@connected(PARAMETERS_CHANGED)
def schedule(root) -> None:
    """Schedule a rebuild of a unit's preview; rebuild at once in background, where timers never fire."""
    if updates.are_paused() or not root.mu_unit.uuid:
        return
    if bpy.app.background:
        unit_object.rebuild(root)
        return
    _pending.add(root.mu_unit.uuid)
    # The first change is followed at once, later ones during a drag at intervals.
    _rebuild_pending.soon(max(0.0, INTERVAL_S - (time.monotonic() - _rebuilt_at)))


@timer()
def _rebuild_pending():
    global _rebuilt_at
    pending, names = set(_pending), []
    _pending.clear()
    # By UUID: undo may have deleted the object, or restored another in its place.
    for root in unit_object.roots():
        if root.mu_unit.uuid in pending:
            unit_object.rebuild(root)
            names.append(root.name)
    if names:
        viewports.redraw()
    _rebuilt_at = time.monotonic()


@connected(VIEW_CHANGED)
def _show(root) -> None:
    """Show the parts that the user wants to see, preview or solid."""
    if not updates.are_paused() and root.mu_unit.uuid:
        unit_object.show(root)


@handler(*RESTORED)
def catch_up(*_) -> None:
    """Rebuild every preview that is behind its parameters or its study."""
    for root in unit_object.roots():
        if unit_object.behind(root):
            schedule(root)


@handler("frame_change_post")
def _played(*_):
    """Rebuild after keyframes and drivers, which set parameters without a property's update."""
    for root in unit_object.roots():
        data = root.animation_data
        if data is not None and (data.action or data.drivers) and unit_object.behind(root):
            schedule(root)


@at_end
def _forget() -> None:
    _pending.clear()
