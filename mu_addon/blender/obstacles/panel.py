"""The panel Obstacles under Simulate: rigid bodies that the unit may touch, each with its friction."""

from __future__ import annotations

import bpy

from ...errors import InputError
from ..shared.panels import wrapped
from ..shared.wording import sentence
from ..unit.base_classes import UnitPanel
from . import state as obstacles


class MU_PT_obstacles(UnitPanel, bpy.types.Panel):
    """Rigid bodies that the unit may touch while it moves"""

    bl_label = "Obstacles"
    bl_parent_id = "MU_PT_simulate"

    def show(self, layout, context, root):
        found = obstacles.of_unit(root)
        for obj in found:
            column = layout.column(align=True)
            row = column.row(align=True)
            chosen = obj.select_get()
            row.operator("mu.obstacle_select", text=obj.name, icon="CUBE", depress=chosen).name = obj.name
            row.operator("mu.obstacle_remove", text="", icon="X").name = obj.name
            column.prop(obj.mu_obstacle, "friction")
            for words in _troubles(root, obj):
                wrapped(column, words, "ERROR")
        row = layout.row(align=True)
        row.operator("mu.obstacle", icon="ADD")
        row.operator("mu.obstacle_box", icon="MESH_CUBE")
        if found:
            layout.operator("mu.obstacle_check", icon="VIEWZOOM")
        else:
            wrapped(layout, "None: the unit moves freely. Select a closed mesh to use as an obstacle", "INFO")


def _troubles(root, obj):
    """Known faults of an obstacle in its present place, a text each."""
    try:
        known = obstacles.placed(root, obj).flaws or []
    except InputError as error:
        return [f"{error.what}: {error.remedy}"]
    return [f"{sentence(flaw.what)}: {flaw.remedy}" for flaw in known]
