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


@pytest.mark.parametrize(("mode", "power"), [("uniaxial", -2), ("equibiaxial", -5), ("pure_shear", -3)])
def test_neo_hooke_in_each_mode(mode, power):
    """Nominal stress E/3 (a - a^power), Treloar, The Physics of Rubber Elasticity, chapter 5."""
    a = 1 + STRAIN
    found = predict(coupon(mode=mode), coupon_modulus_kPa=900.0)
    np.testing.assert_allclose(found, 300.0 * (a - a**power), rtol=1e-9, atol=1e-9)


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


def test_yeoh_in_tension():
    a = 1 + STRAIN
    first = a**2 + 2 / a - 3
    found = predict(coupon(), coupon_modulus_kPa=600.0, strain_stiffening__c2_over_c1=0.2)
    np.testing.assert_allclose(found, 200.0 * (a - a**-2) * (1 + 0.4 * first), rtol=1e-9, atol=1e-9)


def test_relaxation_after_a_step_is_an_exponential():
    """After a fast pull sigma = sigma_0 (1 - g + g exp(-t/tau)), of the instantaneous modulus."""
    time = np.array([0.0, 1e-4, 5.0, 10.0, 40.0])
    e = coupon([0.0, 0.3, 0.3, 0.3, 0.3], time=time)
    values = {"coupon_modulus_kPa": 1000.0, "viscoelasticity.share": 0.4, "viscoelasticity.time_s": 10.0}
    found = SIMULATOR.predict(e, values)[0]
    rest = SIMULATOR.predict(e, {"coupon_modulus_kPa": 1000.0})[0][1]
    np.testing.assert_allclose(found[1:], rest * (0.6 + 0.4 * np.exp(-time[1:] / 10.0)), rtol=1e-4)


def test_a_faster_pull_is_stiffer_and_bounds_are_the_two_moduli():
    def at(duration):
        e = coupon([0.0, 0.05, 0.1], time=np.array([0.0, 0.5, 1.0]) * duration)
        return predict(e, viscoelasticity__share=0.3, viscoelasticity__time_s=1.0)[-1]

    rest = predict(coupon([0.0, 0.05, 0.1]))[-1]
    assert at(1e-4) == pytest.approx(rest, rel=1e-3)
    assert at(1.0) < at(0.1)
    assert at(1e5) == pytest.approx(0.7 * rest, rel=1e-3)


def test_without_a_clock_nothing_relaxes():
    np.testing.assert_array_equal(predict(coupon(), viscoelasticity__share=0.4), predict(coupon()))


def test_the_second_pull_is_softer_below_the_largest_strain_and_rejoins_above():
    loop = np.concatenate([np.linspace(0, 0.5, 26), np.linspace(0.5, 0, 26)[1:], np.linspace(0, 0.8, 41)[1:]])
    e = coupon(loop)
    soft = predict(e, mullins_softening__softening=0.4) / np.where(loop > 0, predict(e), 1.0)
    first, unloading, again = soft[1:26], soft[26:50], soft[51:]
    np.testing.assert_allclose(first, 1.0)
    assert (unloading < 1).all()
    reloading = loop[51:]
    assert (again[reloading < 0.49] < 1).all()
    np.testing.assert_allclose(again[reloading >= 0.5], 1.0)


def test_a_specimen_remembers_its_earlier_tests():
    before, after = (coupon(specimen="A", name=n) for n in ("before", "after"))
    simulator = CouponStress([before, after])
    values = {"mullins_softening.softening": 0.4}
    assert simulator.predict(before, values)[0, 50] == pytest.approx(predict(before)[50])
    assert simulator.predict(after, values)[0, 50] < 0.9 * predict(after)[50]


def test_compression_alone_is_stiffer():
    e = coupon(np.linspace(-0.3, 0.3, 61))
    ratio = predict(e, tension_compression_asymmetry__excess=0.5)[[10, 50]] / predict(e)[[10, 50]]
    np.testing.assert_allclose(ratio, [1.5, 1.0])


def test_toe_shifts_the_curve_by_the_gap_and_starts_without_stiffness():
    e = coupon(np.linspace(0, 0.5, 501), length_mm=50.0)
    found = predict(e, seating__gap_mm=1.0)
    shifted = predict(coupon(np.linspace(0, 0.5, 501) - 1.0 / 50.0))
    np.testing.assert_allclose(found[250:], shifted[250:], rtol=1e-4)
    assert found[1] < 0.05 * predict(e)[1]


def test_a_record_begins_at_its_preload():
    e = coupon(np.linspace(0, 0.5, 501), length_mm=50.0)
    found = predict(e, seating__gap_mm=0.5, seating__preload_kPa=7.0)
    assert found[0] == pytest.approx(7.0, rel=1e-6)
    longer = predict(coupon(np.linspace(0, 0.6, 6001), length_mm=50.0), seating__gap_mm=0.5)
    at = np.interp(7.0, longer, np.linspace(0, 0.6, 6001))
    np.testing.assert_allclose(
        found, np.interp(np.linspace(0, 0.5, 501) + at, np.linspace(0, 0.6, 6001), longer), rtol=1e-4
    )


def test_a_frame_in_series_adds_its_compliance():
    """Of a linear law the apparent modulus is E/(1 + c E A/L)."""
    e = coupon(np.linspace(0, 0.1, 11), section_mm=(10.0, 4.0), length_mm=20.0)
    found = predict(e, frame_compliance__mm_per_N=0.05)
    own = e["strain"] - 0.05 * 1e-3 * found * 40.0 / 20.0
    np.testing.assert_allclose(found, predict(coupon(own)), rtol=1e-9, atol=1e-9)


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
