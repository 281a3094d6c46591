"""Add, rebuild and delete a unit; give the scene millimetres."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import attrs
import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...design.parameters import Unit
from ...design.quantity import describe
from ..shared.operators import UnitOperator, reports_errors
from . import object as unit_object
from . import presets
from .properties import exact, tooltip

_SCALE = next(d for d in describe(Unit) if d.name == "scale")


def in_millimetres(scene) -> bool:
    """Whether one Blender unit of the scene is a millimetre."""
    units = scene.unit_settings
    return units.system == "METRIC" and abs(units.scale_length - 0.001) < 1e-9


def use_millimetres(scene) -> None:
    """One Blender unit is a millimetre, shown as such."""
    units = scene.unit_settings
    units.system, units.scale_length, units.length_unit = "METRIC", 0.001, "MILLIMETERS"


_items: list[tuple[str, str, str]] = []


def _preset_items(self, context):
    # Blender does not keep these strings alive; this list does.
    _items[:] = [
        (n, n.removeprefix(presets.USER), "Your own" if n.startswith(presets.USER) else "")
        for n in presets.names()
    ]
    return _items


class MU_OT_add(bpy.types.Operator):
    """Add a Monolithic Unit: bladder actuator, lattice and sensor path in one body"""

    bl_idname = "mu.add"
    bl_label = "Monolithic Unit"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Preset", description="Unit to begin with", items=_preset_items, options={"SKIP_SAVE"}
    )
    scale: FloatProperty(
        name="Scale",
        description=tooltip(_SCALE),
        default=0.0,
        min=0.0,
        max=_SCALE.high,
        options={"SKIP_SAVE"},
    )
    millimetres: BoolProperty(
        name="Scene in Millimetres",
        description="Set the scene's unit, one Blender unit a millimetre",
        default=True,
    )
    # The preset that the scale belongs to: another one, chosen in the redo panel, brings its own scale.
    scaled: StringProperty(options={"HIDDEN", "SKIP_SAVE"})
    frame: BoolProperty(name="Frame in View", description="Bring the new unit into view", default=True)

    @reports_errors
    def execute(self, context):
        if not self.properties.is_property_set("preset"):
            self.preset = "mu-1.0x"
        core = presets.load(self.preset)
        if not self.properties.is_property_set("scale") or self.scaled not in ("", self.preset):
            self.scale = core.scale
        self.scaled = self.preset
        if exact(self.scale) != core.scale:
            core = attrs.evolve(core, scale=max(exact(self.scale), _SCALE.low))
        if self.millimetres:
            use_millimetres(context.scene)
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        root = unit_object.create(context, core)
        if self.frame and not bpy.app.background:
            _frame(context, root)
        return {"FINISHED"}


def _frame(context, root):
    """Bring a unit into the 3D view: it is 75 mm tall, and Blender's view begins 15 units wide."""
    area = context.area if context.area and context.area.type == "VIEW_3D" else None
    area = area or next((a for a in context.screen.areas if a.type == "VIEW_3D"), None)
    if area is None:
        return
    region = next(r for r in area.regions if r.type == "WINDOW")
    parts = [c for c in root.children if not c.get(unit_object.PART, "").startswith(unit_object.CANDIDATE)]
    for child in parts:
        child.select_set(True)
    context.view_layer.update()
    with context.temp_override(area=area, region=region):
        bpy.ops.view3d.view_selected()
    for child in parts:
        child.select_set(False)


class MU_OT_rebuild(UnitOperator, bpy.types.Operator):
    """Build the preview again from the parameters, with every part that was deleted"""

    bl_idname = "mu.rebuild"
    bl_label = "Rebuild Preview"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        root = unit_object.active_root(context)
        if not unit_object.rebuild(root):
            self.report({"ERROR"}, root.mu_unit.trouble)
            return {"CANCELLED"}
        return {"FINISHED"}


class MU_OT_delete(UnitOperator, bpy.types.Operator):
    """Delete the unit with all its parts; its study folder stays"""

    bl_idname = "mu.delete"
    bl_label = "Delete Unit"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        unit_object.delete(unit_object.active_root(context))
        return {"FINISHED"}


class MU_OT_millimetres(bpy.types.Operator):
    """Set the scene's unit so that one Blender unit is a millimetre; nothing changes in the viewport"""

    bl_idname = "mu.millimetres"
    bl_label = "Use Millimetres"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        use_millimetres(context.scene)
        return {"FINISHED"}


class MU_OT_select(UnitOperator, bpy.types.Operator):
    """Make the unit's root the active object, which holds its parameters and moves all its parts"""

    bl_idname = "mu.select"
    bl_label = "Select Unit"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        unit_object.make_active(context, unit_object.active_root(context))
        return {"FINISHED"}


CLASSES = (MU_OT_add, MU_OT_rebuild, MU_OT_delete, MU_OT_millimetres, MU_OT_select)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
