"""The extension's preferences: jobs when Blender is closed."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import BoolProperty

from .start_child import PACKAGE


class MU_AP_preferences(bpy.types.AddonPreferences):
    """Preferences of the extension"""

    bl_idname = PACKAGE

    jobs_go_on: BoolProperty(
        name="Runs Go On When Blender Is Closed",
        description="Simulations, grasps, diagnoses and node trees continue when Blender is closed, and "
        "the next session shows them. Off: they end with Blender, and finished stages are kept. Jobs "
        "that are waiting end in either case",
        default=True,
    )

    def draw(self, context):
        self.layout.prop(self, "jobs_go_on")


register, unregister = bpy.utils.register_classes_factory((MU_AP_preferences,))
