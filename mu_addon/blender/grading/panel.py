"""Buttons below the grading of the Lattice panel."""

from __future__ import annotations

from ..shared.panels import wrapped
from . import state

PAINTED = "Weight 0.5 leaves struts as they are, 0 halves their diameter, 1 doubles it; both sides alike"


def draw(layout, root) -> None:
    """Draw buttons to paint, or to apply and discard a painting."""
    if state.painted_on(root) is None:
        layout.operator("mu.paint_struts", icon="WPAINT_HLT")
        return
    wrapped(layout, PAINTED, "INFO")
    row = layout.row(align=True)
    row.operator("mu.paint_struts_apply", icon="CHECKMARK")
    row.operator("mu.paint_struts", text="Go On", icon="WPAINT_HLT")
    row.operator("mu.paint_struts_discard", icon="X")
