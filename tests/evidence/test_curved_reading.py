"""A load cell that is not straight is no pair of effects of the resin, and a pair is no load cell."""

import math

import attrs
import numpy as np
import pytest

from mu_addon.evidence.curved_reading import curved_reading
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from tests.evidence.bench import experiment

NOISE_kPa = 0.4
PAIR = ("tension_compression_asymmetry", "strain_stiffening")


def coupons():
    """A strip pulled to 40 % and one pressed to 20 %, without stresses yet."""
    clock = np.arange(0.0, 60.0, 0.25)
    found = []
    for name, top in (("pulled", 0.4), ("pressed", -0.2)):
        strain = top * (1.0 - np.abs(2.0 * clock / clock[-1] - 1.0))
        columns = {"time_s": clock, "strain": strain, "stress_kPa": 0.0 * clock}
        found.append(experiment("coupon", columns, name, mode="uniaxial", specimen=name))
    return found


def fitted(values, reading=lambda stress: stress):
    """A fitter to coupons with some effects as a load cell reads them, the base's fit, and the pair's."""
    planned = coupons()
    simulator = Composite(bench_simulators(planned))
    rng = np.random.default_rng(3)
    made = [
        attrs.evolve(
            e,
            columns=e.columns
            | {
                "stress_kPa": reading(simulator.predict(e, {"coupon_modulus_kPa": 700.0} | values)[0])
                + NOISE_kPa * rng.normal(size=len(e))
            },
        )
        for e in planned
    ]
    data = record(made, simulator)
    fitter = Fitter(data, simulator, {"coupon stress": Source(NOISE_kPa, 0.02 * NOISE_kPa, 1.0)})
    pair = [next(e for e in simulator.effects if e.name == n) for n in PAIR]
    starts = [{**a, **b} for a in pair[0].starts() for b in pair[1].starts()]
    base = fitter.fit()
    return fitter, base, fitter.best(pair, [{**base.values, **s} for s in starts])


def keys(fitter):
    return [next(e for e in fitter.simulator.effects if e.name == n).keys[0] for n in PAIR]


@pytest.mark.parametrize("share", [0.05, -0.08])
def test_a_load_cell_that_is_not_straight_does_better_than_two_effects(share):
    fitter, base, pair = fitted({}, lambda s: s + share * (s**2 / 250.0 - np.abs(s)))
    assert base.chi2 > 3 * len(fitter.record)
    words = curved_reading(fitter, base, pair)
    assert "stress readings that are not proportional" in words
    assert "strain stiffening" in words


def test_two_effects_do_better_than_a_load_cell_that_is_not_straight():
    fitter, base, pair = fitted({})
    one, other = keys(fitter)
    fitter, base, pair = fitted({one: 0.3, other: 0.5})
    assert base.chi2 > 3 * len(fitter.record)
    assert pair.chi2 < 1.3 * len(fitter.record)
    assert curved_reading(fitter, base, pair) == ""


def test_no_effect_is_held_against_nothing():
    fitter, base, _ = fitted({})
    assert math.isclose(base.chi2, len(fitter.record), rel_tol=0.3)
    assert curved_reading(fitter, base, base) == ""
