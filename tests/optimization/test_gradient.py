"""Gradients of a unit's angle, air, stretch and stiffness against full solutions on morphed meshes."""

import numpy as np
import pytest

from mu_addon.design.anchors import window
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.moved_nodes import relocated
from mu_addon.meshing.settings import MeshSettings
from mu_addon.optimization.freedoms import Freedom, changed_unit
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.quantities import AirVolume, Angle, RestStiffness, Stretch
from mu_addon.optimization.sensor_quantities import Disturbance
from mu_addon.optimization.structure import Structure, solve
from mu_addon.optimization.unit_body import Mechanics, UnitBody

UNIT = load_preset("mu-1.0x")
COARSE = Mechanics(MeshSettings(refine=0.3))
FREE = [
    Freedom("chambers.wall_mm", 0.6, 1.4),
    Freedom("chambers.neck_diameter_mm", 9.0, 15.0),
    Freedom("chambers.bladder_share", 0.45, 0.7),
    Freedom("chambers.base_cap_mm", 1.0, 3.0),
    Freedom("material.lattice_modulus_kPa", 5.0, 60.0),
    Freedom("material.membrane_poisson", 0.3, 0.49),
    Freedom("print.offset_xy_mm", 0.0, 0.2),
    Freedom("scale", 0.7, 1.5),
    Freedom("grading.cells[* -1 *]", 0.5, 1.5),
    Freedom("chambers.wall_factors[2]", 0.6, 1.5),
    Freedom("chambers.cell_mm", 10.0, 15.0, also={"chambers.bladder_diameter_mm": 2.0}),
]
ASKED = [
    Angle("blown", 20.0),
    Angle("sucked", -8.0),
    AirVolume("drawn"),
    AirVolume("filled", 20.0),
    Stretch("stretch", 20.0),
    Stretch("safety", 20.0, "wall", 1.6),
    RestStiffness("x", "x"),
    RestStiffness("y", "y"),
    RestStiffness("z", "z"),
]
CONDITIONS = {c for q in ASKED for c in q.conditions}


@pytest.fixture(scope="module")
def body():
    found = UnitBody(UNIT, COARSE)
    states, _ = solve(found.structure, CONDITIONS)
    return found, states


@pytest.mark.nightly(
    "tests/optimization/test_tip.py::test_slopes_are_those_of_full_solutions_on_morphed_meshes"
)
def test_they_are_those_of_full_solutions_on_morphed_meshes(body):
    unit, states = body
    values = np.array([q.value(unit.structure, states) for q in ASKED])
    found = gradients(unit.structure, states, ASKED, unit.pairs(FREE))
    for f, freedom in enumerate(FREE):
        value = freedom.value_of(UNIT)
        step = 5e-4 * min(abs(value) or np.inf, freedom.high - freedom.low)
        ends = [value + step, value - step if freedom.name != "print.offset_xy_mm" else value]
        sides = []
        for end in ends:
            other = unit.moved(changed_unit(UNIT, [freedom], [end]))
            moved, _ = solve(other, CONDITIONS)
            sides.append([q.value(other, moved) for q in ASKED])
        differences = (np.array(sides[0]) - sides[1]) / (ends[0] - ends[1])
        # What a freedom hardly moves is compared with a hundredth of the value over the freedom's range.
        floor = 0.01 * np.abs(values) / (freedom.high - freedom.low)
        errors = np.abs(found[:, f] - differences) / np.maximum(np.abs(differences), floor)
        # One-sided at the offset's bound, hence of first order there.
        assert errors.max() < (1e-4 if len(set(ends)) == 2 and value > 0 else 2e-3), freedom.name


@pytest.mark.slow
def test_a_unit_scales_without_bending_otherwise(body):
    """Without a length of its own an elastic body's angle does not change, and its stiffness grows with
    it."""
    unit, states = body
    found = gradients(unit.structure, states, ASKED, unit.pairs([FREE[7]]))[:, 0]
    values = [q.value(unit.structure, states) for q in ASKED]
    assert abs(found[0]) < 1e-4 * values[0]
    assert found[2] == pytest.approx(3 * values[2], rel=1e-6)
    np.testing.assert_allclose(found[6:], values[6:], rtol=1e-5)


def test_a_body_in_contact_is_not_relocated(body):
    model = body[0].structure.model
    model.obstacles = (object(),)
    try:
        with pytest.raises(InputError, match="in contact"):
            relocated(model, body[0].mesh)
    finally:
        model.obstacles = ()
    assert isinstance(body[0].structure, Structure)


@pytest.mark.slow
def test_the_sensors_disturbance_has_the_slope_of_full_solutions():
    """Of a difference of two bodies, hence by one solution a freedom in each."""
    unit = UnitBody(UNIT, COARSE, {"alpha4": window(UNIT, "alpha4")})
    asked = [Disturbance("J", "alpha4", (-8.0, 15.0))]
    states, _ = solve(unit.structure, asked[0].conditions)
    found = gradients(unit.structure, states, asked, unit.pairs(FREE[:1]))[0, 0]
    sides = []
    for wall in (0.9005, 0.8995):
        other = unit.moved(changed_unit(UNIT, FREE[:1], [wall]))
        moved, _ = solve(other, asked[0].conditions)
        sides.append(asked[0].value(other, moved))
    assert found == pytest.approx((sides[0] - sides[1]) / 1e-3, rel=1e-4)
