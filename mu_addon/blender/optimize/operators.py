"""List targets and freedoms, start the search, and take a proposed unit into the scene."""

import attrs

from ...errors import InputError
from ..jobs.operators import job_operators
from ..shared import landing
from ..shared.blender_property import Choice, Integer
from ..shared.operators import operator, unless
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from . import state as optimization

LONGEST_TITLE = 80
_LIST = Choice(
    "List",
    "Which list",
    items=[("targets", "Targets", "Targets of the unit"), ("freedoms", "Freedoms", "What may change")],
)


@operator(UnitOperator, "Add to List", what=_LIST)
def optimize_list(root, what):
    """Add a target, or a parameter that may change, to the unit's list"""
    props = root.mu_optimize
    row = getattr(props, what).add()
    if what == "freedoms":
        taken = {freedom.parameter for freedom in props.freedoms[:-1]}
        # Set explicitly, so that its range is that of the unit.
        row.parameter = next((name for name in FIRST if name not in taken), FIRST[0])


FIRST = (
    "chambers.wall_mm",
    "chambers.neck_diameter_mm",
    "chambers.bladder_share",
    "material.membrane_modulus_kPa",
    "scale",
)
"""Order in which the list proposes parameters: those with most effect on a unit's angle come first."""


@operator(
    UnitOperator, "Remove from List", what=_LIST, index=Integer("Row", "Row of the list, from 0", min=0)
)
def optimize_unlist(root, what, index):
    """Remove a target, or a parameter that may change, from the unit's list"""
    rows = getattr(root.mu_optimize, what)
    if index >= len(rows):
        raise InputError(f"the list has {len(rows)} rows")
    rows.remove(index)


@operator(ValidUnitOperator, "Optimize", undo=False, trouble=optimization.OPTIMIZE.trouble)
def optimize(root):
    """Search for units that meet the targets, in a child process; simulated units are kept"""
    optimization.OPTIMIZE.start(root)


class _OfProposed(UnitOperator):
    """Takes a proposed unit; greyed out, with the reason, where none is proposed."""

    trouble = unless(optimization.proposed, "No unit is proposed: run the optimisation first")


_NUMBER = Integer("Proposed Unit", "Number of the proposed unit", default=1, min=1)


@operator(_OfProposed, "Apply", number=_NUMBER)
def optimize_apply(root, number):
    """Give the unit the parameters of a proposed one; undo takes them back"""
    core = attrs.evolve(optimization.proposed_unit(root, number), name=root.mu_unit.title)
    if not unit_object.take(root, core):
        raise InputError(root.mu_unit.trouble)


@operator(_OfProposed, "Add Beside", number=_NUMBER)
def optimize_add(context, root, number):
    """Add a proposed unit to the scene, next to the present one"""
    core = optimization.proposed_unit(root, number)
    end = f" {number}"
    title = root.mu_unit.title[: LONGEST_TITLE - len(end)] + end
    added = unit_object.create(context, attrs.evolve(core, name=title))
    added.location = root.matrix_world.translation
    landing.land(context, added)


job_operators(optimization.OPTIMIZATION, "run the optimisation first")
