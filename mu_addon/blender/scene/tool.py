"""A tool in the 3D view's toolbar: the arrows' drags from anywhere in the view, chosen in its header."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ..unit import object as unit_object
from .handles import HANDLES, PRESSURE, parameter_of


class MU_WT_size(bpy.types.WorkSpaceTool):
    """Drags one of `HANDLES`; a click selects as in other tools."""

    bl_space_type = "VIEW_3D"
    bl_context_mode = "OBJECT"
    bl_idname = "mu.size"
    bl_label = "Size the Unit"
    bl_description = "Drag wall, bladder, cell or pressure of the active Monolithic Unit; Shift: finely"
    bl_icon = "ops.transform.shrink_fatten"
    bl_widget = None
    bl_keymap = (
        ("mu.drag", {"type": "LEFTMOUSE", "value": "CLICK_DRAG", "any": True}, None),
        (
            "view3d.select",
            {"type": "LEFTMOUSE", "value": "CLICK"},
            {"properties": [("deselect_all", True)]},
        ),
    )

    @staticmethod
    def draw_settings(context, layout, tool):
        """Draw what the mouse changes, and its value."""
        chosen = tool.operator_properties("mu.drag")
        layout.row(align=True).prop(chosen, "what", expand=True)
        root = unit_object.active_root(context)
        if root is None:
            layout.label(text="Select a Monolithic Unit", icon="INFO")
        elif chosen.what != PRESSURE:
            layout.prop(*parameter_of(root, HANDLES[chosen.what]), text="")


def register() -> None:
    """Register the tool; in background there is no toolbar."""
    if not bpy.app.background:
        bpy.utils.register_tool(MU_WT_size, after={"builtin.transform"}, separator=True)


def unregister() -> None:
    """Unregister it."""
    if not bpy.app.background:
        bpy.utils.unregister_tool(MU_WT_size)
