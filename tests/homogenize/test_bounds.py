"""Bounds against hand-worked cases, against each other, and against what reaches them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.homogenize.bounds import Moduli, _harmonic, _phases, hashin_shtrikman

MODULUS = st.floats(0.01, 100.0)
PHASE = st.tuples(st.floats(0.01, 1.0), MODULUS, MODULUS)


def voigt(shares, bulk, shear):
    """Mean moduli of phases (k,), shares of the volume summing to 1: an upper bound under any strain."""
    f, K, G = _phases(shares, bulk, shear)
    return Moduli(float(f @ K), float(f @ G))


def reuss(shares, bulk, shear):
    """Harmonic mean moduli of phases (k,): a lower bound; 0 where a phase is a void."""
    f, K, G = _phases(shares, bulk, shear)
    return Moduli(_harmonic(f, K, 0.0), _harmonic(f, G, 0.0))


def test_two_phases_as_hashin_and_shtrikman_write_them():
    # Their equations 4.1 to 4.4 of 1963, phase 2 the stiffer.
    f1, f2, K1, K2, G1, G2 = 0.7, 0.3, 1.0, 10.0, 0.5, 6.0
    low, high = hashin_shtrikman([f1, f2], [K1, K2], [G1, G2])
    assert low.bulk == pytest.approx(K1 + f2 / (1 / (K2 - K1) + 3 * f1 / (3 * K1 + 4 * G1)))
    assert high.bulk == pytest.approx(K2 + f1 / (1 / (K1 - K2) + 3 * f2 / (3 * K2 + 4 * G2)))
    weak = 6 * (K1 + 2 * G1) * f1 / (5 * G1 * (3 * K1 + 4 * G1))
    stiff = 6 * (K2 + 2 * G2) * f2 / (5 * G2 * (3 * K2 + 4 * G2))
    assert low.shear == pytest.approx(G1 + f2 / (1 / (G2 - G1) + weak))
    assert high.shear == pytest.approx(G2 + f1 / (1 / (G1 - G2) + stiff))


def test_a_body_with_voids():
    low, high = hashin_shtrikman([0.2, 0.8], [3.0, 0.0], [1.0, 0.0])
    assert (low.bulk, low.shear) == (0, 0)
    # A hollow sphere under pressure of which 0.2 is solid: 4 G K f / (4 G + 3 K (1 - f)).
    assert high.bulk == pytest.approx(4 * 1 * 3 * 0.2 / (4 * 1 + 3 * 3 * 0.8))
    assert reuss([0.2, 0.8], [3.0, 0.0], [1.0, 0.0]) == Moduli(0.0, 0.0)


@given(st.lists(PHASE, min_size=1, max_size=5))
def test_they_come_in_order(phases):
    f, K, G = np.array(phases).T
    f = f / f.sum()
    low, high = hashin_shtrikman(f, K, G)
    most, least = voigt(f, K, G), reuss(f, K, G)
    for name in ("bulk", "shear"):
        values = [getattr(m, name) for m in (least, low, high, most)]
        assert all(a <= b * (1 + 1e-9) for a, b in itertools.pairwise(values))
        assert min(K if name == "bulk" else G) * (1 - 1e-9) <= values[0]


@given(MODULUS, MODULUS)
def test_one_phase_is_itself(bulk, shear):
    for found in (*hashin_shtrikman([0.4, 0.6], [bulk] * 2, [shear] * 2), voigt([1], [bulk], [shear])):
        assert (found.bulk, found.shear) == pytest.approx((bulk, shear))


def test_what_is_no_mixture_is_refused():
    with pytest.raises(InputError, match=r"sum to 0\.9"):
        hashin_shtrikman([0.5, 0.4], [1, 2], [1, 2])
    with pytest.raises(InputError, match="negative modulus"):
        voigt([1.0], [-1.0], [1.0])
