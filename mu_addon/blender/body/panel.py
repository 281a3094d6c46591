"""The part of the panel Lattice for the user's own envelope."""

from __future__ import annotations

from ..unit import drawing


def draw(layout, root) -> None:
    """Buttons to check, use and remove a mesh as the unit's envelope."""
    header, body = layout.panel("MU_own_body", default_closed=True)
    header.label(text="Body of Your Own")
    if body:
        row = body.row(align=True)
        row.operator("mu.body_check", icon="VIEWZOOM")
        row.operator("mu.body_repair", icon="TOOL_SETTINGS")
        body.operator("mu.body", icon="MESH_MONKEY")
        if root.mu_unit.envelope is not None or drawing.beside(root, drawing.FLAWS) is not None:
            body.operator("mu.body_remove", icon="X")
