"""Presets and node groups in the user's asset browser, node groups on curves, and the sample scene."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import EnumProperty

from ..preview import nodes
from ..shared.operators import reports_errors
from . import library, sample


class MU_OT_assets(bpy.types.Operator):
    """Put presets, resins, printers and node groups into the asset browser: a library in your own folder"""

    bl_idname = "mu.assets"
    bl_label = "Add to Asset Browser"
    bl_options = {"REGISTER"}

    @reports_errors
    def execute(self, context):
        folder = library.add()
        self.report(
            {"INFO"}, f"Presets, resins, printers and node groups are in the library {library.NAME}: {folder}"
        )
        return {"FINISHED"}


class MU_OT_assets_remove(bpy.types.Operator):
    """Remove this extension's assets from the asset browser; files that use them keep theirs"""

    bl_idname = "mu.assets_remove"
    bl_label = "Remove from Asset Browser"
    bl_options = {"REGISTER"}

    def execute(self, context):
        library.remove()
        return {"FINISHED"}


class MU_OT_skin(bpy.types.Operator):
    """Give the active curve or mesh a node group: tubes, a waveguide with wells, balls"""

    bl_idname = "mu.skin"
    bl_label = "Skin with Nodes"
    bl_options = {"REGISTER", "UNDO"}

    group: EnumProperty(
        name="Group",
        description="Node group to add as a modifier",
        items=[(name, name, one.text) for name, one in nodes.GROUPS.items()],
    )

    @classmethod
    def poll(cls, context):
        obj = getattr(context, "object", None)
        if obj is None or obj.type not in ("MESH", "CURVE", "CURVES"):
            cls.poll_message_set("Select a curve or a mesh")
            return False
        return True

    def execute(self, context):
        nodes.skin(context.object, self.group)
        return {"FINISHED"}


class MU_OT_sample(bpy.types.Operator):
    """Add a sample scene: an overview, or the start of one task"""

    bl_idname = "mu.sample"
    bl_label = "Sample Scene"
    bl_options = {"REGISTER", "UNDO"}

    scene: EnumProperty(
        name="Scene",
        description="What is added",
        items=[(name, name.capitalize(), text) for name, (text, _) in sample.SCENES.items()],
    )

    @reports_errors
    def execute(self, context):
        sample.build(context, self.scene)
        return {"FINISHED"}


CLASSES = (MU_OT_assets, MU_OT_assets_remove, MU_OT_skin, MU_OT_sample)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
