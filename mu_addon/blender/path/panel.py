"""The panel Sensor Paths: the candidate paths, their rank, and the waveguide along the chosen one."""

from __future__ import annotations

import bpy

from ...design.anchors import windows
from ..shared.blender_property import Choice
from ..shared.panels import plain_row
from ..shared.registration import attach
from ..shared.wording import anchors_of, path_symbol
from ..unit.base_classes import DONE, UnitPanel, parameters
from . import ranking
from .legend import BETTER, BOUND, ESTIMATED, UNDECIDED
from .picking import selected_candidate

ORDERS = (
    ("name", "By Name", "As they stand beside the unit"),
    ("deviation", "By Deviation", "The one that disturbs the motion least first"),
)


attach(
    __name__,
    bpy.types.WindowManager,
    "mu_path_order",
    lambda: Choice("Order", "Order of the list of paths", items=ORDERS, default="deviation"),
)  # no file keeps it


class MU_PT_path(UnitPanel, bpy.types.Panel):
    """Candidate paths and the waveguide along the chosen one"""

    bl_label = "Sensor Paths"
    place = ("path",)

    @classmethod
    def mark(cls, root):
        return DONE if root.mu_unit.path else ""

    def show(self, layout, context, root):
        props = root.mu_unit
        icon = "HIDE_OFF" if props.candidates else "HIDE_ON"
        plain_row(layout).prop(props, "candidates", toggle=True, icon=icon)
        _list(layout, context, root)
        name = selected_candidate(context)
        if name and name != props.path:
            text = f"Use {path_symbol(name)}, selected in the view"
            layout.operator("mu.path", text=text, icon="RESTRICT_SELECT_OFF").name = name
        parameters(layout, root, "path")


def _list(layout, context, root) -> None:
    """Draw every path: its anchors and, once ranked, its mean deviation and rank."""
    known = ranking.known(root)
    ranked = bool(known.numbers) and not known.stale
    row = plain_row(layout)
    row.enabled = ranked
    row.prop(context.window_manager, "mu_path_order", expand=True)
    # Same height in both cases, so that a click on a run without a ranking moves nothing.
    words = ESTIMATED if known.estimated else BETTER
    layout.label(text=words if ranked else "Simulate to rank them")
    if ranked and known.tied:
        layout.label(text=UNDECIDED)
    column = layout.column(align=True)
    for window in in_order(root, known, context.window_manager.mu_path_order):
        chosen = root.mu_unit.path == window.name
        row = column.split(factor=0.34, align=True)
        icon = "RADIOBUT_ON" if chosen else "RADIOBUT_OFF"
        button = row.operator("mu.path", text=path_symbol(window.name), icon=icon, depress=chosen)
        button.name = "none" if chosen else window.name
        row = row.split(factor=0.45)
        row.label(text=anchors_of(window))
        if ranked and known.mean(window.name):
            row.label(text=f"{known.mean(window.name)}  {known.rank(window.name)}".rstrip())
    if ranked and known.at_least:
        layout.label(text=BOUND)


def in_order(root, known: ranking.Known, order: str):
    """Windows of a unit by their names or, if ranked and wanted, the best first and lower bounds last."""
    found = windows(root.mu_unit.chambers.count)
    if order == "name" or known.stale:
        return found
    numbers = {name: (0, j) for name, j in known.numbers.items()}
    numbers |= {name: (1, bound) for name, bound in known.at_least.items()}
    # Sorting is stable.
    return sorted(found, key=lambda window: numbers.get(window.name, (2, 0.0)))
