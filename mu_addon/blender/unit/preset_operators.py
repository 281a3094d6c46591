"""Load a preset, save the user's own, remove it."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import attrs
import bpy
from bpy.props import StringProperty

from ..shared import updates
from ..shared.operators import UnitOperator, reports_errors
from . import object as unit_object
from . import presets
from .properties import from_unit, to_unit


class MU_OT_preset_load(UnitOperator, bpy.types.Operator):
    """Set every parameter of the unit to those of a preset"""

    bl_idname = "mu.preset_load"
    bl_label = "Load Preset"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(name="Preset", description="Name of a preset; your own begin with `user:`")

    def act(self, context, root):
        core = presets.load(self.name)
        if not presets.is_named_after_one(root.name):
            core = attrs.evolve(core, name=root.mu_unit.title)  # the user's own name stays
        with updates.paused():
            from_unit(root.mu_unit, core)
        unit_object.rebuild(root)


class MU_OT_preset_save(UnitOperator, bpy.types.Operator):
    """Save the unit's parameters as your own preset, a TOML file that headless/run.py also reads"""

    bl_idname = "mu.preset_save"
    bl_label = "Save Preset"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Name", description="Name of your preset", default="my unit")

    def invoke(self, context, event):
        self.name = unit_object.active_root(context).mu_unit.title
        return context.window_manager.invoke_props_dialog(self)

    def act(self, context, root):
        kept = presets.save(to_unit(root.mu_unit), self.name)
        self.report({"INFO"}, f"Preset {kept.removeprefix(presets.USER)} saved")


class MU_OT_preset_remove(bpy.types.Operator):
    """Remove a preset of your own"""

    bl_idname = "mu.preset_remove"
    bl_label = "Remove Preset"
    bl_options = {"REGISTER"}

    name: StringProperty(name="Preset", description="Name of your preset")

    def invoke(self, context, event):
        return context.window_manager.invoke_confirm(self, event)

    @reports_errors
    def execute(self, context):
        presets.remove(self.name)
        return {"FINISHED"}


CLASSES = (MU_OT_preset_load, MU_OT_preset_save, MU_OT_preset_remove)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
