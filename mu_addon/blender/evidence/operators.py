"""Diagnose measured data, show their motion, and apply the named effects to the unit."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy
from bpy.props import StringProperty

from ..jobs import start_child
from ..jobs.operators import job_operators
from ..shared import updates, viewports
from ..simulate import effects
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import from_unit, to_unit
from . import state as evidence
from . import timeline as evidence_motion

NO_DATA = "Choose a folder of measured data first"


class MU_OT_evidence_diagnose(ValidUnitOperator, bpy.types.Operator):
    """Compare measured data with the simulation and name the effects that explain the difference"""

    bl_idname = "mu.evidence_diagnose"
    bl_label = "Diagnose"
    bl_options = {"REGISTER"}

    @classmethod
    def trouble(cls, root):
        found = evidence.measured_data(root)
        if found is None or found.measured is None:
            why = found.trouble.partition("\n")[0] if found else NO_DATA
        else:
            why = "A diagnosis is running" if evidence.DIAGNOSIS.is_running(root) else start_child.lacking()
        return super().trouble(root) or why

    def act(self, context, root):
        studies.assign_folder(root)
        evidence.DIAGNOSIS.start(
            root, evidence.folder_of(root), lambda folder: evidence.write_inputs(root, folder)
        )
        viewports.redraw()


class MU_OT_evidence_apply(ValidUnitOperator, bpy.types.Operator):
    """Apply the named effects to the unit and its next simulation; undo removes them"""

    bl_idname = "mu.evidence_apply"
    bl_label = "Apply Extended Model"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def trouble(cls, root):
        found = evidence.diagnosis(root)
        if found is None or not found.name:
            why = "Diagnose the measured data first"
        elif found.stale:
            why = f"The diagnosis is stale: {found.stale}"
        elif found.name == "ambiguous":
            why = "Several effects explain the data equally well: measure first what tells them apart"
        elif found.name != "named":
            why = "No effect was named that could be applied"
        else:
            why = "This model is already applied: undo removes it" if evidence.applied(root) else ""
        return super().trouble(root) or why or start_child.lacking()

    def act(self, context, root):
        # Imported late: it needs the simulator's packages, which a Blender may lack.
        from ...usecases.simulate_and_place.extended_unit import read_extended

        found = evidence.diagnosis(root)
        extended = read_extended(to_unit(root.mu_unit), found.folder / evidence.MODEL)
        for words in extended.left_out:
            self.report({"WARNING"}, f"Not applied: {words}")
        if not extended.applied:
            self.report({"ERROR"}, "No part of the model corresponds to a parameter of a unit")
            return {"CANCELLED"}
        beside = extended.effects.words()
        own = [words for words in extended.applied if words not in beside]
        evidence.mark_applied(root, "; ".join(own), "; ".join(beside))
        with updates.paused():
            from_unit(root.mu_unit, extended.unit)
        # The diagnosis ignored the simulation's earlier effects: its own replace them.
        effects.keep(root, extended.kept.text() if extended.effects else "")
        unit_object.rebuild(root)
        self.report({"INFO"}, f"Applied: {'; '.join(extended.applied)}")
        return {"FINISHED"}


class MU_OT_evidence_remove(UnitOperator, bpy.types.Operator):
    """Remove the named effects from the unit's simulation; undo restores them"""

    bl_idname = "mu.evidence_remove"
    bl_label = "Remove Effects"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def trouble(cls, root):
        return (
            ""
            if effects.inputs(root)
            else "The unit's simulation has no effects in addition to its parameters"
        )

    def act(self, context, root):
        effects.keep(root, "")
        viewports.redraw()


class MU_OT_evidence_motion(UnitOperator, bpy.types.Operator):
    """Show an experiment on the timeline next to the unit, measured and simulated; press again to hide it"""

    bl_idname = "mu.evidence_motion"
    bl_label = "Show Measured Motion"
    bl_options = {"REGISTER", "UNDO"}

    experiment: StringProperty(
        name="Experiment", description="Name of an experiment of a unit under pressure; empty hides it"
    )

    def act(self, context, root):
        if not self.experiment:
            evidence_motion.hide(root)
            return {"FINISHED"}
        course = evidence.course(root, self.experiment)
        if course is None:
            self.report({"ERROR"}, f"No unit under pressure was measured as {self.experiment!r}")
            return {"CANCELLED"}
        evidence_motion.show(root, self.experiment, course, context.scene)
        return {"FINISHED"}


class MU_OT_evidence_protocol(UnitOperator, bpy.types.Operator):
    """Use an experiment's pressures for the unit's next simulation, so that both play in the same time"""

    bl_idname = "mu.evidence_protocol"
    bl_label = "Simulate These Pressures"
    bl_options = {"REGISTER", "UNDO"}

    experiment: StringProperty(
        name="Experiment", description="Name of an experiment of a unit under pressure"
    )

    def act(self, context, root):
        course = evidence.course(root, self.experiment)
        if course is None:
            self.report({"ERROR"}, f"No unit under pressure was measured as {self.experiment!r}")
            return {"CANCELLED"}
        path = evidence.write_protocol(course, studies.assign_folder(root) / evidence.PROTOCOL)
        root.mu_unit.study.protocol = str(path)
        return {"FINISHED"}


CLASSES = (
    MU_OT_evidence_protocol,
    MU_OT_evidence_diagnose,
    *job_operators(
        evidence.DIAGNOSIS,
        "evidence_",
        "diagnosis",
        kept="finished simulations are kept, and the next run continues from there",
        first="diagnose first",
    ),
    MU_OT_evidence_apply,
    MU_OT_evidence_remove,
    MU_OT_evidence_motion,
)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
