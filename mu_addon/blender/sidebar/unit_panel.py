"""The first panels of the sidebar tab MU: the unit, its chambers and its lattice."""

from __future__ import annotations

import bpy

from ..body.state import FLAWS
from ..evidence import panel as evidence_panel
from ..evidence import state as evidence
from ..grading import state as grading
from ..gripper import object as gripper_object
from ..jobs.panel import whole
from ..live_bending import words as live_words
from ..node_tree import following
from ..printing import state as printing
from ..results import motion as motion_parts
from ..shared import scene_units
from ..shared.operators import linked
from ..shared.panels import CHARACTERS, NEXT_STEP, TabPanel, alert, fold, wrapped
from ..shared.registration import connected
from ..shared.wording import path_symbol
from ..simulate import study_folder as studies
from ..simulate.job import SIMULATION
from ..simulate.panel import start_words
from ..unit import drawing
from ..unit import object as unit_object
from ..unit.base_classes import NO_UNIT, UnitPanel, fix_button, parameters
from ..unit.broken import broken
from . import figures

JOBS = SIMULATION, evidence.DIAGNOSIS, printing.PRINTING
LETTERS = 14
"""Letters of a running stage's name; a longer one is numbered."""
GRADED = "Factors on the struts' diameters; they multiply, and 1 leaves struts as they are"


class MU_PT_unit(TabPanel, bpy.types.Panel):
    """The active unit"""

    bl_label = "Monolithic Unit"

    @classmethod
    def poll(cls, context):
        # With a gripper alone, its own panel has this note.
        return unit_object.active_root(context) is not None or gripper_object.active(context) is None

    def draw(self, context):
        layout = self.layout
        root = unit_object.active_root(context)
        if root is None:
            wrapped(layout, NO_UNIT, "INFO")
            layout.operator("mu.add", text="Add Monolithic Unit", icon="ADD")
            layout.menu("MU_MT_more", icon="DOWNARROW_HLT")
            return
        if linked(root):
            wrapped(layout, linked(root), "LINKED")
        _tree(layout, root)
        if untrue := _untrue_size(root, context.scene):
            alert(layout, untrue)
        row = layout.row(align=True)
        row.prop(root, "name", text="")
        row.operator("mu.select", text="", icon="RESTRICT_SELECT_OFF")
        row.operator("mu.rebuild", text="", icon="FILE_REFRESH")
        row.operator("mu.delete", text="", icon="TRASH")
        row = layout.row(align=True)
        row.menu("MU_MT_presets", icon="PRESET")
        row.operator("mu.preset_save", text="", icon="ADD")
        row.menu("MU_MT_more", text="", icon="DOWNARROW_HLT")
        layout.row(align=True).prop(root.mu_unit, "show", expand=True)
        if root.mu_motion.trouble:
            wrapped(layout, root.mu_motion.trouble, "ERROR")
        _cut(layout, root)
        live_words.draw(layout, root)
        _head(layout, root)


def _cut(layout, root) -> None:
    """Draw the switch that cuts open what is shown, design or result; grey, with the reason, if it cannot."""
    row, why = layout.row(), ""
    motion = motion_parts.motion_of(root) if unit_object.shows_result(root) else None
    if root.mu_unit.show == unit_object.SOLID:
        why = ": not the solid"
    elif motion is not None and not motion.halved:
        why = ": its mesh has no half"
    row.enabled, row.use_property_split = not why, False
    of = root.mu_unit if motion is None else root.mu_motion
    row.prop(of, "cut", text=f"Cut Open{why}", icon="MOD_BOOLEAN", toggle=True)


def _tree(layout, root) -> None:
    """Draw the tree whose values the panel edits, if the unit follows one, and those that the tree sets."""
    node = following.followed(root)
    if node is None:
        return
    layout.operator("mu.tree_show", text=f"Edits the tree {node.id_data.name}", icon="NODETREE")
    if kept := following.kept_by_tree(root):
        wrapped(layout, f"By a link or driver of the tree: {', '.join(kept)}", "DECORATE_DRIVER")


def _untrue_size(root, scene) -> str:
    """Note that a unit is not seen in its true size, with the remedy; else ""."""
    factor = scene_units.shown_factor(root, scene)
    if abs(factor - 1.0) < 1e-3:
        return ""
    times = f"{factor:.3g}" if factor < 1e4 else f"{factor:.0f}"
    if root.library is not None:
        help_ = "Object > Library Override > Make gives it its true size"
    elif all(root.lock_scale):
        help_ = "A parent is scaled by other factors along other axes: apply its scale"
    else:
        help_ = "Its scale is unlocked: lock it, and it gets its true size"
    return f"Appears at {times} times its true size. {help_}"


