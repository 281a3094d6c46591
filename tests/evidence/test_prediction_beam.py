"""Cantilevers: small sags by hand, large ones by elliptic integrals and an independent integrator."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from mu_addon.errors import ConvergenceError
from mu_addon.evidence.prediction.beam_deadweight import BeamSag, cantilever

from .bench import experiment, measured, recovered


def beam(masses, **fields):
    return experiment(
        "beam_deadweight",
        {"added_mass_g": np.asarray(masses, float)},
        **{"section_mm": (30.0, 30.0), "length_mm": 100.0, **fields},
    )


def shot(tip, weight, tilt=0.0):
    """Sag by shooting on the curvature at the root."""

    def end(k, dense=False):
        def slope(s, y):
            return [y[1], -(tip + weight * (1 - s)) * np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(slope, (0, 1), [tilt, k, 0.0], rtol=1e-11, atol=1e-12).y[:, -1]

    k = brentq(lambda k: end(k)[1], 0.0, 2 * (tip + weight) + 1e-6, xtol=1e-13)
    return end(k)[2]


def elliptic(load):
    """Sag of a tip load on an elastica (Bisshopp and Drucker, Q. Appl. Math. 3 (1945) 272)."""

    def start(m):
        return np.arcsin(1 / np.sqrt(2 * m))

    m = brentq(
        lambda m: ellipk(m) - ellipkinc(start(m), m) - np.sqrt(load), 0.5 + 1e-13, 1 - 1e-13, xtol=1e-15
    )
    return 1 - 2 / np.sqrt(load) * (ellipe(m) - ellipeinc(start(m), m))


def test_small_sags_are_those_of_linear_theory():
    shear = 0.2
    found = cantilever(np.array([0.0, 1e-5]), 3e-5, shear=shear)
    weight = 3e-5 * (1 / 8 + shear / 2)
    np.testing.assert_allclose(found, [weight, weight + 1e-5 * (1 / 3 + shear)], rtol=1e-8)


def test_published_sags():
    """P L^2/EI and sag over length (Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145, table I)."""
    found = cantilever(np.array([1.0, 2.0, 5.0, 10.0]), 0.0)
    np.testing.assert_allclose(found, [0.30172, 0.49346, 0.71379, 0.81061], atol=6e-6)


@settings(max_examples=20)
@given(load=st.floats(0.05, 40.0))
def test_tip_loads_follow_the_elliptic_integrals(load):
    assert cantilever(np.array([load]), 0.0)[0] == pytest.approx(elliptic(load), rel=1e-6)


@pytest.mark.parametrize(("tip", "weight", "tilt"), [(0.0, 8.0, 0.0), (2.0, 5.0, 0.0), (1.0, 1.0, 0.1)])
def test_own_weight_follows_an_independent_integrator(tip, weight, tilt):
    assert cantilever(np.array([tip]), weight, tilt=tilt)[0] == pytest.approx(
        shot(tip, weight, tilt), rel=1e-7
    )


def test_the_stiffening_of_the_moment_is_that_of_the_law_over_the_section():
    """Nominal stress of c1 (I1 - 3) + c2 (I1 - 3)^2 over a bent rectangle, to the cube of the strain."""
    ratio, h = 0.5, 1.0
    y, w = np.polynomial.legendre.leggauss(40)
    y, w = y / 2, w / 2

    def moment(k, c2):
        a = 1 + k * y
        stress = 2 * (a - a**-2) * (1 + 2 * c2 * (a**2 + 2 / a - 3))
        return float((stress * y) @ w)

    k = 0.02
    extra = (moment(k, ratio) - moment(k, 0.0)) / (6 / 12 * k)
    assert extra == pytest.approx(0.9 * ratio * (h * k) ** 2, rel=2e-3)


def test_weight_and_modulus_are_recovered_from_three_masses():
    simulator = BeamSag()
    truth = {"beam_modulus_kPa": 250.0, "gravity.density_kg_m3": 1070.0}
    seen = measured(simulator, beam([0, 0, 20, 20, 52, 52, 101, 101]), truth, 0.08)
    start = {"beam_modulus_kPa": 300.0, "gravity.density_kg_m3": 500.0}
    found, sd, _ = recovered(simulator, [seen], start, 0.08)
    for key, value in truth.items():
        assert abs(found[key] - value) < 3 * sd[key], key


def test_a_load_that_the_law_cannot_bear_is_told():
    with pytest.raises(ConvergenceError, match="equilibrium"):
        # A moment that falls with curvature has a greatest value.
        cantilever(np.array([3.0]), 0.0, stiffening=-1.0)
