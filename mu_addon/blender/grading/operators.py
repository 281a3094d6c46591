"""Paint factors on the struts' diameters, cell by cell, and apply them to the unit."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import bpy

from ...errors import InputError
from ..shared import displays
from ..unit import object as unit_object
from ..unit.base_classes import UnitOperator, ValidUnitOperator
from ..unit.properties import to_unit
from . import state


def _leave(context, root):
    """Return to the unit, in object mode, and remove the painted object."""
    if context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    displays.remove(state.painted_on(root))
    unit_object.make_active(context, root)


class MU_OT_paint_struts(ValidUnitOperator, bpy.types.Operator):
    """Paint how thick the struts of each cell are: weight 0 is half their diameter, 0.5 as drawn, 1 double"""

    bl_idname = "mu.paint_struts"
    bl_label = "Paint Cells"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        if root.mu_unit.envelope is not None:
            raise InputError(
                "cells are counted in the lattice's box, and here it fills a body of your own",
                root.mu_unit.envelope.name,
                "grade it by the factors along the axis and to the sides",
            )
        if context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
        obj = state.painted_on(root) or state.begin(root, to_unit(root.mu_unit).grading_field)
        obj.hide_set(False)
        unit_object.make_active(context, obj)
        bpy.ops.object.mode_set(mode="WEIGHT_PAINT")


class _WhilePainting(UnitOperator):
    @classmethod
    def trouble(cls, root):
        painting = state.painted_on(root) is not None
        return "" if painting else "No cells are being painted: use Paint Cells in the Lattice panel"


class MU_OT_paint_struts_apply(_WhilePainting, bpy.types.Operator):
    """Give the struts of each cell the painted factor, on both sides of the bending plane"""

    bl_idname = "mu.paint_struts_apply"
    bl_label = "Apply"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        obj, field = state.painted_on(root), to_unit(root.mu_unit).grading_field
        text = field.cells_of_factors(state.factors_on(obj, field))
        _leave(context, root)
        root.mu_unit.grading.cells = text
        if not unit_object.rebuild(root):
            self.report({"ERROR"}, root.mu_unit.trouble)


class MU_OT_paint_struts_discard(_WhilePainting, bpy.types.Operator):
    """Leave the struts as they were before painting"""

    bl_idname = "mu.paint_struts_discard"
    bl_label = "Discard"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context, root):
        _leave(context, root)


CLASSES = (MU_OT_paint_struts, MU_OT_paint_struts_apply, MU_OT_paint_struts_discard)


register, unregister = bpy.utils.register_classes_factory(CLASSES)
