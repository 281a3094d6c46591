"""Waveguides: an exponential of the angle, and what bends its logarithm."""

import numpy as np
import pytest

from mu_addon.evidence.fit import Fitter, interval
from mu_addon.evidence.noise import Source
from mu_addon.evidence.prediction.waveguide_bending import WaveguideVoltage
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite

from .bench import experiment, measured

TIME = np.linspace(0.0, 600.0, 1201)
ANGLE = 45.0 + 50.0 * np.sin(TIME / 25.0)
GUIDE = experiment("waveguide_bending", {"time_s": TIME, "angle_deg": ANGLE})
SIMULATOR = WaveguideVoltage()
BASE = {"straight_V": 3.0, "loss_per_deg": 0.012}


def predict(**values):
    return SIMULATOR.predict(GUIDE, {**BASE, **{k.replace("__", "."): v for k, v in values.items()}})[0]


def test_a_zero_of_the_angle_is_only_another_light_source():
    found = predict(angle_offset__offset_deg=5.0)
    np.testing.assert_allclose(found / predict(), np.exp(0.012 * 5.0), rtol=1e-12)


def test_light_that_settles_does_so_in_proportion():
    ratio = predict(led_drift__settled=-0.1, led_drift__settling_s=90.0) / predict()
    np.testing.assert_allclose(ratio, np.exp(-0.1 * (1 - np.exp(-TIME / 90.0))), rtol=1e-12)


def test_room_light_that_grows_adds_more():
    found = predict(ambient_light__at_first_V=0.2, ambient_light__per_hour=3.0) - predict()
    np.testing.assert_allclose(found, 0.2 * (1 + 3.0 * TIME / 3600.0), rtol=1e-9)


def test_a_delay_of_a_part_of_a_sample_is_no_chord():
    """Chords of a bend with 16 samples a turn miss 0.9 deg of it, as much as 40 ms of delay."""
    time = np.arange(0.0, 200.0, 1.0)
    angle = 45.0 * np.sin(2.0 * np.pi * time / 16.0)
    e = experiment("waveguide_bending", {"time_s": time, "angle_deg": angle})
    found = SIMULATOR.predict(e, {**BASE, "clock_offset.offset_s": 0.5})[0]
    truly = 45.0 * np.sin(2.0 * np.pi * (time - 0.5) / 16.0)
    off = np.abs(np.log(found / 3.0) / -0.012 - truly)[5:-5]
    assert off.max() < 0.25 < np.abs(np.interp(time - 0.5, time, angle) - truly)[5:-5].max()


def test_angles_the_camera_missed_are_bridged():
    angle = ANGLE.copy()
    angle[100:103] = np.nan
    e = experiment("waveguide_bending", {"time_s": TIME, "angle_deg": angle})
    found = SIMULATOR.predict(e, BASE)[0]
    # A chord of 2 s would leave the sine by up to 0.04 deg.
    np.testing.assert_allclose(found, predict(), rtol=0.012 * 0.04)


def test_the_interval_of_a_shape_that_hardly_matters_is_wide():
    """A loss a degree counts a million times as much as an onset in degrees: units must not decide."""
    truth = {"optical_nonlinearity.excess": -0.026, "optical_nonlinearity.onset_deg": 11.0}
    seen = measured(SIMULATOR, GUIDE, {**BASE, **truth}, 0.004)
    model = Composite({"waveguide_bending": SIMULATOR})
    data = record([seen], model)
    fitter = Fitter(data, model, {g: Source(0.004, 1e-6, 1.0) for g in data.groups})
    effect = next(e for e in model.effects if e.name == "optical_nonlinearity")
    fit = fitter.best([effect], [{**BASE, **start} for start in effect.starts()])
    low, high = interval(fitter, fit, "optical_nonlinearity.onset_deg")
    assert low <= 11.0 <= high
    assert high - low > 5.0
    for end in {low, high} - {0.0}:
        risen = fitter.fit([effect], fit.values, {"optical_nonlinearity.onset_deg": end}).chi2 - fit.chi2
        assert risen == pytest.approx(3.84, abs=0.3)
