"""Paint factors on the struts' diameters, cell by cell, and apply them to the unit."""

import bpy

from ...errors import InputError
from ..shared import displays, viewports
from ..shared.operators import operator, unless
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import to_unit
from . import state


def _leave(context, root):
    """Return to the unit, in object mode, and remove the painted object."""
    viewports.object_mode(context)
    displays.remove(state.painted_on(root))
    unit_object.make_active(context, root)


@operator(ValidUnitOperator, "Paint Cells")
def paint_struts(context, root):
    """Paint how thick the struts of each cell are: weight 0 is half their diameter, 0.5 as drawn, 1 double"""
    if root.mu_unit.envelope is not None:
        raise InputError(
            "cells are counted in the lattice's box, and here it fills a body of your own",
            root.mu_unit.envelope.name,
            "grade it by the factors along the axis and to the sides",
        )
    viewports.object_mode(context)
    obj = state.painted_on(root) or state.begin(root, to_unit(root.mu_unit).grading_field)
    obj.hide_set(False)
    unit_object.make_active(context, obj)
    bpy.ops.object.mode_set(mode="WEIGHT_PAINT")


class _WhilePainting(UnitOperator):
    trouble = unless(state.painted_on, "No cells are being painted: use Paint Cells in the Lattice panel")


@operator(_WhilePainting, "Apply")
def paint_struts_apply(operator, context, root):
    """Give the struts of each cell the painted factor, on both sides of the bending plane"""
    obj, field = state.painted_on(root), to_unit(root.mu_unit).grading_field
    text = field.cells_of_factors(state.factors_on(obj, field))
    _leave(context, root)
    root.mu_unit.grading.cells = text
    if not unit_object.rebuild(root):
        operator.report({"ERROR"}, root.mu_unit.trouble)


@operator(_WhilePainting, "Discard")
def paint_struts_discard(context, root):
    """Leave the struts as they were before painting"""
    _leave(context, root)
