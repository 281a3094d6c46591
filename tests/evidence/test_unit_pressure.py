"""The unit's simulator: exact where no effect acts, and against closed forms where one does."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.evidence.lags import first_order_lag, play_operator
from mu_addon.evidence.prediction.unit_pressure import UnitPressure, cycles, pressure_histories
from tests.evidence import analytic


def blank(time, pressure, name="one", **more):
    return analytic.experiment(name, time, pressure, dict.fromkeys(analytic.CHANNELS, 0.0 * time), **more)


T, P = analytic.triangle(0.1, 10.0, 2, -10.0, 35.0)
ONE = blank(T, P, orientation_deg=90.0, temperature_C=31.0)
MODEL = analytic.simulator([ONE])


@pytest.mark.parametrize("effect", MODEL.effects, ids=lambda e: e.name)
def test_at_its_null_an_effect_changes_no_digit(effect):
    size = effect.parameters[0]
    for shape in effect.shapes():
        values = {"modulus_factor": 1.1, **shape, effect.keys[0]: size.null}
        np.testing.assert_array_equal(MODEL.predict(ONE, values), MODEL.predict(ONE, {"modulus_factor": 1.1}))
    # A limit of a rate changes nothing before it is below the fastest rate asked for.
    by = effect.starts()[0] if effect.name == "supply_rate_limit" else {effect.keys[0]: size.null + size.step}
    moved = MODEL.predict(ONE, by)
    assert np.abs(moved - MODEL.predict(ONE, {})).max() > 0


def test_the_response_is_met_between_its_pressures():
    exact = analytic.channels(P, {}, 1.0, 90.0)
    assert np.abs(MODEL.predict(ONE, {}) - exact).max() < 1e-3


def test_scaled_moduli_are_the_pressure_scaled():
    softer = MODEL.predict(ONE, {"modulus_factor": 0.8})
    np.testing.assert_allclose(softer, MODEL.predict(blank(T, P / 0.8, orientation_deg=90.0), {}), atol=1e-12)
    np.testing.assert_allclose(softer, MODEL.predict(ONE, {"pressure_gain.gain": -0.2}), atol=1e-12)


def test_a_softer_unit_is_bent_more_by_its_weight():
    """Equilibrium knows pressure and weight over modulus alone."""
    softer = MODEL.predict(ONE, {"modulus_factor": 0.8, "gravity.density_kg_m3": 900.0})
    same = blank(T, P / 0.8, orientation_deg=90.0)
    np.testing.assert_allclose(
        softer, MODEL.predict(same, {"gravity.density_kg_m3": 900.0 / 0.8}), atol=1e-12
    )


def test_behind_a_shut_valve_the_gauge_sees_what_leaks():
    """Nothing flows between gauge and chambers, so neither the line's share nor its lag is lost."""
    values = {"leak.conductance_ratio": 0.3, "line_lag.time_s": 0.5}
    shut = blank(T, P, orientation_deg=90.0, valve="shut")
    np.testing.assert_array_equal(MODEL.predict(shut, values), MODEL.predict(ONE, {}))
    opened = blank(T, P, orientation_deg=90.0, valve="open")
    np.testing.assert_array_equal(MODEL.predict(opened, values), MODEL.predict(ONE, values))
    assert np.abs(MODEL.predict(ONE, values) - MODEL.predict(ONE, {})).max() > 1.0


@settings(max_examples=25)
@given(st.floats(0.01, 20.0), st.floats(0.02, 0.5))
# Steps that differ by less than a thousandth.
@example(1.0, 0.3394)
def test_a_ramp_is_followed_at_the_lag(time_s, dt):
    t = np.arange(0.0, 30.0, dt)
    expected = t - time_s * (1.0 - np.exp(-t / time_s))
    np.testing.assert_allclose(first_order_lag(t, t, time_s), expected, atol=1e-9)
    jittered = np.sort(t + 0.3 * dt * np.sin(37.0 * t))
    expected = jittered - jittered[0] - time_s * (1.0 - np.exp(-(jittered - jittered[0]) / time_s))
    np.testing.assert_allclose(first_order_lag(jittered, jittered - jittered[0], time_s), expected, atol=1e-9)


