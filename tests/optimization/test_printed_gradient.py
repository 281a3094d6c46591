"""Gradients of a printed unit, strut by strut and with its walls in contact, against full solutions."""

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.model import Model
from mu_addon.meshing.settings import MeshSettings
from mu_addon.optimization.evaluation import evaluate
from mu_addon.optimization.freedoms import Freedom, changed_unit
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.quantities import AirVolume, Angle, RestStiffness, Stretch
from mu_addon.optimization.structure import solve
from mu_addon.optimization.targets import Target
from mu_addon.optimization.unit_body import Mechanics, UnitBody

MADE = load_preset("mu-1.0x")
UNIT = attrs.evolve(MADE, chambers=attrs.evolve(MADE.chambers, count=3))
SETTINGS = MeshSettings(refine=0.3, fidelity="resolved")
FREE = [
    Freedom("chambers.wall_mm", 0.6, 1.4),
    Freedom("chambers.neck_diameter_mm", 9.0, 15.0),
    Freedom("lattice.junction_diameter_mm", 1.2, 2.0),
    Freedom("grading.plus_y", 0.6, 1.5),
]


def full(body, freedom, value, asked):
    """Quantities of the unit with another value of a freedom, on this one's mesh moved."""
    moved = body.moved(changed_unit(UNIT, [freedom], [value]))
    model = Model(moved.model.mesh, threads=1)
    model.self_contact = moved.model.self_contact
    moved = attrs.evolve(moved, model=model, shared={})
    states, _ = solve(moved, {c for q in asked for c in q.conditions})
    return np.array([q.value(moved, states) for q in asked])


def largest_error(body, states, free, asked, share=2e-4):
    values = np.array([q.value(body.structure, states) for q in asked])
    found = gradients(body.structure, states, asked, body.pairs(free))
    worst = 0.0
    for f, freedom in enumerate(free):
        value = float(freedom.value_of(UNIT))
        step = share * min(value, freedom.high - freedom.low)
        slope = (full(body, freedom, value + step, asked) - full(body, freedom, value - step, asked)) / (
            2 * step
        )
        # What a freedom hardly moves is compared with a hundredth of the value over the freedom's range.
        floor = 0.01 * np.abs(values) / (freedom.high - freedom.low)
        worst = max(worst, (np.abs(found[:, f] - slope) / np.maximum(np.abs(slope), floor)).max())
    return worst


@pytest.mark.nightly(
    "tests/fem/test_sensitivity.py::test_it_is_the_derivative_by_places_shares_ties_and_stiffness"
)
@pytest.mark.parametrize("free", [FREE[::2], FREE[1::2]], ids=["size", "shape"])
def test_they_are_those_of_full_solutions_strut_by_strut(free):
    body = UnitBody(UNIT, Mechanics(SETTINGS))
    asked = [
        Angle("angle", 8.0), AirVolume("air", 8.0), Stretch("s", 8.0, "struts", 1.6), RestStiffness("k", "y"),
    ]  # fmt: skip
    states, _ = solve(body.structure, {c for q in asked for c in q.conditions})
    # Within a longer step another element has the largest stretch.
    assert largest_error(body, states, free, asked, share=2e-5) < 1e-4


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
    assert largest_error(body, states, FREE[::2], asked, share=1e-5) < 1e-4


def test_a_printed_units_sensor_is_refused_and_its_own_body_is_kept():
    asked = [Target("a", "deviation", "mm", None)]
    assert evaluate(UNIT, asked, (), Mechanics(MeshSettings(refine=0.3))).sound
    with pytest.raises(InputError, match="meshed with it"):
        UnitBody(UNIT, Mechanics(SETTINGS), {"alpha1": None}).structure  # noqa: B018
