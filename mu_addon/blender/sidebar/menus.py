"""Entries in Blender's menus, the menus of presets and of actions on a unit."""

from __future__ import annotations

import bpy

from ...design.steps import STEPS
from ..scene import handles
from ..shared import displays
from ..shared.registration import menu
from ..unit import presets


class MU_MT_presets(bpy.types.Menu):
    """Presets of the extension, then your own"""

    bl_label = "Presets"

    def draw(self, context):
        layout = self.layout
        names = presets.names()
        own = [name for name in names if name.startswith(presets.USER)]
        for name in names:
            if own and name == own[0]:
                layout.separator()
            layout.operator("mu.preset_load", text=name.removeprefix(presets.USER)).name = name
        layout.separator()
        layout.operator("mu.preset_save", text="Save as Preset...", icon="ADD")
        if own:
            layout.menu("MU_MT_presets_remove", icon="REMOVE")


class MU_MT_presets_remove(bpy.types.Menu):
    """Remove one of your own presets"""

    bl_label = "Remove Preset"

    def draw(self, context):
        for name in presets.names():
            if name.startswith(presets.USER):
                self.layout.operator("mu.preset_remove", text=name.removeprefix(presets.USER)).name = name


@menu("VIEW3D_MT_mesh_add")
def _add(self, context):
    self.layout.operator("mu.add", icon="OUTLINER_OB_LATTICE")
    self.layout.operator("mu.gripper_add", icon="MOD_MIRROR")


SUBJECTS = {
    "Design Step": [*STEPS, "fit_all", "tree_of_unit"],
    "Body": ["body", "body_check", "body_repair", "body_remove"],
    "Cell Painting": ["paint_struts", "paint_struts_apply", "paint_struts_discard"],
    "Obstacles": ["obstacle", "obstacle_box", "obstacle_check"],
    "Result": [
        *("motion", "motion_range", "motion_legend", "motion_update", "motion_clear", "colours", "probe"),
    ],
    "Run": ["open", "run_restore", "run_remove", "cancel"],
    "Optimize": ["optimize"],
    "Evidence": ["import_files", "evidence_diagnose", "evidence_apply", "evidence_remove"],
    "Print": ["print_check", "print_marks", "print_clear", "print_layer", "print_layer_clear"],
    "Print Files": ["print_export", "export_stl", "print_specimens", "print_check_file"],
    "Sensor on the Bench": [
        *("sensor_ports", "sensor_connect", "sensor_disconnect", "sensor_pause", "sensor_mark"),
        *("sensor_freeze", "sensor_sweep", "sensor_hold", "sensor_back", "sensor_calibrate"),
        *("sensor_zero", "sensor_twin"),
    ],
    "Gripper": ["grasp", "grasp_show", "gripper_delete"],
}  # fmt: skip
"""Actions on the active unit or gripper by subject, without those on one row of a list: a submenu each, so
that Blender's menu search (F3), which finds what is in menus, finds them."""


def _submenu(title: str) -> type:
    def draw(self, context):
        self.layout.operator_context = "INVOKE_REGION_WIN"
        for name in SUBJECTS[title]:
            self.layout.operator(f"mu.{name}")

    name = f"MU_MT_{title.lower().replace(' ', '_')}"
    members = {"__doc__": "Actions of this subject", "bl_idname": name, "bl_label": title, "draw": draw}
    return type(name, (bpy.types.Menu,), members)


_SUBMENUS = [_submenu(title) for title in SUBJECTS]


class MU_MT_object(bpy.types.Menu):
    """Actions on a whole unit or gripper"""

    bl_label = "Monolithic Unit"

    def draw(self, context):
        layout = self.layout
        # In the layout's own context: chosen from the search, too, a drag needs the 3D view.
        layout.operator_context = "INVOKE_REGION_WIN"
        for key, name, _ in handles.ITEMS:
            layout.operator("mu.drag", text=f"Drag {name}", icon="ARROW_LEFTRIGHT").what = key
        layout.separator()
        layout.operator_menu_enum("mu.resin", "name", icon="MATERIAL")
        layout.operator("mu.simulate", icon="PLAY")
        layout.operator_menu_enum("mu.field_show", "field", text="Show on the Unit", icon="SHADING_RENDERED")
        layout.separator()
        for submenu in _SUBMENUS:
            layout.menu(submenu.bl_idname)
        layout.separator()
        layout.operator("mu.select", icon="RESTRICT_SELECT_OFF")
        layout.operator("mu.rebuild", icon="FILE_REFRESH")
        layout.operator("mu.delete", icon="TRASH")


@menu("VIEW3D_MT_object")
def _object(self, context):
    # The menu search of Blender finds what is in menus.
    self.layout.menu("MU_MT_object", icon="OUTLINER_OB_LATTICE")


@menu("VIEW3D_MT_object_context_menu", first=True)
def _on_unit(self, context):
    if displays.root_above(context.object) is not None:
        _object(self, context)
        self.layout.separator()


class MU_MT_more(bpy.types.Menu):
    """Sample scenes, gripper, node groups for your own curves, and the asset browser"""

    bl_label = "More"

    def draw(self, context):
        layout = self.layout
        layout.operator_menu_enum("mu.sample", "scene", icon="SCENE_DATA")
        layout.operator("mu.gripper_add", text="Gripper of This Unit", icon="MOD_MIRROR").of_unit = True
        layout.operator_menu_enum("mu.skin", "group", text="Skin with Nodes", icon="GEOMETRY_NODES")
        layout.operator("mu.millimetres", icon="DRIVER_DISTANCE")
        layout.separator()
        layout.operator("mu.assets", icon="ASSET_MANAGER")
        layout.operator("mu.assets_remove")


CLASSES = (*_SUBMENUS,)
