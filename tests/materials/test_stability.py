"""Drucker's postulate: closed forms, laws that are always stable, the stretch at which one ceases to be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.fem.laws import Foam, MooneyRivlin, NeoHooke, Ogden, Yeoh
from mu_addon.materials.coupon import MODES, isochoric_stretches
from mu_addon.materials.stability import check_stability, least_stiffness, whole_ranges


def test_neo_hookes_least_stiffness_is_that_across_the_shorter_axes():
    # tau_a = mu a^2: between two equal axes it is 2 mu a^2, and that of the shorter ones is least in tension.
    a = np.array([1.0, 1.5, 3.0])
    found = least_stiffness(NeoHooke, np.array([0.8, 100.0]), "uniaxial", a)
    assert found == pytest.approx(2 * 0.8 / a, rel=1e-9)


def work(law_energy, e, de, h=1e-4):
    """d(tau):d(e) of an increment de at logarithmic strains e, by differences of the energy."""
    return (law_energy(e + h * de) - 2 * law_energy(e) + law_energy(e - h * de)) / h**2


@given(
    st.floats(0.1, 2),
    st.floats(-0.3, 0.5),
    st.sampled_from(MODES),
    st.floats(0.5, 2.5),
    st.integers(0, 1000),
)
def test_no_increment_costs_less_than_the_least(c1, c2, mode, stretch, seed):
    def energy(e):
        x = np.exp(2 * e)
        return c1 * (x.sum() - 3) + c2 * ((1 / x).sum() - 3)

    least = least_stiffness(MooneyRivlin, np.array([c1, c2, 100.0]), mode, np.array([stretch]))[0]
    e = np.log(isochoric_stretches(mode, np.array([stretch]))[0])
    de = np.random.default_rng(seed).normal(size=3)
    de -= de.mean()
    de /= np.linalg.norm(de)
    scale = c1 + abs(c2)
    assert work(energy, e, de) >= least - 1e-4 * scale * np.exp(2 * np.abs(e).max())


@given(
    st.lists(
        st.tuples(st.floats(1e-3, 2), st.floats(-6, 8).filter(lambda a: abs(a) > 0.1)), min_size=3, max_size=3
    ),
    st.sampled_from(MODES),
)
def test_ogden_laws_whose_terms_all_stiffen_are_stable(terms, mode):
    row = np.append(np.ravel([(2 * c / a, a) for c, a in terms]), 1000.0)
    found = check_stability(Ogden, row, mode, 0.3, 3.0)
    assert found.stable
    assert found.least_MPa > 0
    assert found.where() == "nowhere"


def test_mooney_rivlin_with_a_negative_c2_is_unstable_from_where_its_shear_vanishes():
    # (tau_a - tau_b)/(x_a - x_b) = 2 (c1 + c2 x_c), x = stretch^2, with c the third axis. Between the two
    # short axes the third is the pulled one: c1 + c2 a^2 < 0 from a = 2 on for c2 = -c1/4.
    found = check_stability(MooneyRivlin, np.array([0.4, -0.1, 1000.0]), "uniaxial", 1.0, 3.0)
    assert not found.stable
    assert found.unstable_at == pytest.approx(2.0, rel=0.012)
    assert found.where() == f"in uniaxial above a stretch of {found.unstable_at:.3g}"
    assert check_stability(MooneyRivlin, np.array([0.4, -0.1, 1000.0]), "uniaxial", 1.0, 1.97).stable
    # Squeezed, tau = 2 (a^2 - 1/a)(c1 + c2/a) turns before any shear vanishes.
    squeezed = check_stability(MooneyRivlin, np.array([0.4, -0.1, 1000.0]), "uniaxial", 0.3, 1.0)
    a = np.linspace(0.3, 1.0, 100_001)
    assert squeezed.unstable_at == pytest.approx(a[np.argmin((a**2 - 1 / a) * (0.4 - 0.1 / a))], rel=0.012)
    assert "below" in squeezed.where()


def test_a_falling_stress_is_unstable_and_the_bulk_modulus_cannot_hide_it():
    row = np.array([0.5, -0.2, 0.0, 1e4])
    found = check_stability(Yeoh, row, "pure_shear", 0.5, 2.0)
    assert not found.stable
    # Kirchhoff stress (a^2 - a^-2) 2 (c1 + 2 c2 x), x = (a - 1/a)^2, is largest here;
    # pure shear is even in log a.
    a = np.linspace(1, 2, 100_001)
    x = (a - 1 / a) ** 2
    tau = (a**2 - a**-2) * (0.5 - 0.4 * x)
    top = a[np.argmax(tau)]
    assert found.unstable_at is not None
    assert abs(np.log(found.unstable_at)) == pytest.approx(np.log(top), abs=0.02)


def test_a_compressible_law_is_checked_along_its_own_path():
    foam = Foam.parameters(0.02, 0.2, 2.0, 8.0)[0]
    found = check_stability(Foam, foam, "uniaxial", 0.6, 1.4)
    assert found.stable
    # At rest, every increment costs at least 2 mu of it.
    at_rest = least_stiffness(Foam, foam, "uniaxial", np.array([1.0]))[0]
    assert at_rest == pytest.approx(2 * foam[0], rel=1e-6)


def test_modes_that_were_not_reached_go_as_far_in_strain():
    ranges = whole_ranges({"uniaxial": (1.0, 4.0)})
    assert ranges["uniaxial"] == (1.0, 4.0)
    assert ranges["equibiaxial"] == pytest.approx((1.0, 2.0))
    assert ranges["pure_shear"] == pytest.approx((1.0, 4 ** (np.sqrt(3) / 2)))
    # Pressing to a quarter is as far as pulling to four.
    assert whole_ranges({"uniaxial": (0.25, 1.0)})["equibiaxial"] == pytest.approx((1.0, 2.0))
    with pytest.raises(InputError, match="stretches from 2 to 1"):
        check_stability(NeoHooke, np.array([1.0, 10.0]), "uniaxial", 2.0, 1.0)
