"""Steps, poses and blocked forces: predictions beside closed forms, other integrators, and energy."""

import math

import attrs
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mu_addon.errors import InputError
from mu_addon.evidence.effect import Parameter
from mu_addon.evidence.prediction.blocked_force import BlockedForce, pressing
from mu_addon.evidence.prediction.pressure_step import PressureStep
from mu_addon.evidence.prediction.unit_pose import STATIONS, UnitPose, between_stations
from mu_addon.evidence.prediction.unit_pressure import UnitResponse, Variant
from mu_addon.evidence.ringing import swinging
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_run import Run, run
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.held_tip import HeldTip
from mu_addon.measured.pose import down
from mu_addon.meshing.settings import MeshSettings
from tests.evidence import analytic, bench
from tests.evidence.hollow_finger import UNIT, in_place_of_units

ROUGH = MeshSettings(refine=0.35)


@pytest.fixture(scope="module", autouse=True)
def fingers():
    with in_place_of_units():
        yield


def step(dt=0.01, name="step"):
    t = np.arange(0.0, 3.0, dt)
    p = np.interp(t, [0.0, 0.5, 0.52, 3.0], [0.0, 0.0, 20.0, 20.0])
    columns = {"time_s": t, "pressure_kPa": p, "angle_deg": 0.0 * t}
    return bench.experiment("pressure_step", columns, name=name)


def test_a_step_overshoots_by_the_closed_form():
    # Between two samples a step is a ramp, here of a 2000th of a period.
    t = np.arange(0.0, 2.0, 5e-4)
    still = (t > 0.25).astype(float)[None]
    for damping in (0.05, 0.3, 0.7):
        y = swinging(t, still, 1.0, damping)[0]
        assert y.max() == pytest.approx(
            1.0 + math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)), abs=1e-4
        )
        assert t[y.argmax()] - 0.25 == pytest.approx(0.5 / math.sqrt(1.0 - damping**2), abs=2e-3)


def test_a_mode_moves_as_an_integrator_of_others_has_it():
    t = np.sort(np.random.default_rng(3).uniform(0.0, 2.0, 80))
    still = np.sin(3.0 * t) ** 3 + 0.3
    w = 2.0 * math.pi * 2.7

    def rates(at, x):
        return [x[1], w * w * (np.interp(at, t, still) - x[0]) - 2.0 * 0.2 * w * x[1]]

    found = solve_ivp(rates, (t[0], t[-1]), [still[0], 0.0], t_eval=t, rtol=1e-9, atol=1e-11, max_step=2e-3)
    start = np.full((1, 1), still[0])
    mine = start[0] + swinging(t, still[None] - start, 2.7, 0.2)[0]
    np.testing.assert_allclose(mine, found.y[0], atol=2e-6)
    # What stays where it is leaves the mode there.
    fast = swinging(t, 0.0 * still[None] + 1.0, 50.0, 0.9)[0]
    np.testing.assert_allclose(fast, 1.0, atol=1e-9)


def test_a_unit_without_period_is_quasi_static_and_a_short_one_nearly_so():
    e = step()
    simulator = PressureStep([analytic.response()], [e])
    still = simulator.predict(e, {})
    np.testing.assert_array_equal(simulator.predict(e, {"inertia.period_s": 0.0}), still)
    quick = simulator.predict(e, {"inertia.period_s": 0.002, "inertia.damping": 0.9})
    assert np.abs(quick - still).max() < 0.2 * np.abs(still).max()
    assert np.abs(quick - still)[:, -50:].max() < 1e-6


