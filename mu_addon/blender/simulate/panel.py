"""The panel Simulate: the job, its progress, and the effects that a diagnosis added."""

from __future__ import annotations

import bpy

from ...design.printing.finding import counted
from ..jobs import start_child
from ..jobs.panel import job_state, start_button, timed
from ..shared.panels import draw_settings, fields_of, wrapped
from ..unit import resins
from ..unit.base_classes import DONE, OUTDATED, UnitPanel, parameters
from . import effects
from . import study_folder as studies
from .job import SIMULATION, announced


class MU_PT_simulate(UnitPanel, bpy.types.Panel):
    """Motion and ranking of the sensor paths, computed in a child process"""

    bl_label = "Simulate"
    place = ("simulate",)

    @classmethod
    def mark(cls, root):
        if SIMULATION.is_running(root):
            return "TIME"
        found = studies.findings(root)
        return "" if found is None or not found.run.complete else OUTDATED if found.stale else DONE

    def show(self, layout, context, root):
        missing = start_child.missing()
        if missing:
            box = layout.box()
            wrapped(
                box,
                f"Cannot simulate: {', '.join(missing)} not found in this Blender. Design, solid and export "
                "still work. Install the extension built for this Blender and system.",
                "ERROR",
            )
        study = root.mu_unit.study
        layout.prop(study, "command")
        hidden = set() if study.command == "place" else {"paths", "all_paths"}
        hidden |= set() if study.self_contact else {"self_friction"}
        hidden |= set() if effects.has_gravity(root) else {"orientation_deg"}
        draw_settings(layout, fields_of(study, hidden))
        _effects(layout, root)
        child, expected = SIMULATION.child(root), announced(root)
        start_button(layout, child, "mu.simulate", "PLAY", root=root, text=timed("Simulate", expected))
        if study.command == "place" and not SIMULATION.is_running(root):
            words = timed("Quick Ranking", announced(root, quick=True))
            layout.operator("mu.simulate", text=words, icon="PLAY").quick = True
        if child is None and expected is not None and not expected[1]:
            wrapped(layout, "Perhaps: no such run has been timed on this machine yet", "TIME")
        job_state(layout, child, "see Results")
        others = [job for job in start_child.running() if job.key != SIMULATION.key(root)]
        if others:
            wrapped(layout, counted(len(others), "other job runs", "other jobs run"), "INFO")
        text = resins.name_of(root)
        layout.operator_menu_enum("mu.resin", "name", text=text, icon="MATERIAL")
        parameters(layout, root, "simulate")
        layout.prop(study, "folder")


def start_words(root) -> str:
    """Label of the button: the job, and its expected duration, measured on this machine or declared."""
    return timed("Simulate", announced(root))


def _effects(layout, root) -> None:
    """Draw the effects named by a diagnosis."""
    lines = effects.lines(root)
    if not lines:
        return
    box = layout.box()
    row = box.row()
    row.label(text="With named effects", icon="LIGHT")
    row.operator("mu.evidence_remove", text="", icon="X")
    for line in lines:
        wrapped(box, line)
