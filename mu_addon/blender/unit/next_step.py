"""The next action on a unit: one button at the head of its panel."""

from __future__ import annotations

from ..evidence import state as evidence
from ..jobs.panel import whole
from ..simulate import study_folder as studies
from ..simulate.job import SIMULATION
from ..simulate.panel import start_words
from . import object as unit_object
from .fields import path_symbol

LETTERS = 14
"""Letters of a running stage's name; a longer one is numbered."""


def draw_next_step(row, root) -> None:
    """Draw the button of the next action on a unit, or the running job's progress, of the same height."""
    for kind in (SIMULATION, evidence.DIAGNOSIS):
        if kind.is_running(root):
            fraction, text = whole(kind.child(root), LETTERS)
            row.progress(factor=fraction, text=text)
            return
    data = evidence.measured_data(root)
    if data is not None and data.measured is not None and evidence.diagnosis(root) is None:
        row.operator("mu.evidence_diagnose", text="Diagnose the Data", icon="VIEWZOOM")
        return
    found = studies.findings(root)
    if found is None or found.stale or not found.run.complete:
        row.operator("mu.simulate", text=start_words(root), icon="PLAY")
        return
    best = found.ranking[0][0] if found.ranking else ""
    if best and root.mu_unit.path != best:
        row.operator("mu.path", text=f"Use Path {path_symbol(best)}", icon="CON_FOLLOWPATH").name = best
    elif not unit_object.solid_is_current(root):
        row.operator("mu.solid", text="Build Solid", icon="MESH_DATA")
    else:
        row.operator("mu.print_check", text="Check the Print", icon="VIEWZOOM")
