"""The user's own body: check it, make it the unit's envelope, remove it."""

from ...design.body import require_sound
from ...design.printing.repair import repaired
from ...errors import InputError
from ..shared.operators import operator
from ..shared.wording import sentence
from ..unit import envelope
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator
from ..unit.properties import to_unit
from . import state as bodies


def selected_meshes(context):
    """Selected meshes that are no parts of a unit; raises InputError without any."""
    found = [o for o in context.selected_objects if o.type == "MESH" and unit_object.root_of(o) is None]
    if not found:
        raise InputError("no mesh is selected besides the unit", "selection", "select a closed mesh")
    return found


def selected_mesh(context):
    """The selected mesh that is not a part of a unit; raises InputError unless there is exactly one."""
    found = selected_meshes(context)
    if len(found) > 1:
        raise InputError(
            f"{len(found)} meshes are selected besides the unit", "selection", "select one closed mesh"
        )
    return found[0]


def report_flaws(operator, root, found, sound):
    """Mark the locations of a body's flaws and report them; the text `sound` without any."""
    bodies.mark(root, [place for flaw in found for place in flaw.places])
    if not found:
        operator.report({"INFO"}, sound)
    for flaw in found:
        operator.report({"WARNING"}, f"{sentence(flaw.what)}: {flaw.remedy}")


@operator(UnitOperator, "Check Body")
def body_check(operator, context, root):
    """Check the selected mesh for open edges, self-intersections, size and fit; mark the places"""
    body = bodies.of_object(selected_mesh(context), root)
    found = bodies.examined(body, to_unit(root.mu_unit).dimensions)
    report_flaws(operator, root, found, f"{body.name} can be an envelope: {len(body.triangles)} triangles")


@operator(UnitOperator, "Repair Copy")
def body_repair(operator, context, root):
    """Repair a copy of the selected mesh where there is only one way: flipped or doubled faces, tiny gaps"""
    obj = selected_mesh(context)
    mended = repaired(*bodies.arrays_of(obj, root))
    if not mended.is_whole:
        remains = "; ".join(mended.remains)
        raise InputError(f"only by hand: {remains}", obj.name, "Check Body marks the places")
    if not mended.changes:
        operator.report({"INFO"}, f"{obj.name} needs no repair")
        return {"CANCELLED"}
    bodies.put_repaired(obj, root, mended)
    for line in mended.lines():
        operator.report({"WARNING"}, sentence(line))
    return None


@operator(UnitOperator, "Use as Envelope")
def body(context, root):
    """Make a copy of the selected mesh the unit's envelope, which the lattice then fills"""
    obj = selected_mesh(context)
    body = bodies.of_object(obj, root)
    require_sound(body, bodies.examined(body, to_unit(root.mu_unit).dimensions))
    envelope.put(root, body)
    obj.hide_set(True)
    bodies.mark(root, [])
    unit_object.rebuild(root)


@operator(UnitOperator, "Remove Body")
def body_remove(root):
    """Remove your own body from the unit: the lattice fills its box again"""
    envelope.remove(root)
    bodies.mark(root, [])
    unit_object.rebuild(root)