def test_gravity_turns_about_any_axis_as_a_right_handed_screw():
    np.testing.assert_allclose(down(90.0), [0.0, -1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(down(180.0, (0.0, 1.0, 0.0)), [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(down(73.0, (0.0, 0.0, 5.0)), [0.0, 0.0, 1.0], atol=1e-12)
    # Two turns about one axis are one turn by the sum.
    axis = (1.0, 2.0, -0.5)
    n = np.array(axis) / np.linalg.norm(axis)
    first = down(40.0, axis)
    again = (
        math.cos(math.radians(25.0)) * first
        + math.sin(math.radians(25.0)) * np.cross(n, first)
        + (1.0 - math.cos(math.radians(25.0))) * (n @ first) * n
    )
    np.testing.assert_allclose(down(65.0, axis), again, atol=1e-12)
    with pytest.raises(InputError):
        down(10.0, (0.0, 0.0, 0.0))


def test_between_stations_lies_the_polynomial_that_goes_through_them():
    def wave(degrees):
        a = np.radians(degrees)
        return 1.0 + 0.4 * np.cos(a - 0.3) - 0.1 * np.sin(2.0 * a) + 0.05 * np.cos(3.0 * a + 1.0)

    at = np.linspace(-400.0, 400.0, 41)
    share = between_stations(at)
    np.testing.assert_allclose(share.sum(axis=0), 1.0, atol=1e-12)
    np.testing.assert_allclose(wave(np.array(STATIONS)) @ share, wave(at), atol=1e-12)


@pytest.mark.slow
def test_a_pose_that_was_not_simulated_is_found_from_those_that_were():
    body = Body(UNIT, ROUGH)

    def angle(degrees, axis=(1.0, 0.0, 0.0), density=1300.0):
        turned = attrs.evolve(body, orientation_deg=degrees, orientation_axis=axis)
        return run(Run(turned, (0.0, 10.0), (), "gravity", density)).values[0]

    stations = np.array([angle(s) for s in STATIONS])
    share = between_stations(np.array([20.0, 250.0]))
    for column, at in enumerate((20.0, 250.0)):
        extent = float(np.ptp(stations[:, 1]))
        np.testing.assert_allclose(share[:, column] @ stations, angle(at), atol=0.01 * extent)
    # Small weights in opposite directions do opposite things, and out of the plane of bending nothing.
    light = [angle(a, density=20.0)[1] - angle(0.0, density=0.0)[1] for a in (90.0, 270.0)]
    assert light[0] == pytest.approx(-light[1], rel=0.02)
    aside = angle(90.0, (0.0, 1.0, 0.0), 20.0)[1] - angle(0.0, density=0.0)[1]
    assert abs(aside) < 0.02 * abs(light[0])


def relaxed(share=0.3, time=0.7):
    t = np.linspace(0.0, 4.0, 401)
    return t, np.sin(2.0 * t) * 3.0 + 1.0, ((share, time / (1.0 - share)),)


def test_a_blocked_tip_without_memory_presses_and_never_pulls():
    t, held, _ = relaxed()
    np.testing.assert_array_equal(pressing(t, held), np.maximum(held, 0.0))


def test_what_the_tip_remembers_fades_as_an_integrator_of_others_has_it():
    """While it touches, the force's weighed history is what holds the unit (one relaxation, an ODE)."""
    share, time = 0.3, 0.7
    t, _, relaxing = relaxed(share, time)
    held = 2.0 + np.sin(2.0 * t)
    force = pressing(t, held, relaxing)
    tau = time / (1.0 - share)

    def rates(at, x):
        now = (np.interp(at, t, held) - share * x[0]) / (1.0 - share)
        return [(now - x[0]) / tau]

    past = solve_ivp(rates, (0.0, 4.0), [2.0], t_eval=t, rtol=1e-9, atol=1e-11, max_step=0.01).y[0]
    np.testing.assert_allclose(force, (held - share * past) / (1.0 - share), atol=2e-4)
    # Held by a constant, the force is that constant.
    np.testing.assert_allclose(pressing(t, 0.0 * t + 1.7, relaxing), 1.7, atol=1e-12)


@pytest.fixture(scope="module")
def held_unit():
    body = Body(UNIT, ROUGH)
    mesh = body.meshed()
    return mesh, body.model(mesh), body.materials(mesh), body.newton()


def states(held_unit, pressure_kPa, gap):
    mesh, model, materials, newton = held_unit
    held = HeldTip(mesh, gap)
    model.obstacles = (held,)
    found = Equilibrium(model, materials, newton)
    state = found.newton(found.newton(np.zeros_like(mesh.nodes), 0.0).u, 1e-3 * pressure_kPa)
    return held.reading_N(state.u), 2.0 * model.cavity_volume(state.u), state


@pytest.mark.slow
def test_the_blocked_force_obeys_the_energy(held_unit):
    """dF/dp at a held tip is dV/dgap at a pressure: both are mixed derivatives of one energy (Maxwell)."""
    p, dp, dg = 8.0, 0.2, 0.1
    slope = (states(held_unit, p + dp, 0.3)[0] - states(held_unit, p - dp, 0.3)[0]) / (2e-3 * dp)
    grown = (states(held_unit, p, 0.3 + dg)[1] - states(held_unit, p, 0.3 - dg)[1]) / (2.0 * dg)
    assert slope == pytest.approx(grown, rel=2e-3)
    assert slope > 0.0


@pytest.mark.slow
def test_a_dead_force_that_brings_the_tip_back_is_the_one_the_cell_reads(held_unit):
    mesh, model, materials, newton = held_unit
    force, _, state = states(held_unit, 12.0, 0.0)
    edge = model.obstacles[0].edge
    load = np.zeros_like(mesh.nodes)
    # The cell's own forces on each node, as a load.
    nodes, on_cell = model.obstacles[0].forces(state.u)
    load[nodes] = -on_cell
    model.obstacles, model.load = (), load
    try:
        free = Equilibrium(model, materials, newton).newton(state.u * 0.5, 1e-3 * 12.0)
    finally:
        model.load = None
    assert force > 0.0
    assert np.abs(free.u[edge, 1]).max() < 1e-3


def test_a_unit_twice_as_large_presses_four_times_as_much():
    p = (0.0, 6.0, 12.0)
    small, large = (
        run(Run(Body(attrs.evolve(UNIT, scale=s), ROUGH, gap_mm=0.0), p)).values[0] for s in (0.75, 1.5)
    )
    # The cell's stiffness is the same for both, and a part of a thousand of it is the unit's.
    np.testing.assert_allclose(large[1:] / small[1:], 4.0, rtol=5e-3)


def forces(p, sizes=None):
    """A held tip whose unit is written down: force (1, n) in N at pressures (n,) in kPa."""
    s = {"seating": 0.0, "wall_thickness": 1.0} | (sizes or {})
    x = np.asarray(p, float) / 20.0
    return (s["wall_thickness"] ** -0.7 * (0.9 * x + 0.1 * x**2) - 0.12 * s["seating"] * (1.0 + 0.2 * x))[
        None
    ]


def held_response(**more):
    at = np.linspace(-10.0, 40.0, 41)
    grid = {
        "seating": (Parameter("tip_gap_mm", "mm", 0.0, 3.0, 0.0, (0.2,)), (0.0, 0.5, 1.5, 3.0)),
        "wall_thickness": (Parameter("factor", "", 0.8, 1.3, 1.0, (0.95, 1.05)), (0.8, 0.9, 1.0, 1.15, 1.3)),
    }
    variants = {n: Variant(q, g, [forces(at, {n: v}) for v in g]) for n, (q, g) in grid.items()}
    return UnitResponse(("force_N",), at, forces(at), variants, **more)


def pressed(n=400, name="press", **more):
    t = np.linspace(0.0, 40.0, n)
    p = 30.0 * np.abs(np.sin(np.pi * t / 10.0))
    columns = {"time_s": t, "pressure_kPa": p, "force_N": 0.0 * t + 1.0}
    return bench.experiment("blocked_force", columns, name, **more)


def test_a_stand_that_gives_leaves_the_closed_form_of_two_springs():
    e = pressed()
    simulator = BlockedForce([held_response()], [e])
    p, give = e["pressure_kPa"], 0.4
    free, stiffness = forces(p)[0], 0.12 * (1.0 + 0.2 * p / 20.0)
    found = simulator.predict(e, {"frame_compliance.stand_mm_per_N": give})[0]
    np.testing.assert_allclose(found, free / (1.0 + give * stiffness), atol=2e-4)


def test_of_a_blocked_tip_the_modulus_hardly_counts_and_the_gap_does():
    e = pressed()
    simulator = BlockedForce([held_response()], [e])
    base = simulator.predict(e, {})[0]
    stiffer = simulator.predict(e, {"modulus_factor": 1.2})[0]
    # Force and pressure in proportion: m F(p/m) is F for the part that is.
    assert np.abs(stiffer - base).max() < 0.03 * base.max()
    apart = simulator.predict(e, {"seating.tip_gap_mm": 1.0})[0]
    assert (apart[e["pressure_kPa"] < 1.0] == 0.0).all()
    assert apart.max() < base.max()


def test_a_cell_at_another_gap_is_refused():
    e = pressed(gap_mm=2.0)
    with pytest.raises(InputError, match="tip held at 2 mm"):
        BlockedForce([held_response()], [e])


def test_poses_are_of_the_axis_that_was_simulated():
    rows = np.arange(0.0, 360.0, 30.0)
    columns = {"pressure_kPa": 0.0 * rows + 15.0, "orientation_deg": rows, "angle_deg": 0.0 * rows}
    e = bench.experiment("unit_pose", columns)
    responses = [analytic.response(orientation_deg=s) for s in STATIONS]
    simulator = UnitPose(responses, [e])
    found = simulator.predict(e, {"gravity.density_kg_m3": 1100.0})[0]
    exact = [analytic.channels(np.array([15.0]), {"gravity": 1100.0}, 1.0, a)[0, 0] for a in rows.tolist()]
    np.testing.assert_allclose(found, exact, atol=0.02 * np.ptp(exact))
    weightless = simulator.predict(e, {})[0]
    np.testing.assert_allclose(weightless, weightless[0])
    other = attrs.evolve(e, orientation_axis=(0.0, 1.0, 0.0))
    with pytest.raises(InputError, match="about axis"):
        simulator.predict(other, {})
