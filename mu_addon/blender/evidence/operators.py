"""Diagnose measured data, show their motion, and apply the named effects to the unit."""

from ...errors import InputError
from ..jobs import start_child
from ..jobs.operators import job_operators
from ..shared import viewports
from ..shared.blender_property import Text
from ..shared.operators import operator, unless
from ..simulate import effects
from ..simulate import study_folder as studies
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import to_unit
from . import state as evidence
from . import timeline

NO_DATA = "Choose a folder of measured data first"


def _evidence_diagnose_trouble(root):
    found = evidence.measured_data(root)
    if found is None or found.measured is None:
        why = found.trouble.partition("\n")[0] if found else NO_DATA
    else:
        why = "A diagnosis is running" if evidence.DIAGNOSIS.is_running(root) else start_child.lacking()
    return why


@operator(ValidUnitOperator, "Diagnose", undo=False, trouble=_evidence_diagnose_trouble)
def evidence_diagnose(root):
    """Compare measured data with the simulation and name the effects that explain the difference"""
    studies.assign_folder(root)
    evidence.DIAGNOSIS.start(
        root, evidence.folder_of(root), lambda folder: evidence.write_inputs(root, folder)
    )


def _evidence_apply_trouble(root):
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
    return why or start_child.lacking()


@operator(ValidUnitOperator, "Apply Extended Model", trouble=_evidence_apply_trouble)
def evidence_apply(operator, root):
    """Apply the named effects to the unit and its next simulation; undo removes them"""
    # Imported late: it needs the simulator's packages, which a Blender may lack.
    from ...simulate_and_place.extended_unit import read_extended

    found = evidence.diagnosis(root)
    extended = read_extended(to_unit(root.mu_unit), found.folder / evidence.MODEL)
    for words in extended.left_out:
        operator.report({"WARNING"}, f"Not applied: {words}")
    if not extended.applied:
        raise InputError("No part of the model corresponds to a parameter of a unit")
    beside = extended.effects.words()
    own = [words for words in extended.applied if words not in beside]
    evidence.mark_applied(root, "; ".join(own), "; ".join(beside))
    # The diagnosis ignored the simulation's earlier effects: its own replace them.
    effects.keep(root, extended.kept.text() if extended.effects else "")
    unit_object.take(root, extended.unit)
    operator.report({"INFO"}, f"Applied: {'; '.join(extended.applied)}")


@operator(
    UnitOperator,
    "Remove Effects",
    trouble=unless(effects.inputs, "The unit's simulation has no effects in addition to its parameters"),
)
def evidence_remove(root):
    """Remove the named effects from the unit's simulation; undo restores them"""
    effects.keep(root, "")
    viewports.redraw()


@operator(
    UnitOperator,
    "Show Measured Motion",
    experiment=Text("Experiment", "Name of an experiment of a unit under pressure; empty hides it"),
)
def evidence_motion(context, root, experiment):
    """Show an experiment on the timeline next to the unit, measured and simulated; press again to hide it"""
    if experiment:
        course = evidence.course(root, experiment)
        timeline.show(root, experiment, course, context.scene)
    else:
        timeline.hide(root)


@operator(
    UnitOperator,
    "Simulate These Pressures",
    experiment=Text("Experiment", "Name of an experiment of a unit under pressure"),
)
def evidence_protocol(root, experiment):
    """Use an experiment's pressures for the unit's next simulation, so that both play in the same time"""
    path = evidence.write_protocol(
        evidence.course(root, experiment), studies.assign_folder(root) / evidence.PROTOCOL
    )
    root.mu_unit.study.protocol = str(path)


job_operators(evidence.DIAGNOSIS, "diagnose first")
