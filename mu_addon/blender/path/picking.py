"""Choose the sensor path that the waveguide follows: by its button, or by a click on it in the 3D view.

Blender reports a selection by an update of its dependency graph, in which no operator may be called, so a
timer makes the choice a moment later.
"""

from typing import Any

import bpy

from ...design.anchors import window
from ..shared import restoring, updates, viewports
from ..shared.blender_property import Text
from ..shared.displays import PART
from ..shared.operators import operator
from ..shared.registration import RESTORED, handler, timer
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator
from ..unit.properties import to_unit
from . import hover
from .candidates import CANDIDATE


def _point_out(context, properties) -> str:
    """Text of the tooltip, which also shows the path in its true place."""
    root = unit_object.active_root(context)
    if root is not None and root.mu_unit.candidates:
        hover.point_out(root.mu_unit.path if properties.name == "none" else properties.name)
    return "" if properties.name != "none" else "Remove the waveguide along this path"


@operator(
    UnitOperator,
    "Choose Sensor Path",
    tip=_point_out,
    name=Text(
        "Path",
        "Name of a path, alpha1 ..; `none` removes the waveguide, "
        "nothing takes the candidate that is selected in the viewport",
    ),
)
def path(context, root, name):
    """Lay the waveguide along this path"""
    name = name or selected_candidate(context)
    if name and name != "none":
        name = window(to_unit(root.mu_unit), name).name
    with updates.paused():
        root.mu_unit.path = "" if name == "none" else name
        # Where the waveguide is seen; a solid or a result is of the path before.
        root.mu_unit.show = "preview"
    unit_object.rebuild(root)


def selected_candidate(context) -> str:
    """Name of the candidate path that is the active object, or ""."""
    obj = unit_object.active_object(context)
    part = obj.get(PART, "") if obj else ""
    return part.removeprefix(CANDIDATE) if part.startswith(CANDIDATE) else ""


_last = 0
"""Number of the object that was active at the last check: only another one is a click."""


def _active() -> int:
    found = unit_object.active_object(bpy.context)
    return 0 if found is None else int(found.session_uid)


@handler(*RESTORED)
def _restored(*_: Any) -> None:
    global _last
    _last = _active()


@handler("depsgraph_update_post")
def _updated(*_: Any) -> None:
    global _last
    if restoring.now() or _active() == _last:
        return
    _last = _active()
    if selected_candidate(bpy.context):
        _choose.soon()


@timer()
def _choose() -> None:
    with viewports.in_window():
        choose_active()


def choose_active() -> None:
    """Choose the candidate path that is the active object, with one undo step."""
    context = bpy.context
    if unit_object.active_object(context) is None or context.mode != "OBJECT":
        return
    name, root = selected_candidate(context), unit_object.root_of(context.object)
    if name and root is not None and root.mu_unit.path != name and bpy.ops.mu.path.poll():
        bpy.ops.mu.path("EXEC_DEFAULT", True, name=name)
