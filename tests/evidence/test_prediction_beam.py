"""Cantilevers: small sags by hand, large ones as published."""

import numpy as np
import pytest

from mu_addon.errors import ConvergenceError
from mu_addon.evidence.prediction.beam_deadweight import cantilever


def test_small_sags_are_those_of_linear_theory():
    shear = 0.2
    found = cantilever(np.array([0.0, 1e-5]), 3e-5, shear=shear)
    weight = 3e-5 * (1 / 8 + shear / 2)
    np.testing.assert_allclose(found, [weight, weight + 1e-5 * (1 / 3 + shear)], rtol=1e-8)


def test_published_sags():
    """P L^2/EI and sag over length (Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145, table I)."""
    found = cantilever(np.array([1.0, 2.0, 5.0, 10.0]), 0.0)
    np.testing.assert_allclose(found, [0.30172, 0.49346, 0.71379, 0.81061], atol=6e-6)


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


def test_a_load_that_the_law_cannot_bear_is_told():
    with pytest.raises(ConvergenceError, match="equilibrium"):
        # A moment that falls with curvature has a greatest value.
        cantilever(np.array([3.0]), 0.0, stiffening=-1.0)