def _head(layout, root) -> None:
    """Draw the unit's figures or, in red, the rule that it breaks with buttons that repair it.

    Both are of the same height, except when more than two rules are broken.
    """
    lines, wrong = figures.lines(root, CHARACTERS)
    found = broken(root) if wrong else None
    box = layout.box()
    box.alert = wrong
    column = box.column(align=True)
    column.scale_y = 0.85
    for number, line in enumerate(lines):
        icon = ("ERROR" if wrong else "DRIVER_DISTANCE") if number == 0 else "BLANK1"
        column.label(text=line, icon=icon)
    mending = [] if found is None else [r for r in found.repairs if r.value is not None]
    row = box.row(align=True)
    row.alert = False
    if not mending:
        _draw_next_step(row, root)
        return
    if len(mending) > 1:
        row = row.split(factor=0.8, align=True)
    # Two buttons side by side have room for their words, and a third for the number of repairs.
    grid = row.grid_flow(columns=min(len(mending), 2), align=True, row_major=True, even_columns=True)
    for repair in mending:
        fix_button(grid, root, repair.section, repair.name, repair.value, found.text)
    if len(mending) > 1:
        row.operator("mu.fit_all", text=f"All {len(mending)}")


def _draw_next_step(row, root) -> None:
    """Draw the button of the next action on a unit or, while a job runs, its progress in words."""
    for kind in JOBS:
        if kind.is_running(root):
            # Its bar is in the status bar, and in its panel.
            row.label(text=whole(kind.child(root), LETTERS)[1], icon="TIME")
            return
    operator, text, icon, given = _next_step(root)
    button = row.operator(operator, text=text, icon=icon)
    for name, value in given.items():
        setattr(button, name, value)


def _next_step(root) -> tuple[str, str, str, dict[str, str]]:
    """Operator of the next action on a unit, with its label, icon and settings."""
    data = evidence.measured_data(root)
    if data is not None and data.measured is not None and evidence.diagnosis(root) is None:
        return "mu.evidence_diagnose", evidence_panel.start_words(root), "VIEWZOOM", {}
    found = studies.findings(root)
    if found is None or found.stale or not found.run.complete:
        return "mu.simulate", start_words(root), "PLAY", {}
    best = found.ranking[0][0] if found.ranking else ""
    if best and root.mu_unit.path not in (best, *(found.summary.get("tied_with_chosen") or ())):
        return "mu.path", f"Use Path {path_symbol(best)}", "CON_FOLLOWPATH", {"name": best}
    if not unit_object.solid_is_current(root):
        return "mu.solid", "Build Solid", "MESH_DATA", {}
    check, files = printing.CHECK.found(root), printing.EXPORT.found(root)
    if check is None or check.stale:
        return "mu.print_check", printing.CHECK.label(root, "Check Print"), "VIEWZOOM", {}
    if files is None or files.stale:
        return "mu.print_export", printing.EXPORT.label(root, "Export"), "EXPORT", {}
    return "mu.print_open", "Open the Files", "FILE_FOLDER", {"what": "export"}


@connected(NEXT_STEP)
def _offered(root) -> str:
    """Operator that the top offers as the next step, or ""."""
    found = broken(root) if root.mu_unit.trouble else None
    mends = found is not None and any(repair.value is not None for repair in found.repairs)
    return "" if mends or any(kind.is_running(root) for kind in JOBS) else _next_step(root)[0]


class MU_PT_design(UnitPanel, bpy.types.Panel):
    """Chambers: number, profile, wall, caps and inlet"""

    bl_label = "Design"
    bl_options = set()
    place = ("design",)

    def show(self, layout, context, root):
        layout.prop(root.mu_unit, "scale")
        parameters(layout, root, "design")


class MU_PT_lattice(UnitPanel, bpy.types.Panel):
    """Cells of the lattice and its struts"""

    bl_label = "Lattice"
    place = "lattice", "grading"

    def show(self, layout, context, root):
        envelope = root.mu_unit.envelope
        parameters(layout, root, "lattice")
        if graded := parameters(layout, root, "grading").get("grading"):
            wrapped(graded, GRADED, "INFO")
            _painting(graded, root)
        if envelope is not None:
            wrapped(layout, f"The lattice fills {envelope.name}; counts of cells are not used", "INFO")
        _own_body(layout, root)


def _own_body(layout, root) -> None:
    """Buttons to check, use and remove a mesh as the unit's envelope."""
    body = fold(layout, "MU_own_body", "Body of Your Own")
    if body:
        row = body.row(align=True)
        row.operator("mu.body_check", icon="VIEWZOOM")
        row.operator("mu.body_repair", icon="TOOL_SETTINGS")
        body.operator("mu.body", icon="MESH_MONKEY")
        if root.mu_unit.envelope is not None or drawing.beside(root, FLAWS) is not None:
            body.operator("mu.body_remove", icon="X")


PAINTED = "Weight 0.5 leaves struts as they are, 0 halves their diameter, 1 doubles it; both sides alike"


def _painting(layout, root) -> None:
    """Draw buttons to paint, or to apply and discard a painting."""
    if grading.painted_on(root) is None:
        layout.operator("mu.paint_struts", icon="WPAINT_HLT")
        return
    wrapped(layout, PAINTED, "INFO")
    row = layout.row(align=True)
    row.operator("mu.paint_struts_apply", icon="CHECKMARK")
    row.operator("mu.paint_struts", text="Go On", icon="WPAINT_HLT")
    row.operator("mu.paint_struts_discard", icon="X")
