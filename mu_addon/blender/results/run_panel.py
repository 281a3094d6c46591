"""Every run of the unit in a list, for the panel Results; the panel Comparison, two of them side by side."""

from __future__ import annotations

import textwrap
import time
from itertools import zip_longest
from typing import ClassVar

import bpy

from ...run.progress import spell
from ...studies.unit_comparison import compare
from ..shared.panels import wrapped
from ..shared.wording import path_symbol, sentence
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitPanel
from . import runs

ROWS = 4
"""Number of runs that the list shows."""
COLUMN = 8
"""Letters in a line of a column of the comparison."""


class MU_UL_runs(bpy.types.UIList):
    """Runs: star, name, best path or angle, and which one to compare with."""

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0, flt_flag=0):
        root = unit_object.active_root(context)
        run = None if root is None else studies.run_by_key(root, item.key)
        if run is None:
            layout.label(text="")
            return
        row = layout.row(align=True)
        # Runs with other parameters than the unit: still listed, and greyed out.
        row.active = run.design == studies.design_of(root)
        star = "SOLO_ON" if run.starred else "SOLO_OFF"
        row.prop(item, "starred", text="", icon=star, emboss=False)
        split = row.split(factor=0.63)
        split.prop(item, "title", text="", emboss=False)
        split.label(text=found_in(run))
        here = root.mu_unit.study.against == run.key
        arrow = "CHECKBOX_HLT" if here else "CHECKBOX_DEHLT"
        row.operator("mu.run_compare", text="", icon=arrow, emboss=False).key = run.key


def found_in(run) -> str:
    """Result of a run in a word: its best path and J, else its largest angle, else its progress."""
    if run.ranking:
        name, j = run.ranking[0]
        return f"{path_symbol(name)} {j:.3f}"
    if run.angles:
        return f"{run.angles[-1][1]:+.1f}°"
    # The column has room for eight letters; all of it is said below the list.
    state = run.state.partition(";")[0].partition(":")[0]
    return "stopped" if state in ("cancelled", "interrupted") else state


def draw_runs(layout, root) -> None:
    """Draw every run of a unit, the latest first, and the end time of the shown one; nothing without runs."""
    run, every = studies.shown_run(root), studies.runs_of(root)
    if not every:
        return
    listed = runs.listed()
    row = layout.row()
    row.template_list("MU_UL_runs", "", listed, "entries", listed, "index", rows=ROWS)
    column = row.column(align=True)
    column.operator("mu.run_restore", text="", icon="LOOP_BACK").key = ""
    column.operator("mu.run_remove", text="", icon="TRASH").key = ""
    words = "Click one to see its results"
    if run is not None:
        took = f", took {spell(run.seconds)}" if run.seconds else ""
        words = f"{time.strftime('%d %b %H:%M', time.localtime(run.changed_s))}{took}"
    layout.label(text=words, icon="TIME")
    if len(every) > 1 and not studies.run_by_key(root, root.mu_unit.study.against):
        wrapped(layout, "Tick a run to compare the shown one with it", "INFO")


class MU_PT_comparison(UnitPanel, bpy.types.Panel):
    """Compare the shown run with another one: parameters that differ, angles, J, time"""

    bl_parent_id = "MU_PT_results"
    bl_label = "Comparison"
    bl_options: ClassVar[set[str]] = set()

    @classmethod
    def shows(cls, root):
        return studies.run_by_key(root, root.mu_unit.study.against) is not None

    def show(self, layout, context, root):
        shown, other = studies.shown_run(root), studies.run_by_key(root, root.mu_unit.study.against)
        if shown is None or other is None:
            return
        if shown.key == other.key:
            wrapped(layout, "This run is the one that is shown: choose another one in the list", "INFO")
            return
        box = layout.box().column(align=True)
        box.scale_y = 0.85
        for names in zip_longest(_name_lines(shown), _name_lines(other), fillvalue=""):
            _row(box, "", *names)
        box.separator()
        inputs = None
        for line in compare([shown, other]):
            if inputs and not line.is_input:
                box.separator()
            inputs = line.is_input
            what = sentence(line.what)
            _row(box, f"{what} ({line.unit})" if line.unit else what, *line.values)
        button = layout.operator("mu.field_show", text="Difference on the Unit", icon="MOD_DATA_TRANSFER")
        button.field = "run_difference_mm"


def _name_lines(run) -> list[str]:
    """Lines of a run's name that fit into a column."""
    return textwrap.wrap(run.title, COLUMN)


def _row(column, what: str, one: str, other: str) -> None:
    split = column.split(factor=0.46)
    split.label(text=what)
    split = split.split(factor=0.5)
    split.label(text=one.replace("alpha", "α"))
    split.label(text=other.replace("alpha", "α"))
