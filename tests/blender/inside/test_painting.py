"""Factors on the struts' diameters, painted cell by cell."""

import bpy
import numpy as np

from mu_addon.blender.grading import state
from mu_addon.blender.unit.properties import to_unit

from .acting import add, refused


def paint(obj, cells, weight):
    """All corners of some cells' cubes, as a stroke of the brush over them leaves them."""
    group = obj.vertex_groups.active
    for cell in cells:
        group.add(list(range(8 * cell, 8 * cell + 8)), weight, "REPLACE")


def test_a_painted_cell_gets_its_factor_and_the_others_stay_as_they_are():
    root = add()
    before = len(bpy.data.objects)
    assert bpy.ops.mu.paint_struts() == {"FINISHED"}
    obj = state.painted_on(root)
    assert (bpy.context.mode, bpy.context.object) == ("PAINT_WEIGHT", obj)
    field = to_unit(root.mu_unit).grading_field
    centres = field.cell_centres.reshape(-1, 3)
    corners = np.array([v.co for v in obj.data.vertices]).reshape(-1, 8, 3)
    np.testing.assert_allclose(corners.mean(axis=1), centres, atol=1e-4)
    # The outermost cell on the +y side of the first chamber, and that of the last.
    row = field.y_minus + field.y_plus
    cells = [np.ravel_multi_index((0, row, k), field.cell_factors.shape) for k in (0, field.count - 1)]
    paint(obj, cells[:1], 0.0)
    paint(obj, cells[1:], 1.0)
    assert bpy.ops.mu.paint_struts_apply() == {"FINISHED"}
    assert root.mu_unit.grading.cells == f"0 {field.y_plus} 1: 0.5; 0 {field.y_plus} {field.count}: 2.0"
    assert (bpy.context.mode, bpy.context.object) == ("OBJECT", root)
    assert len(bpy.data.objects) == before
    factors = to_unit(root.mu_unit).dimensions.strut_factors(centres[cells])
    np.testing.assert_allclose(factors, [0.5, 2.0])


def test_painting_goes_on_from_the_present_cells_and_a_discarded_one_changes_nothing():
    root = add()
    root.mu_unit.grading.cells = "0 2 3: 0.8"
    bpy.ops.mu.paint_struts()
    obj = state.painted_on(root)
    field = to_unit(root.mu_unit).grading_field
    np.testing.assert_allclose(state.factors_on(obj, field), field.cell_factors, rtol=1e-6)
    paint(obj, [0], 1.0)
    assert bpy.ops.mu.paint_struts_discard() == {"FINISHED"}
    assert root.mu_unit.grading.cells == "0 2 3: 0.8"
    bpy.ops.mu.paint_struts()
    assert bpy.ops.mu.paint_struts_apply() == {"FINISHED"}
    assert root.mu_unit.grading.cells == "0 2 3: 0.8"


def test_cells_that_changed_meanwhile_are_not_given_the_wrong_factor():
    root = add()
    bpy.ops.mu.paint_struts()
    paint(state.painted_on(root), [3], 1.0)
    root.mu_unit.chambers.count = 5
    said = refused(bpy.ops.mu.paint_struts_apply)
    assert "other cells now" in said, said
    assert root.mu_unit.grading.cells == ""
    assert bpy.ops.mu.paint_struts_discard() == {"FINISHED"}
    assert not bpy.ops.mu.paint_struts_apply.poll()
