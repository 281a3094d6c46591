"""Gauges that are noisy: what drives a model is freed of their noise, and nothing is named for it."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.drive import denoised, denoised_drives, reading_noise
from tests.evidence import analytic


@settings(max_examples=50)
@given(st.floats(1e-3, 1.0), st.integers(100, 400), st.integers(0, 10_000))
def test_noise_is_told_from_what_is_read(sd, many, seed):
    """On ramps, holds and waves of sixteen samples a turn."""
    rng = np.random.default_rng(seed)
    t = np.arange(many) * 0.2
    for signal in (3.0 * t, np.where(t > t.mean(), 30.0, 0.0), 20.0 * np.sin(2 * np.pi * t / 3.2)):
        found = reading_noise(t, signal + rng.normal(0.0, sd, many))
        assert found == pytest.approx(sd, rel=0.5)


def test_what_is_read_without_noise_stays():
    for _, t, p, _ in analytic.protocols(0.25, 8):
        np.testing.assert_allclose(denoised(t, p), p, atol=1e-9)
    t = np.arange(400) * 0.1
    wave = 20.0 * np.sin(2 * np.pi * t / 0.8)
    # Eight samples a turn: what their differences leave is not noise, and hardly changes them.
    np.testing.assert_allclose(denoised(t, wave), wave, atol=0.02)


def test_noise_is_averaged_and_corners_are_kept():
    rng = np.random.default_rng(3)
    for _, t, p, _ in analytic.protocols(0.25, 8):
        found = denoised(t, p + rng.normal(0.0, 0.05, len(p)))
        assert np.sqrt(np.mean((found - p) ** 2)) < 0.6 * 0.05
        assert np.abs(found - p).max() < 2.5 * 0.05


def noisy(made, sd, seed=100):
    rng = np.random.default_rng(seed)
    return [
        attrs.evolve(e, columns=e.columns | {"pressure_kPa": e["pressure_kPa"] + rng.normal(0.0, sd, len(e))})
        for e in made
    ]


@pytest.mark.parametrize(
    ("hidden", "names"),
    [
        ({}, ()),
        pytest.param(
            {"rate_independent_hysteresis.share": 0.05},
            ("rate_independent_hysteresis",),
            marks=pytest.mark.nightly("test_a_gauge_s_noise_has_no_name"),
        ),
    ],
    ids=["nothing wrong", "friction"],
)
def test_a_gauge_s_noise_has_no_name(hidden, names):
    """0.05 of 35 kPa. What smooths readings fits better: friction and a clock were named, six of six."""
    made = analytic.measured(np.random.default_rng(0), {"modulus_factor": 1.05} | hidden, dt=0.25, count=4)
    made = noisy(made, 0.05)
    found = diagnose(made, analytic.simulator(made))
    assert found.names == names
    assert found.kind == ("named" if names else "none")


@pytest.mark.nightly("test_a_gauge_s_noise_has_no_name")
def test_a_gauge_too_noisy_for_such_data_is_no_cause():
    made = analytic.measured(np.random.default_rng(1), {"modulus_factor": 1.05}, dt=0.25, count=4)
    made = noisy(made, 0.2)
    assert diagnose(made, analytic.simulator(made)).names == ()


def test_what_is_predicted_is_left_as_it_was_read():
    made = noisy(analytic.measured(np.random.default_rng(1), {}, dt=0.25, count=2), 0.05)
    once, again = denoised_drives(made, analytic.simulator(made))
    for raw, quiet, other in zip(made, once, again, strict=True):
        np.testing.assert_array_equal(quiet["angle_deg"], raw["angle_deg"])
        assert not np.array_equal(quiet["pressure_kPa"], raw["pressure_kPa"])
        assert not np.array_equal(quiet["pressure_kPa"], other["pressure_kPa"])
    still = [attrs.evolve(e, columns=e.columns | {"pressure_kPa": np.round(e["time_s"])}) for e in made]
    exact = analytic.measured(np.random.default_rng(1), {}, dt=0.25, count=2)
    assert denoised_drives(exact, analytic.simulator(still))[1] is None
