"""What the unit's own finite elements hide from a verdict that knows them: a wall, layers, a coarse mesh."""

import attrs
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.effect import offered
from mu_addon.evidence.effects.contact import with_flat_obstacle
from mu_addon.evidence.effects.declaration import Data
from mu_addon.evidence.prediction.unit_pressure import UnitPressure
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_fem import unit_responses
from mu_addon.evidence.unit_run import Run, run
from mu_addon.evidence.unit_settings import UnitSettings
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.newton_settings import CONTACT_NEWTON
from mu_addon.fem.wall_law import layer_stiffness
from mu_addon.meshing.settings import MeshSettings
from tests.evidence import analytic
from tests.evidence.hollow_finger import STIFF, beam, in_place_of_units

ROUGH, SMOOTH, FINEST = (MeshSettings(refine=refine) for refine in (0.35, 0.7, 1.0))
LOW, HIGH = -10.0, 20.0


@pytest.fixture(scope="module", autouse=True)
def fingers():
    with in_place_of_units(beam):
        yield


def measured(angle_of=lambda p: 0.0 * p, noise=0.05, seed=1, **more):
    """Three cycles at two rates of an angle that is a function of pressure, with white noise in degrees."""
    random = np.random.default_rng(seed)
    found = []
    for period, name in ((10.0, "slow"), (3.0, "fast")):
        t, p = analytic.triangle(0.1, period, 3, LOW, HIGH)
        angle = angle_of(p) + noise * random.standard_normal(len(p))
        found.append(analytic.experiment(name, t, p, {"angle_deg": angle}, **more))
    return found


def judged(tests, responses):
    return diagnose(tests, Composite({"unit_pressure": UnitPressure(responses, tests)}))


@pytest.fixture(scope="module")
def walls(tmp_path_factory):
    effects = ("contact", "strain_stiffening", "wall_thickness")
    settings = UnitSettings(ROUGH, ROUGH, 8, effects=effects, whole=None, self_contact=False, workers=1)
    kept = tmp_path_factory.mktemp("runs")
    return unit_responses(STIFF, [*measured(), *measured(scale=0.5)], settings, kept)


def test_walls_of_half_the_unit_stand_half_as_far(walls):
    half, whole = sorted(walls, key=lambda r: r.scale)
    assert set(whole.walls) == {1, -1}
    for side, wall in whole.walls.items():
        small = half.walls[side]
        assert small.farthest_mm == pytest.approx(0.5 * wall.farthest_mm, rel=1e-9)
        # Counted from where the larger unit gets to: one wall for both.
        assert small.spare_mm == pytest.approx(0.5 * wall.farthest_mm, rel=1e-9)
        np.testing.assert_allclose(small.changes, wall.changes, rtol=1e-9)
        assert small.change(wall.pressures_kPa, 0.4 * wall.farthest_mm).any() == np.False_


def test_a_wall_changes_nothing_before_it_is_met_and_the_more_the_nearer_it_is(walls):
    whole = max(walls, key=lambda r: r.scale)
    pressure = np.linspace(LOW, HIGH, 121)
    free = whole.at(pressure, {})
    for side, wall in whole.walls.items():
        before = np.zeros_like(pressure)
        for reach in (1e-6, 0.2, 0.4, 0.6, 0.8):
            size = side * reach * wall.farthest_mm
            change = (whole.at(pressure, {"contact": size}) - free)[0]
            met = wall.met_kPa(abs(size))
            assert not change[side * pressure <= side * met].any()
            # It holds the unit back, the more the farther it reaches in.
            assert (side * change <= 1e-9).all()
            assert (side * change <= side * before + 0.02).all()
            before = change
        # With most of the way barred, a good part of the bending on that side is lost.
        assert np.abs(before).max() > 0.2 * np.abs(free[0][np.sign(pressure) == side]).max()


def test_walls_nearer_than_those_computed_are_not_guessed(walls):
    whole = max(walls, key=lambda r: r.scale)
    wall = whole.walls[1]
    fewer = attrs.evolve(wall, reaches_mm=wall.reaches_mm[:-1], changes=wall.changes[:-1])
    data = Data(kind="unit_pressure", walls=((1, fewer), (-1, whole.walls[-1])))
    (size,) = next(e for e in offered(data) if e.name == "contact").parameters
    assert size.high == wall.reaches_mm[-2]
    assert size.low == -whole.walls[-1].reaches_mm[-1]


def test_the_table_of_walls_is_the_simulation_between_its_points(walls):
    """A wall and pressures that were not computed: within 2 % of the free angle."""
    whole = max(walls, key=lambda r: r.scale)
    wall = whole.walls[1]
    reach = 0.35 * wall.farthest_mm
    pressure = np.array([8.0, 0.7 * wall.met_kPa(reach) + 0.3 * HIGH, 19.0])
    body = Body(STIFF, ROUGH)
    direct = run(Run(body, tuple(pressure), (), "contact", wall.farthest_mm - reach)).values[0]
    found = whole.at(pressure, {"contact": reach})[0]
    np.testing.assert_allclose(found, direct, atol=0.02 * np.abs(whole.values[0]).max())


