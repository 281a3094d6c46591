"""The panel Sensor Paths: the candidate paths, their rank, and the waveguide along the chosen one."""

from __future__ import annotations

import bpy

from ...design.anchors import windows
from ..shared.panels import UnitPanel, parameters, wrapped
from . import ranking
from .operators import selected_candidate


class MU_PT_path(UnitPanel, bpy.types.Panel):
    """Candidate paths and the waveguide along the chosen one"""

    bl_idname = "MU_PT_path"
    bl_label = "Sensor Paths"
    place = ("path",)

    def show(self, layout, context, root):
        props = root.mu_unit
        ranked = ranking.ranked(root)
        row = layout.row()
        row.use_property_split = False
        row.prop(props, "candidates", toggle=True, icon="HIDE_OFF" if props.candidates else "HIDE_ON")
        column = layout.column(align=True)
        # The best first, once they are ranked; a sort keeps the order of what it finds equal.
        unranked = (float("inf"), 0)
        for window in sorted(
            windows(props.chambers.count), key=lambda window: ranked.get(window.name, unranked)[0]
        ):
            chosen = props.path == window.name
            text = f"{window.name}    P{window.start} to P{window.start + window.length - 1}"
            if window.name in ranked:
                j, rank = ranked[window.name]
                text += f"    J {j:.3f} mm, no. {rank}"
            icon = "RADIOBUT_ON" if chosen else "RADIOBUT_OFF"
            column.operator("mu.path", text=text, icon=icon, depress=chosen).name = (
                "none" if chosen else window.name
            )
        name = selected_candidate(context)
        if name and name != props.path:
            layout.operator(
                "mu.path", text=f"Use {name}, selected in the view", icon="RESTRICT_SELECT_OFF"
            ).name = name
        if not ranked:
            wrapped(layout, "Simulate to rank them: Place the Sensor", "INFO")
        parameters(layout, root, "path")


CLASSES = (MU_PT_path,)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
