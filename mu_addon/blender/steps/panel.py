"""The design's steps as a list: shown ones, muted ones, and the chosen one's parameters."""

from __future__ import annotations

import bpy

from ...design.steps import STEPS
from ..shared.panels import draw_settings, wrapped
from ..shared.wording import sentence
from ..unit import stack
from ..unit.base_classes import UnitPanel, unit_field
from ..unit.drawing import DRAWN
from ..unit.fields import description


class MU_UL_steps(bpy.types.UIList):
    """Steps of the design, in order"""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index):
        row = layout.row(align=True)
        drawable = row.row()
        drawable.enabled = item.name in DRAWN
        drawable.prop(item, "shown", text="", emboss=False, icon="HIDE_OFF" if item.shown else "HIDE_ON")
        name = row.row()
        name.active = not item.muted
        name.label(text=item.name.capitalize())
        mute = row.row()
        mute.enabled = stack.can_be_muted(item.name)
        state = "CHECKBOX_DEHLT" if item.muted else "CHECKBOX_HLT"
        mute.prop(item, "muted", text="", emboss=False, icon=state)


class MU_PT_stack(UnitPanel, bpy.types.Panel):
    """The design step by step: each step can be shown, muted, changed and run again"""

    bl_label = "Steps"

    def show(self, layout, context, root):
        props = root.mu_unit
        layout.template_list("MU_UL_steps", "", props, "stack", props, "step", rows=len(STEPS))
        if not 0 <= props.step < len(props.stack):
            return
        entry = props.stack[props.step]
        step = STEPS.get(entry.name)
        if step is None:
            return
        wrapped(layout, sentence(step.text), "INFO")
        if entry.muted:
            wrapped(layout, f"Muted: {step.muting}", "ERROR")
        own = [unit_field(root, s, description(s, name)) for s, name in stack.own_parameters(step)]
        draw_settings(layout, own, not entry.muted)
        row = layout.row(align=True)
        if step.name == "solid":
            row.operator("mu.solid")
        else:
            row.operator("mu.again", icon="FILE_REFRESH").step = step.name
        lacking = stack.muted(props)
        if lacking:
            names = ", ".join(name for name in STEPS if name in lacking)
            wrapped(layout, f"Cannot be printed while muted: {names}", "INFO")
