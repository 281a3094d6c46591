"""The panel Evidence of the sidebar tab MU: measured data, their verdict, and actions on it."""

from __future__ import annotations

from pathlib import Path

import bpy

from ...design.printing.finding import counted
from ..import_data.importing import draw_import
from ..jobs.panel import draw_job, open_buttons, timed
from ..shared.panels import alert, fold, wrapped
from ..shared.wording import in_panel, readable
from ..unit.base_classes import DONE, OUTDATED, UnitPanel
from . import state as evidence
from . import timeline as evidence_motion

ROWS = 5
"""Number of rows of the dependence table that are shown; the report has them all."""
ICONS = {"none": "CHECKMARK", "named": "LIGHT", "ambiguous": "QUESTION"}
ICONS |= {"unidentifiable": "QUESTION", "unexplained": "ERROR"}


class MU_PT_evidence(UnitPanel, bpy.types.Panel):
    """Diagnosis of measured data: which effect the simulation lacks, and how much the error falls with it"""

    bl_label = "Evidence"

    @classmethod
    def mark(cls, root):
        if evidence.DIAGNOSIS.is_running(root):
            return "TIME"
        found = evidence.diagnosis(root)
        return "" if found is None or not found.name else OUTDATED if found.stale else DONE

    def show(self, layout, context, root):
        layout.prop(root.mu_evidence, "folder")
        draw_import(layout, root)
        found = evidence.measured_data(root)
        if found is None:
            wrapped(layout, "Choose a folder with experiments.toml and its CSV files", "INFO")
            wrapped(layout, "To make one from a video, use the Movie Clip Editor, sidebar tab MU", "INFO")
            return
        if found.measured is None:
            alert(layout, found.trouble)
            return
        _experiments(layout, context, root, found.measured)
        button = "mu.evidence_diagnose", "VIEWZOOM", start_words(root)
        draw_job(layout, root, evidence.DIAGNOSIS, *button, top=True)
        judged = evidence.diagnosis(root)
        if judged is None or not judged.name:
            words = "Not diagnosed yet" if judged is None else "The diagnosis is not finished"
            wrapped(layout, words, "INFO")
            return
        _verdict(layout, root, judged)


def start_words(root) -> str:
    """Label of the button that starts the diagnosis, with what it takes once measured on this machine."""
    return timed("Diagnose", evidence.announced(root))


def _experiments(layout, context, root, measured):
    """A line for each experiment, with a button that plays it; then the reader's remarks."""
    shown = evidence_motion.shown(root)
    column = layout.column(align=True)
    for e in measured.experiments:
        row = column.row(align=True)
        held_out = e.role != "fit"
        text = f"{e.name}, held out" if held_out else f"{e.name}: {len(e)} rows"
        row.label(text=text, icon="HIDE_ON" if held_out else "CHECKBOX_HLT")
        button = row.row(align=True)
        button.enabled = e.kind in ("unit_pressure", "pressure_step")
        on = e.name == shown
        playing = button.operator("mu.evidence_motion", text="", icon="PLAY", depress=on)
        playing.experiment = "" if on else e.name
    if shown:
        time, angles = evidence_motion.reading(root, context.scene)
        values = [f"{evidence_motion.LOOKS[s][0].lower()} {angle:+.1f}" for s, angle in angles.items()]
        text = f"at {time:.2f} s: {', '.join(values)} deg" if values else f"at {time:.2f} s"
        wrapped(layout, text, "TIME")
        layout.operator("mu.evidence_protocol", icon="GRAPH").experiment = shown
    if measured.remarks:
        count = counted(len(measured.remarks), "remark", "remarks")
        body = fold(layout, "MU_remarks", f"{count} on the data", icon="INFO")
        if body:
            for remark in measured.remarks:
                wrapped(body, f"{remark.what} ({Path(remark.where).name})")


def _verdict(layout, root, judged):
    box = layout.box()
    if judged.stale:
        box.alert = True
        wrapped(box, f"Stale: {judged.stale}. Diagnose again", "ERROR")
    column = box.column()
    column.active = not judged.stale
    headline = str(judged.summary.get("headline", ""))
    title = evidence.NAMES.get(judged.name, judged.name)
    title += f": {headline}" if judged.name in ("named", "ambiguous") else ""
    wrapped(column, title, ICONS[judged.name])
    if judged.summary.get("to_do"):
        wrapped(column, in_panel(str(judged.summary["to_do"])), "TOOL_SETTINGS")
    # Mechanism and parameters with their intervals, or why nothing is named.
    wrapped(column, str(judged.summary.get("sentence", "")))
    for cause in judged.verdict.get("causes") or ():
        if cause["rivals"]:
            rivals, named = ", ".join(map(readable, cause["rivals"])), readable(cause["effect"])
            wrapped(column, f"Equally well explained by {rivals} instead of {named}", "QUESTION")
    gain = (judged.verdict.get("gain") or {}).get("held_out") or {}
    if gain.get("rmse_before") is not None and judged.verdict.get("causes"):
        change = f"{gain['rmse_before']:.3g} -> {gain['rmse_after']:.3g} {gain['unit']}"
        wrapped(column, f"Error on held-out data {change}", "FORWARD")
    if judged.summary.get("next"):
        wrapped(column, f"Next: {judged.summary['next']}", "EXPERIMENTAL")
    _dependence(layout, judged)
    open_buttons(layout, evidence.DIAGNOSIS)
    if judged.name == "named":
        layout.operator("mu.evidence_apply", icon="CHECKMARK")
    words = evidence.applied(root)
    if words:
        wrapped(layout, f"Applied to the unit: {words}", "INFO")


def _dependence(layout, judged):
    """Quantities that the model's residuals depend on, the smallest p-value first."""
    rows = judged.dependence
    if not rows:
        return
    body = fold(layout, "MU_dependence", "Dependence of the Residual")
    if body:
        for against, p, where in rows[:ROWS]:
            row = body.split(factor=0.62)
            # The test of the residual's size depends on no quantity.
            name = "above stated noise" if against == "spread" else readable(against)
            row.label(text=name, icon="ERROR" if p < 0.01 else "BLANK1")
            row.label(text="p < 1e-16" if p < 1e-16 else f"p = {p:.2g}")
            if where not in ("", "all") and p < 0.01:
                wrapped(body, where, "BLANK1")
        if len(rows) > ROWS:
            body.label(text=f"{len(rows) - ROWS} more in the report")