def test_a_held_pressure_creeps_as_a_standard_linear_solid():
    t = np.arange(0.0, 60.0, 0.1)
    p = np.where(t > 0.0, 20.0, 0.0)
    e = blank(t, p)
    share, time = 0.3, 6.0
    q = UnitPressure([analytic.response()]).effective_kPa(
        e, {"viscoelasticity.share": share, "viscoelasticity.time_s": time}
    )
    # The pressure rises over one sample, in the middle of which a sudden one would have come.
    expected = 20.0 * (1.0 - share * np.exp(-(t[1:] - 0.05) * (1.0 - share) / time))
    np.testing.assert_allclose(q[1:], expected, rtol=2e-5)


@settings(max_examples=30)
@given(st.lists(st.floats(-40, 40), min_size=2, max_size=30), st.floats(0.1, 20))
def test_play_stays_within_its_width_and_forgets_the_rate(levels, width):
    p = np.array(levels)
    x = play_operator(p, width)
    assert (np.abs(x - p) <= width + 1e-12).all()
    slowly = np.interp(np.arange(0, len(p) - 1 + 1e-9, 0.25), np.arange(len(p)), p)
    np.testing.assert_allclose(play_operator(slowly, width)[::4], x, atol=1e-9)


@pytest.mark.parametrize("digits", [0, 3])
def test_play_is_followed_value_by_value(digits):
    """Rounded to whole numbers it stands still now and then, and turns after that."""
    p = np.round(np.cumsum(np.random.default_rng(2).normal(size=400)), digits)
    x, followed = p[0], []
    for v in p:
        x = min(max(x, v - 1.5), v + 1.5)
        followed.append(x)
    np.testing.assert_array_equal(play_operator(p, 1.5), followed)


def test_a_friction_loop_has_the_area_of_its_slip():
    t = np.linspace(0, 4, 4001)
    p = 20.0 * np.interp(t, [0, 1, 3, 4], [0, 1, -1, 0])
    e = blank(np.concatenate([t, t[1:] + 4]), np.concatenate([p, p[1:]]))
    share, width = 0.2, 3.0
    key = "rate_independent_hysteresis"
    q = UnitPressure([analytic.response()]).effective_kPa(
        e, {f"{key}.share": share, f"{key}.threshold_kPa": width}
    )
    second = slice(4000, None)
    x, y = e["pressure_kPa"][second], q[second]
    area = abs(np.sum((y[1:] + y[:-1]) / 2 * np.diff(x)))
    # A parallelogram of width 2 r and of the height that the play travels.
    assert area == pytest.approx(share * 2 * width * 2 * (20 - width), rel=1e-3)


def test_softening_needs_a_larger_past_and_ends_where_it_was():
    t, p = analytic.steps(0.1, (10, 0, 30, 0, 10), 5.0)
    first = blank(t, p, "first")
    unit = UnitPressure([analytic.response()], [first])
    values = {"mullins_softening.softening": 0.3, "mullins_softening.energy_share": 0.3}
    q = unit.effective_kPa(first, values)
    loading = (t < 5) | ((t > 11.5) & (t < 16))
    np.testing.assert_allclose(q[loading], p[loading], rtol=1e-12)
    assert (q[-20:] > 1.05 * p[-20:]).all()


def test_specimens_remember_apart():
    e = [blank(T, P, "a", specimen="A"), blank(T, P, "b", specimen="B"), blank(T, P, "c", specimen="A")]
    past = pressure_histories(e)
    assert past["a"].cycles == past["b"].cycles == 0.0
    assert past["c"].cycles == pytest.approx(float(cycles(P)[-1]))
    assert (past["c"].trough_kPa, past["c"].peak_kPa) == (P.min(), P.max())


def test_an_experiment_that_was_not_simulated_is_refused():
    with pytest.raises(InputError, match="orientation 45"):
        MODEL.predict(blank(T, P, orientation_deg=45.0), {})
