"""Coupons: the law of the material in three modes, and what machine and history make of it."""

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.evidence.lags import first_order_lag
from mu_addon.evidence.prediction.coupon import CouponStress
from mu_addon.evidence.stretching import ogden
from mu_addon.fem.laws import Ogden, Yeoh
from mu_addon.materials import incompressible

from .bench import experiment

SIMULATOR = CouponStress()
STRAIN = np.linspace(0.0, 1.0, 101)
TIME = np.linspace(0.0, 100.0, 101)


def coupon(strain=STRAIN, mode="uniaxial", time=None, **fields):
    columns = {"strain": np.asarray(strain, float)} | ({} if time is None else {"time_s": time})
    return experiment("coupon", columns, mode=mode, **fields)


def predict(e, **values):
    return SIMULATOR.predict(e, {k.replace("__", "."): v for k, v in values.items()})[0]


@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "pure_shear"])
def test_closed_form_is_the_law_of_the_finite_elements(mode):
    stretch = np.linspace(0.6, 2.0, 29)
    law = incompressible(Yeoh, np.array([0.3, 0.05, 0.0, 1.0]), mode, stretch)
    found = predict(
        coupon(stretch - 1, mode), coupon_modulus_kPa=1.8, strain_stiffening__c2_over_c1=0.05 / 0.3
    )
    np.testing.assert_allclose(found, law, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("mode", ["uniaxial", "equibiaxial", "pure_shear"])
def test_a_term_of_ogden_s_is_the_law_of_the_finite_elements(mode):
    """Of modulus E = 3 mu: mu_1 alpha_1 = 2 mu."""
    stretch = np.linspace(0.6, 2.0, 29)
    parameters = np.array([2 * 0.2 / 5.5, 5.5, 0.0, 1.0, 0.0, 1.0, 1.0])
    law = incompressible(Ogden, parameters, mode, stretch)
    np.testing.assert_allclose(ogden(0.6, 5.5, mode, stretch), law, rtol=1e-11, atol=1e-13)
    a = 1 + STRAIN
    found = predict(
        coupon(mode=mode), strain_stiffening__by_stretch=0.5, strain_stiffening__stretch_power=5.5
    )
    plain = predict(coupon(mode=mode))
    np.testing.assert_allclose(found - plain, ogden(500.0, 5.5, mode, a), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("form", "factor"),
    [
        (1.0, lambda x: 1 + 0.3 * x),
        (0.0, lambda x: np.exp(0.3 * x)),
        (-1.0, lambda x: 1 / (1 - 0.3 * x)),
    ],
    ids=["Yeoh", "Demiray", "Gent"],
)
def test_one_law_of_the_invariant_has_three_known_ones_in_it(form, factor):
    e = coupon(np.linspace(-0.2, 0.6, 50))
    a = 1 + e["strain"]
    found = predict(e, strain_stiffening__by_invariant=0.3, strain_stiffening__form=form)
    np.testing.assert_allclose(found, predict(e) * factor(a**2 + 2 / a - 3), rtol=1e-9, atol=1e-9)


def test_beyond_gent_s_limit_a_law_stays_finite():
    found = predict(coupon(), strain_stiffening__by_invariant=3.0, strain_stiffening__form=-2.0)
    assert np.isfinite(found).all()


def test_a_stretch_of_nothing_is_refused():
    with pytest.raises(InputError, match="not positive"):
        predict(coupon(strain=[0.0, -1.0]))


def test_without_a_clock_nothing_relaxes():
    np.testing.assert_array_equal(predict(coupon(), viscoelasticity__share=0.4), predict(coupon()))


def test_a_frame_in_series_with_a_specimen_that_relaxes():
    """The recorded stress is that of the specimen's own strain path."""
    strain = np.linspace(0.0, 0.3, 61)
    e = coupon(strain, time=np.linspace(0, 60, 61), section_mm=(10.0, 4.0), length_mm=20.0)
    values = {"viscoelasticity.share": 0.3, "viscoelasticity.time_s": 10.0, "frame_compliance.mm_per_N": 0.05}
    found = SIMULATOR.predict(e, values)[0]
    own = strain - 0.05 * found * 1e-3 * 40.0 / 20.0
    rest = predict(coupon(own))
    np.testing.assert_allclose(
        found, rest - 0.3 * first_order_lag(e["time_s"], rest, 10.0), rtol=1e-8, atol=1e-8
    )


def test_a_soft_frame_in_series_with_a_stiff_specimen_that_softens_and_yields():
    """Unloading is steeper than any loading there: of a real coupon of 600 MPa no solution was found."""
    strain = np.concatenate([np.linspace(0, 0.03, 120), np.linspace(0.03, 0.005, 120)])
    e = coupon(strain, section_mm=(3.5, 3.5), length_mm=40.0)
    values = {
        "coupon_modulus_kPa": 6e5,
        "mullins_softening.softening": 0.2,
        "rate_independent_hysteresis.per_strain": 60.0,
        "frame_compliance.mm_per_N": 0.09,
    }
    found = SIMULATOR.predict(e, values)[0]
    own = strain - 0.09 * found * 1e-3 * 3.5 * 3.5 / 40.0
    again = SIMULATOR.predict(coupon(own), values | {"frame_compliance.mm_per_N": 0.0})[0]
    np.testing.assert_allclose(found, again, rtol=1e-7, atol=1e-7 * found.max())


@pytest.mark.parametrize(
    "hidden",
    [
        # What remains of yielding is pressed together, where this law is several times as steep.
        {
            "tension_compression_asymmetry.excess": 2.64,
            "rate_independent_hysteresis.per_strain": 200.0,
            "rate_independent_hysteresis.hardening": 0.9,
        },
        # The slope of such softening has no bound where loading turns.
        {"mullins_softening.by_peak": 3.6, "mullins_softening.power": 0.5},
        # Without the frame the specimen would pull itself through.
        {"strain_stiffening.c2_over_c1": 2.0},
    ],
    ids=["yielding", "softening", "stiff"],
)
def test_a_frame_in_series_whatever_the_specimen_remembers(hidden):
    """At its own strain the specimen alone bears what was found."""
    strain = np.concatenate([np.linspace(0, 0.3, 40), np.linspace(0.3, 0, 40), np.linspace(0, 0.5, 70)])
    strain = np.concatenate([strain, np.linspace(0.5, 0, 70)])
    e = coupon(strain, section_mm=(10.8, 2.7), length_mm=25.9)
    values = {"coupon_modulus_kPa": 16000.0, "frame_compliance.mm_per_N": 0.1} | hidden
    found = SIMULATOR.predict(e, values)[0]
    own = strain - 0.1 * found * 1e-3 * 10.8 * 2.7 / 25.9
    alone = SIMULATOR.predict(coupon(own), values | {"frame_compliance.mm_per_N": 0.0})[0]
    np.testing.assert_allclose(found, alone, rtol=1e-7, atol=1e-7 * found.max())