def test_the_unit_stops_at_the_wall():
    mesh = beam(STIFF, ROUGH)
    body = Body(STIFF, ROUGH)
    model = with_flat_obstacle(body, mesh, 1.0)
    (obstacle,) = model.obstacles
    equilibrium = Equilibrium(model, body.materials(mesh), CONTACT_NEWTON)
    state = equilibrium.newton(np.zeros_like(mesh.nodes), 0.0)
    for pressure in (0.0006, 0.0012):
        state = equilibrium.reach(pressure, [state])
    assert obstacle.force_N(state.u)[1] > 0.01
    assert obstacle.deepest_mm(state.u) < 0.05
    assert obstacle.places(state.u)[..., 1].max() - mesh.nodes[:, 1].max() == pytest.approx(1.0, abs=0.05)


def test_a_wall_in_the_data_is_named_and_where_it_stands(walls):
    """Simulated at pressures of its own; no law of the material has a kink that every cycle repeats."""
    wall = max(walls, key=lambda r: r.scale).walls[1]
    reach = 0.35 * wall.farthest_mm
    at = np.unique([*np.linspace(LOW, 0.0, 6), *np.linspace(0.0, HIGH, 15), wall.met_kPa(reach)])
    body = Body(STIFF, ROUGH)
    angle = run(Run(body, tuple(at), (), "contact", wall.farthest_mm - reach)).values[0]
    found = judged(measured(lambda p: np.interp(p, at, angle)), [r for r in walls if r.scale == 1.0])
    # What the table leaves between its points may be taken for a smooth nonlinearity beside it.
    assert found.kind in ("named", "ambiguous")
    assert found.names[0] == "contact"
    low, high = found.intervals["contact.reach_mm"]
    assert low < reach < high
    assert high - low < 0.2 * reach


@pytest.mark.nightly("tests/blind/test_blind.py::test_a_finer_mesh_than_the_judge_s_is_no_cause")
def test_a_mesh_too_coarse_is_no_physics(tmp_path):
    """The data are of a mesh finer than both that the verdict compares."""
    effects = ("wall_thickness", "strain_stiffening")
    settings = UnitSettings(SMOOTH, ROUGH, 8, effects=effects, whole=None, self_contact=False, workers=1)
    at = np.concatenate([np.linspace(LOW, 0.0, 6)[:-1], np.linspace(0.0, HIGH, 8)])
    angle = run(Run(Body(STIFF, FINEST), tuple(at))).values[0]
    tests = measured(CubicSpline(at, angle))
    found = judged(tests, unit_responses(STIFF, tests, settings, tmp_path))
    assert found.names == ()


@pytest.mark.parametrize("ratio", [0.4, 0.9, 1.0, 1.3, 4.0])
def test_layers_have_the_ratio_that_was_asked_for(ratio):
    """Of Young's moduli, from the stiffness of both laws side by side; the one across stays."""
    shear, bulk = 0.9, 4.0
    added, share = layer_stiffness(ratio, shear, bulk)
    less = min(added, 0.0)
    shear_left, bulk_left = shear + less / 2, bulk + less / 3
    along, across = max(added, 0.0), -less
    stiffness = np.full((3, 3), bulk_left - 2 * shear_left / 3)
    stiffness += np.diag(2 * shear_left + np.array([along, along, across]))
    compliance = np.linalg.inv(share * stiffness)
    young = 9 * bulk * shear / (3 * bulk + shear)
    assert shear_left > 0
    assert 1 / compliance[2, 2] == pytest.approx(young, rel=1e-9)
    assert 1 / compliance[0, 0] == pytest.approx(ratio * young, rel=1e-9)


def test_layers_change_the_unit_smoothly_through_none():
    """Slopes on both sides of isotropy agree, as linear layers beside the wall's law did not."""
    body = Body(STIFF, ROUGH)
    step = 0.02
    below, none, above = (
        run(Run(body, (-8.0, 0.0, 8.0, 16.0), (), "anisotropy", size)).values[0] if size else run(
            Run(body, (-8.0, 0.0, 8.0, 16.0))
        ).values[0]
        for size in (-step, 0.0, step)
    )  # fmt: skip
    rise, fall = (above - none)[[0, 2, 3]], (none - below)[[0, 2, 3]]
    assert (np.abs(rise) > 1e-3).all()
    np.testing.assert_allclose(rise, fall, rtol=0.2)


def test_layers_of_another_stiffness_are_another_run():
    body = Body(STIFF, ROUGH)
    keys = {Run(body, (1.0,), (), "anisotropy", s).key() for s in (-0.3, 0.5, 0.5)}
    assert len(keys) == 2
    outline = attrs.evolve(Run(body, (1.0,)), outline=True)
    assert outline.key() != Run(body, (1.0,)).key()
