"""Backbones and their deviation against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.placement.deviation import centreline, centreline_deviation, rank


def arc(angle, n=6, length=60.0):
    """Points on a circular arc of a given total angle in the mirror plane x = 0."""
    s = np.linspace(0, 1, n)
    radius = length / angle
    return np.stack([0 * s, radius * (1 - np.cos(angle * s)), radius * np.sin(angle * s)], axis=1)


def test_a_straight_backbone_is_sampled_evenly():
    points = np.array([[0, 12.5, z] for z in (0.0, 10, 25, 30, 47, 60)])[None]
    curve = centreline(points, 7)
    np.testing.assert_allclose(curve[0, :, 2], np.linspace(0, 60, 7), atol=1e-3)
    np.testing.assert_allclose(curve[0, :, 1], 12.5, atol=1e-12)


def test_stations_on_an_arc_are_evenly_spaced_in_arc_length():
    curve = centreline(arc(0.8)[None], 31)[0]
    exact = arc(0.8, 31)
    assert np.abs(curve - exact).max() < 2e-3


def test_deviation_of_a_shift_and_of_a_shear():
    k, j = 5, 11
    base = np.zeros((k, j, 3))
    shifted = base + np.array([0.0, 0.3, 0.4])
    found = centreline_deviation(shifted, base)
    assert found.J_hat == pytest.approx(0.5)
    assert found.J_cont == pytest.approx(0.5)
    growing = base.copy()
    growing[:, :, 1] = np.linspace(0, 1, k)[:, None] * np.linspace(0, 2, j)
    found = centreline_deviation(growing, base)
    np.testing.assert_allclose(found.over_time, np.linspace(0, 1, k))
    np.testing.assert_allclose(found.over_length, 0.5 * np.linspace(0, 2, j))
    assert found.J_hat == pytest.approx(0.5)
    # Root mean square of 2 t l over the unit square is 2/3; the trapezoid's error is second order.
    fine = np.linspace(0, 1, 400)[:, None, None] * np.linspace(0, 2, 400)[None, :, None] * [0, 1, 0]
    assert centreline_deviation(fine, np.zeros_like(fine)).J_cont == pytest.approx(2 / 3, rel=1e-5)


@given(st.lists(st.floats(0, 10), min_size=1, max_size=12))
def test_rank_is_a_permutation_that_orders(values):
    found = rank(np.array(values))
    assert sorted(found) == list(range(1, len(values) + 1))
    assert (np.diff(np.array(values)[np.argsort(found)]) >= 0).all()
