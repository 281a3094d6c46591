"""A material that yields: its first loading, Masing's rule, what stays after unloading."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.evidence.bench import acted

NAME = "rate_independent_hysteresis"
M, H = 0.04, 0.2
VALUES = {f"{NAME}.per_strain": 1 / M, f"{NAME}.hardening": H}
UP = np.linspace(0.0, 0.12, 241)


def elastic_strain(strain, values):
    return acted("coupon", strain, values, "yielding_strain")


def first(strain):
    """The closed form of a first loading."""
    return H * strain + (1 - H) * M * -np.expm1(-strain / M)


def test_the_first_loading_is_the_closed_form():
    assert elastic_strain(UP, VALUES) == pytest.approx(first(UP), rel=1e-12)
    assert elastic_strain(-UP, VALUES) == pytest.approx(-first(UP), rel=1e-12)


def test_after_a_reversal_it_is_the_first_loading_twice_as_large():
    way = np.concatenate([UP, UP[-2::-1]])
    found = elastic_strain(way, VALUES)[len(UP) - 1 :]
    back = UP[-1] - way[len(UP) - 1 :]
    assert found == pytest.approx(first(UP[-1]) - 2 * first(back / 2), rel=1e-9, abs=1e-12)


def test_strain_stays_after_unloading():
    way = np.concatenate([UP, UP[-2::-1]])
    found = elastic_strain(way, VALUES)
    stays = np.interp(0.0, found[len(UP) - 1 :][::-1], way[len(UP) - 1 :][::-1])
    assert 0.02 < stays < 0.08
    # A loop closes where it began: what was within it is forgotten.
    loop = np.concatenate([UP, UP[-2:100:-1], UP[101:]])
    assert elastic_strain(loop, VALUES)[-1] == pytest.approx(elastic_strain(UP, VALUES)[-1], rel=1e-12)


@given(arrays(float, st.integers(1, 30), elements=st.floats(-0.2, 0.2)), st.integers(1, 5))
def test_rows_between_change_nothing(strain, between):
    """It is the way that counts, not how often it was read."""
    ends = np.concatenate([[0.0], strain])
    fine = np.concatenate([np.linspace(a, b, between + 1)[1:] for a, b in itertools.pairwise(ends)])
    found = elastic_strain(fine, VALUES)[between - 1 :: between]
    assert found == pytest.approx(elastic_strain(strain, VALUES), abs=1e-12)


@given(arrays(float, st.integers(1, 40), elements=st.floats(-0.2, 0.2)))
def test_it_is_elements_in_parallel_that_yield_one_after_the_other(strain):
    """Ishlinskii's: exponentially distributed yield strains, their shares at quantiles."""
    yields = -M * np.log1p(-(np.arange(2000) + 0.5) / 2000)
    borne, found = np.zeros_like(yields), []
    for step in np.diff(strain, prepend=0.0):
        borne = np.clip(borne + step, -yields, yields)
        found.append(borne.mean())
    expected = H * strain + (1 - H) * np.array(found)
    assert elastic_strain(strain, VALUES) == pytest.approx(expected, abs=1e-4 * M)
