"""Gradients of a printed unit, with a sensor, and with its walls in contact, against full solutions."""

from functools import cache

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.model import Model
from mu_addon.fem.moved_nodes import relocated
from mu_addon.meshing.settings import MeshSettings
from mu_addon.optimization import unit_body
from mu_addon.optimization.evaluation import evaluate
from mu_addon.optimization.freedoms import Freedom, changed_unit
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.quantities import AirVolume, Angle, RestStiffness, Stretch
from mu_addon.optimization.sensor_quantities import Disturbance, SensorSlope
from mu_addon.optimization.structure import solve
from mu_addon.optimization.targets import Target
from mu_addon.optimization.unit_body import Mechanics, UnitBody

UNIT = load_preset("mu-1.0x").evolve(count=3)
SETTINGS = MeshSettings(refine=0.3)
COARSE = MeshSettings(refine=0.2)
FREE = [
    Freedom("chambers.wall_mm", 0.6, 1.4),
    Freedom("chambers.neck_diameter_mm", 9.0, 15.0),
    Freedom("lattice.junction_diameter_mm", 1.2, 2.0),
    Freedom("grading.plus_y", 0.6, 1.5),
    Freedom("material.membrane_poisson", 0.3, 0.49),
    Freedom("chambers.wall_factors[2]", 0.6, 1.5),
    Freedom("chambers.cell_mm", 10.0, 15.0, also={"chambers.bladder_diameter_mm": 2.0}),
]


@cache
def coarse():
    return UnitBody(UNIT, Mechanics(COARSE))


def full(body, freedom, value, asked):
    """Quantities of the unit with another value of a freedom, on this one's mesh moved."""

    def alone(structure):
        model = Model(structure.model.mesh, threads=1)
        model.self_contact = structure.model.self_contact
        # The light of similar units is by one law.
        shared = {name: found for name, found in structure.shared.items() if name == "light"}
        return attrs.evolve(
            structure, model=model, shared=shared, with_sensor=lambda path: alone(structure.of(path))
        )

    moved = alone(body.moved(changed_unit(UNIT, [freedom], [value])))
    states, _ = solve(moved, {c for q in asked for c in q.conditions})
    return np.array([q.value(moved, states) for q in asked])


def largest_error(body, states, free, asked, share=2e-4):
    values = np.array([q.value(body.structure, states) for q in asked])
    found = gradients(body.structure, states, asked, body.pairs(free))
    worst = 0.0
    for f, freedom in enumerate(free):
        value = float(freedom.value_of(UNIT))
        step = share * min(value or np.inf, freedom.high - freedom.low)
        slope = (full(body, freedom, value + step, asked) - full(body, freedom, value - step, asked)) / (
            2 * step
        )
        # What a freedom hardly moves is compared with a hundredth of the value over the freedom's range.
        floor = 0.01 * np.abs(values) / (freedom.high - freedom.low)
        worst = np.maximum(worst, (np.abs(found[:, f] - slope) / np.maximum(np.abs(slope), floor)).max())
    return worst


@pytest.mark.nightly(
    "tests/fem/test_sensitivity.py::test_it_is_the_derivative_by_places_shares_ties_and_stiffness"
)
@pytest.mark.parametrize("free", [FREE[:4:2], [*FREE[1:4:2], *FREE[5:]]], ids=["size", "shape"])
def test_they_are_those_of_full_solutions_strut_by_strut(free):
    body = UnitBody(UNIT, Mechanics(SETTINGS))
    asked = [
        Angle("angle", 8.0), AirVolume("air", 8.0), Stretch("s", 8.0, "struts", 1.6), RestStiffness("k", "y"),
    ]  # fmt: skip
    states, _ = solve(body.structure, {c for q in asked for c in q.conditions})
    # Within a longer step another element has the largest stretch.
    assert largest_error(body, states, free, asked, share=2e-5) < 1e-4


@pytest.mark.nightly("test_a_unit_scales_without_bending_otherwise")
def test_they_are_those_of_full_solutions_by_the_resin():
    asked = [Angle("angle", 8.0), AirVolume("air", 8.0)]
    states, _ = solve(coarse().structure, asked[0].conditions)
    assert largest_error(coarse(), states, FREE[4:5], asked, share=5e-4) < 1e-4


@pytest.mark.nightly(
    "tests/fem/test_sensitivity.py::test_it_is_the_derivative_by_places_shares_ties_and_stiffness"
)
def test_they_are_those_of_full_solutions_where_walls_touch():
    body = UnitBody(UNIT, Mechanics(SETTINGS, self_contact=True))
    asked = [Angle("angle", -25.0), AirVolume("air", -25.0)]
    states, _ = solve(body.structure, {c for q in asked for c in q.conditions})
    (u,) = states.values()
    assert body.structure.model.self_contact.count(u) > 10, "it touches itself"
    # Distances of touching pairs have kinks in their slope: a difference errs in proportion to its step.
    assert largest_error(body, states, FREE[:4:2], asked, share=1e-5) < 1e-4


EVERY = pytest.mark.nightly("test_those_of_a_sensor_are_those_of_full_solutions")
OFFSET = Freedom("print.offset_xy_mm", -0.3, 0.5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "freedom",
    [FREE[0], *(pytest.param(f, marks=EVERY) for f in FREE[1:4]), pytest.param(OFFSET, marks=EVERY)],
    ids=lambda freedom: freedom.name,
)
def test_those_of_a_sensor_are_those_of_full_solutions(freedom):
    asked = [Disturbance("J", "alpha1", (2.5,)), SensorSlope("slope", "alpha1", (2.5,))]
    states, _ = solve(coarse().structure, {c for q in asked for c in q.conditions})
    assert largest_error(coarse(), states, [freedom], asked) < 1e-4


def test_a_path_without_room_for_a_sensor_is_an_answer(monkeypatch):
    def refusing(*_):
        raise InputError("the path has no space for a seat", "path", "choose another")

    monkeypatch.setattr(unit_body, "bar_of", refusing)
    asked = [Target("J", "deviation", "mm", Disturbance("J", "alpha1", (1.0,)))]
    found = evaluate(UNIT, asked, (), Mechanics(COARSE))
    assert not found.sound
    assert found.why == "the path has no space for a seat"


@pytest.mark.slow
def test_a_unit_scales_without_bending_otherwise():
    """Without a length of its own an elastic body's angle does not change, and its stiffness grows with
    it."""
    body = coarse()
    asked = [Angle("angle", 2.5), AirVolume("air"), *(RestStiffness(axis, axis) for axis in "xyz")]
    states, _ = solve(body.structure, asked[0].conditions)
    values = [q.value(body.structure, states) for q in asked]
    found = gradients(body.structure, states, asked, body.pairs([Freedom("scale", 0.7, 1.5)]))[:, 0]
    assert abs(found[0]) < 1e-4 * values[0]
    assert found[1] == pytest.approx(3 * values[1], rel=1e-6)
    np.testing.assert_allclose(found[2:], values[2:], rtol=1e-5)


def test_a_body_in_contact_is_not_relocated():
    body = UnitBody(UNIT, Mechanics(COARSE))
    model = body.structure.model
    model.obstacles = (object(),)
    with pytest.raises(InputError, match="in contact"):
        relocated(model, body.mesh)
