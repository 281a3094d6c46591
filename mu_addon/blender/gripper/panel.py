"""The panel Monolithic Gripper of the sidebar tab MU: its parameters, its grasp, and the results."""

from __future__ import annotations

import bpy

from ...design.gripper import SECTIONS
from ...grasp.phases import WORDS
from ..jobs.panel import draw_job, open_buttons
from ..shared.panels import RootPanel, alert, draw_settings, fields_of, plain_row, wrapped
from ..unit.fields import draw_section
from . import object as gripper_object
from . import state as grasps
from . import timeline


class GripperPanel(RootPanel):
    """A panel of the active gripper."""

    find_root = staticmethod(gripper_object.active)


class MU_PT_gripper(GripperPanel, bpy.types.Panel):
    """The active gripper"""

    bl_label = "Monolithic Gripper"

    def show(self, layout, context, root):
        props = root.mu_gripper
        row = layout.row(align=True)
        row.prop(root, "name", text="")
        row.operator("mu.gripper_delete", text="", icon="TRASH")
        plain_row(layout).prop(props, "cut", icon="MOD_BOOLEAN", toggle=True)
        if props.trouble:
            alert(layout, props.trouble)
        layout.prop(props, "paths")
        for section in SECTIONS:
            layout.label(text=section.section.capitalize())
            draw_section(layout, props, section)


class MU_PT_grasp(GripperPanel, bpy.types.Panel):
    """The grasp of a cube: closing, holding, lifting, releasing"""

    bl_label = "Grasp"
    bl_parent_id = "MU_PT_gripper"

    def show(self, layout, context, root):
        props = root.mu_gripper
        layout.prop(props, "detail")
        if props.detail != "part":
            draw_settings(layout, fields_of(props))
            if gripper_object.part(root, "cube") is not None:
                layout.prop(props, "cube_height")
        name = "Make the Part" if props.detail == "part" else "Grasp"
        words = grasps.GRASPING.label(root, name)
        draw_job(layout, root, grasps.GRASP, "mu.grasp", "PLAY", words)
        found = grasps.of(root)
        if found is None:
            wrapped(layout, "This cube was not grasped yet", "INFO")
        else:
            _found(layout, context.scene, root, found)
        if grasps.folder_of(root).is_dir():
            open_buttons(layout, grasps.GRASP)


def _found(layout, scene, root, found):
    box = layout.box()
    if found.stale:
        box.alert = True
        wrapped(box, f"Stale: {found.stale}. Grasp again", "ERROR")
    column = box.column(align=True)
    column.active = not found.stale
    f = found.figures
    if f:
        column.label(text=f"{f['angle_at_hold_deg']:.1f}°, {f['normal_at_hold_N']:.2f} N a finger at hold")
        held, icon = ("Held", "CHECKMARK") if f["held"] else ("Slips", "ERROR")
        wrapped(column, f"{held}: friction carries {f['margin']:.2g} times the weight", icon)
        column.label(text=f"Overlap in contact {f['gap_error_mm']:.3f} mm")
    on = bool(timeline.parts(root))
    row = box.row(align=True)
    text = "Hide Grasp" if on else "Show Grasp"
    row.operator("mu.grasp_show", text=text, icon="MOD_SIMPLEDEFORM", depress=on).on = not on
    row.operator("screen.animation_play", text="Play", icon="PLAY")
    if on:
        phase, force = grasps.phase_at(found, scene)
        box.label(text=f"{WORDS.get(phase, phase).capitalize()}: {force:.2f} N", icon="TIME")
