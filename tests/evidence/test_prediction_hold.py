"""Closed chambers: gas laws with closed forms, and what tells a leak from a drift that slows."""

import numpy as np
import pytest

from mu_addon.evidence.chamber import ATMOSPHERE_kPa
from mu_addon.evidence.prediction.pressure_hold import KIND, ChamberPressure
from mu_addon.evidence.simulator import Composite

from .bench import experiment, held

TIME = np.linspace(0.0, 120.0, 601)


def plan(initial_kPa=300.0, name="hold"):
    return experiment(
        "pressure_hold", {"time_s": TIME, "pressure_kPa": np.full(len(TIME), initial_kPa)}, name
    )


@pytest.mark.parametrize("initial_kPa", [700.0, -60.0])
def test_laminar_leak_follows_its_closed_form(initial_kPa):
    """dP/dt = -k (P^2 - P0^2)/(2 P0) integrates to artanh(P0/P) or artanh(P/P0) rising as k t/2."""
    k = 0.01
    P = held(TIME, initial_kPa, loss_per_s=k) + ATMOSPHERE_kPa
    ratio = ATMOSPHERE_kPa / P if initial_kPa > 0 else P / ATMOSPHERE_kPa
    rise = np.arctanh(ratio) - np.arctanh(ratio[0])
    np.testing.assert_allclose(rise, k * TIME / 2, rtol=1e-6, atol=1e-8)


def test_flow_through_a_hole_is_choked_first():
    """Choked, gas leaves in proportion to its pressure, as long as that is above 1.89 atmospheres."""
    h, gamma = 0.04, 1.4
    P = (held(TIME, 700.0, hole_per_s=h) + ATMOSPHERE_kPa) / ATMOSPHERE_kPa

    def through(ratio):
        return np.sqrt(2 / (gamma - 1) * (ratio ** (2 / gamma) - ratio ** ((gamma + 1) / gamma)))

    choked = P > 1.9
    assert 100 < np.count_nonzero(choked) < 500
    np.testing.assert_allclose(P[choked], P[0] * np.exp(-h * through(0.528282) * TIME[choked]), rtol=1e-5)
    free = (P < 1.85) & (P > 1.05)
    slope = np.gradient(P, TIME)[free]
    np.testing.assert_allclose(slope, -h * P[free] * through(1 / P[free]), rtol=2e-3)
    assert held(TIME, -60.0, hole_per_s=h)[-1] > -20.0


def test_a_compliant_chamber_keeps_more_of_its_pressure():
    rigid = held(TIME, 100.0, loss_per_s=1e-3)
    soft = held(TIME, 100.0, loss_per_s=1e-3, compliance_per_kPa=1e-3)
    # d(P V)/dt = V dP (1 + C P/V): the fall at first is smaller by 1 + C P.
    falls = (rigid[0] - rigid[10]) / (soft[0] - soft[10])
    assert falls == pytest.approx(1 + 1e-3 * (100 + ATMOSPHERE_kPa), rel=5e-3)


def test_a_coarser_clock_reads_the_same_pressures():
    values = {"loss_per_s": 0.02, "inertia": 0.1, "creep_per_MPa": 0.1, "cooling_K": 5.0}
    np.testing.assert_allclose(
        held(TIME, 700.0, **values)[::10],
        held(TIME[::10], 700.0, **values),
        rtol=1e-9,
    )


def test_what_belongs_to_one_hold_leaves_predictions_of_others_as_they_were():
    holds = [plan(300.0, "a"), plan(200.0, "b")]
    model = Composite({KIND: ChamberPressure(holds)})
    before = [model.predict(e, {}) for e in holds]
    after = [model.predict(e, {"initial_kPa of a": 301.0}) for e in holds]
    assert after[1] is before[1]
    assert after[0][0, 0] == 301.0


def test_warmth_of_compression_grows_with_the_pressure():
    """Compression without loss to 2 and 4 atmospheres warms gas by 64.8 and 143.9 K; then it cools."""
    time = np.array([0.0, 20.0, 200.0])
    for ratio, kelvin in ((2.0, 64.83), (4.0, 143.86)):
        first = (ratio - 1.0) * 101.325
        p = 101.325 + held(time, first, warmth=0.1, cools_s=20.0)
        hot = 296.0 + 0.1 * kelvin
        cooled = (296.0 + 0.1 * kelvin * np.exp(-time / 20.0)) / hot
        np.testing.assert_allclose(p, ratio * 101.325 * cooled, rtol=1e-4)
