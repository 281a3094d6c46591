"""Tip force, position and workspace, with weight and without: slopes against full solutions, and what they
mean."""

from functools import cache

import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_run import Run, run
from mu_addon.fem.held_tip import STIFFNESS
from mu_addon.meshing.settings import MeshSettings
from mu_addon.optimization.freedoms import Freedom, changed_unit
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.quantities import Angle, TipForce, TipPosition, Workspace
from mu_addon.optimization.structure import solve
from mu_addon.optimization.unit_body import Mechanics, UnitBody
from mu_addon.simulate_and_place.named_effects import NamedEffects

UNIT = load_preset("mu-1.0x").evolve(count=3)
COARSE = MeshSettings(refine=0.2)
FREE = [
    Freedom("chambers.wall_mm", 0.6, 1.4),
    Freedom("material.membrane_modulus_kPa", 1000.0, 4000.0),
    Freedom("scale", 0.7, 1.5),
]
LEVEL = NamedEffects({"gravity": {"density_kg_m3": 1010.0}}, 90.0)
WITHOUT_WEIGHT = [
    TipForce("touching", 2.5),
    TipForce("farther", 2.5, 0.2),
    TipPosition("aside", 2.5),
    TipPosition("along", -4.0, "z"),
    Workspace("path", (-4.0, 2.5)),
]
WITH_WEIGHT = [
    Angle("at rest", 0.0),
    TipPosition("at rest, aside", 0.0),
    TipForce("force", 2.5, 0.2),
    Workspace("path", (2.5,)),
]


@cache
def solved(level):
    """The unit solved without its weight, or lying level with it: body, what is asked, states, values."""
    asked = WITH_WEIGHT if level else WITHOUT_WEIGHT
    body = UnitBody(UNIT, Mechanics(COARSE, load=LEVEL.load) if level else Mechanics(COARSE))
    states, _ = solve(body.structure, {c for q in asked for c in q.conditions})
    return body, asked, states, {q.name: q.value(body.structure, states) for q in asked}


@pytest.mark.nightly("test_a_larger_unit_presses_with_the_square_of_its_size")
@pytest.mark.parametrize(
    ("level", "free"), [(True, FREE), (False, FREE)], ids=["with weight", "without weight"]
)
def test_slopes_are_those_of_full_solutions_on_morphed_meshes(level, free):
    body, asked, states, values = solved(level)
    found = gradients(body.structure, states, asked, body.pairs(free))
    for f, freedom in enumerate(free):
        value = freedom.value_of(UNIT)
        sides = []
        for end in (1.0005 * value, 0.9995 * value):
            other = body.moved(changed_unit(UNIT, [freedom], [end]))
            moved, _ = solve(other, {c for q in asked for c in q.conditions})
            sides.append([q.value(other, moved) for q in asked])
        differences = (np.array(sides[0]) - sides[1]) / (1e-3 * value)
        floor = 0.01 * np.abs(list(values.values())) / (freedom.high - freedom.low)
        errors = np.abs(found[:, f] - differences) / np.maximum(np.abs(differences), floor)
        assert errors.max() < 1e-5, freedom.name


@pytest.mark.slow
def test_a_larger_unit_presses_with_the_square_of_its_size():
    body, asked, states, values = solved(level=False)
    found = gradients(body.structure, states, asked, body.pairs(FREE[2:]))[:, 0]
    # The wall's own stiffness does not grow with the unit: it gives way by its share of the tip's.
    tip = (values["touching"] - values["farther"]) / 0.2
    assert found[0] == pytest.approx((2 - tip / STIFFNESS) * values["touching"], rel=1e-4)
    assert found[4] == pytest.approx(values["path"], rel=1e-5)


@pytest.mark.slow
def test_the_tip_force_is_that_which_a_blocked_force_is_predicted_by():
    values = solved(level=False)[3]
    held = Body(UNIT, COARSE, gap_mm=0.0)
    reading = run(Run(held, (0.0, 2.5), (), "", 0.0, False)).values[0]
    assert reading[0] == pytest.approx(0.0, abs=1e-9)
    assert values["touching"] == pytest.approx(reading[1], rel=1e-6)


@pytest.mark.slow
def test_a_wall_farther_away_is_pressed_less():
    body, _, _, values = solved(level=False)
    asked = TipForce("force", 2.5, 2.0)
    states, _ = solve(body.structure, asked.conditions)
    # Out of reach it would have to be pulled.
    assert values["touching"] > values["farther"] > 0.0 > asked.value(body.structure, states)


@pytest.mark.slow
def test_the_path_to_one_place_is_the_way_there():
    body, _, _, _ = solved(level=False)
    places = [TipPosition(axis, 2.5, axis) for axis in "yz"]
    path = Workspace("path", (2.5,))
    states, _ = solve(body.structure, path.conditions)
    rest = [TipPosition(axis, 0.0, axis).value(body.structure, states) for axis in "yz"]
    way = np.hypot(*(p.value(body.structure, states) - r for p, r in zip(places, rest, strict=True)))
    assert path.value(body.structure, states) == pytest.approx(way, rel=1e-12)
