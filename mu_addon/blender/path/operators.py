"""Choose the sensor path that the waveguide follows."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import StringProperty

from ...design.anchors import window
from ..shared import updates
from ..shared.displays import PART
from ..shared.operators import UnitOperator
from ..unit import object as unit_object
from ..unit.drawing import CANDIDATE
from ..unit.properties import to_unit


class MU_OT_path(UnitOperator, bpy.types.Operator):
    """Lay the waveguide along this path; without a name, along the candidate selected in the viewport"""

    bl_idname = "mu.path"
    bl_label = "Choose Sensor Path"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(name="Path", description="Name of a path, alpha1 ..; `none` removes the waveguide")

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


CLASSES = (MU_OT_path,)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
