"""Verdicts on made-up benches with slow and white noise: each kind's effects are told from each other."""

import attrs
import numpy as np
import pytest
from scipy.signal import lfilter

from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.simulator import Composite

from .bench import experiment

TIME = np.linspace(0.0, 600.0, 601)
LOOP = np.concatenate(
    [[0.0], *(np.linspace(*ends)[1:] for ends in ((0, 0.3, 60), (0.3, 0, 60), (0, 0.6, 120)))]
)


def guides():
    angles = {p: 45.0 + 50.0 * np.sin(TIME / p) for p in (25.0, 8.0)}
    return [
        experiment("waveguide_bending", {"time_s": TIME, "angle_deg": a}, f"{p}") for p, a in angles.items()
    ]


def coupons():
    return [
        experiment(
            "coupon",
            {"time_s": np.linspace(0.0, lasts, len(LOOP)), "strain": LOOP},
            f"{lasts} s, {mode}",
            mode=mode,
            section_mm=(10.0, 4.0),
            length_mm=30.0,
        )
        for lasts, mode in ((30.0, "uniaxial"), (300.0, "uniaxial"), (100.0, "equibiaxial"))
    ]


def holds():
    time = np.linspace(0.0, 300.0, 601)
    return [
        experiment("pressure_hold", {"time_s": time, "pressure_kPa": np.full(601, p)}, f"{p} kPa")
        for p in (300.0, 100.0)
    ]


def verdict(planned, truth, white, slow):
    """On what the simulators give with these values, and noise of which the slow part lasts 20 samples."""
    simulators = bench_simulators(planned)
    random = np.random.default_rng(1)
    made = []
    for e in planned:
        s = simulators[e.kind]
        drift = lfilter([np.sqrt(1 - 0.95**2)], [1.0, -0.95], random.normal(size=len(e)))
        y = s.predict(e, truth)[0] + white * random.normal(size=len(e)) + slow * drift
        made.append(attrs.evolve(e, columns={**e.columns, s.channels(e)[0]: y}))
    return diagnose(made, Composite(bench_simulators(made)))


@pytest.mark.parametrize(
    ("truth", "names"),
    [
        ({}, ()),
        # No voltage tells the zero of the angle from the brightness of the light.
        ({"angle_offset.offset_deg": 5.0}, ()),
        ({"led_drift.per_hour": -0.3}, ("led_drift",)),
        ({"optical_nonlinearity.excess": 0.3}, ("optical_nonlinearity",)),
        ({"clock_offset.offset_s": 0.4}, ("clock_offset",)),
    ],
)
def test_waveguides(truth, names):
    found = verdict(guides(), {"straight_V": 3.0, "loss_per_deg": 0.012, **truth}, 0.01, 0.003)
    assert found.names == names
    assert found.kind == ("named" if names else "none")


def test_room_light_is_at_least_among_the_rivals():
    truth = {"straight_V": 3.0, "loss_per_deg": 0.012, "ambient_light.ambient_V": 0.15}
    assert "ambient_light" in verdict(guides(), truth, 0.01, 0.003).ambiguity


@pytest.mark.parametrize(
    ("truth", "names"),
    [
        ({}, ()),
        ({"strain_stiffening.c2_over_c1": 0.1}, ("strain_stiffening",)),
        ({"viscoelasticity.share": 0.2, "viscoelasticity.time_s": 8.0}, ("viscoelasticity",)),
        ({"seating.gap_mm": 0.6}, ("seating",)),
    ],
)
def test_coupons(truth, names):
    found = verdict(coupons(), {"coupon_modulus_kPa": 1200.0, **truth}, 2.0, 1.0)
    assert found.names == names
    assert found.kind == ("named" if names else "none")


@pytest.mark.parametrize(
    ("truth", "names"),
    [
        ({}, ()),
        pytest.param(
            {"temperature_drift.cooling_K": 5.0, "temperature_drift.cooling_s": 20.0},
            ("temperature_drift",),
            marks=pytest.mark.nightly("test_holds"),
        ),
    ],
)
def test_holds(truth, names):
    found = verdict(holds(), truth, 0.2, 0.1)
    assert found.names == names
    assert found.kind == ("named" if names else "none")
