"""The extension's preferences: jobs when Blender is closed, and results that uninstalling deletes."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ..shared.blender_property import Flag
from ..shared.compat import user_folder
from ..shared.panels import wrapped
from .start_child import PACKAGE

# Characters in a line of the preferences' window at its first size.
_WIDTH = 90


class MU_AP_preferences(bpy.types.AddonPreferences):
    """Preferences of the extension"""

    bl_idname = PACKAGE

    jobs_go_on: Flag(
        "Runs Go On When Blender Is Closed",
        "Simulations, grasps, diagnoses and node trees continue when Blender is closed, and "
        "the next session shows them. Off: they end with Blender, and finished stages are kept. Jobs "
        "that are waiting end in either case",
        default=True,
    )

    def draw(self, context):
        self.layout.prop(self, "jobs_go_on")
        if text := deleted_with_it():
            wrapped(self.layout, text, "INFO", _WIDTH)


def deleted_with_it() -> str:
    """Results that are deleted when the extension is uninstalled, as text; "" without any."""
    count = sum(place.is_dir() for place in user_folder("studies").iterdir())
    if not count:
        return ""
    of = "one unit or gripper" if count == 1 else f"{count} units or grippers"
    return (
        f"Uninstalling deletes the results of {of} in files that were never saved. "
        "Save a file to keep its results next to it."
    )
