"""Where a sweep solves, and what it takes for the pressures between."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.placement.sampling import between, relative_error, solution_order

PRESSURE = np.array([-20.0, -10, 0, 10, 20, 30, 40])


def test_extremes_come_first_then_what_is_farthest_from_all_known():
    assert [[PRESSURE[i] for i in pair] for pair in solution_order(PRESSURE)] == [
        [-20, 40],
        [20, -10],
        [10, 30],
    ]


@given(st.lists(st.floats(-50, 50).filter(lambda p: abs(p) > 1e-3), min_size=1, max_size=9, unique=True))
def test_every_pressure_but_zero_is_met_once(values):
    pressure = np.unique([0.0, *values])
    met = [i for pair in solution_order(pressure) for i in pair]
    assert sorted(met) == [i for i, p in enumerate(pressure) if p]


@given(st.lists(st.floats(-50, 50).filter(lambda p: abs(p) > 1e-3), min_size=1, max_size=9, unique=True))
def test_where_the_unit_weighs_something_no_pressure_is_solved_beside_the_extremes(values):
    pressure = np.unique([0.0, *values])
    order = solution_order(pressure, has_gravity=True)
    assert sorted(i for batch in order for i in batch) == list(range(len(pressure)))
    met = [pressure[i] for i in order[0]]
    assert {0.0, pressure.min(), pressure.max()} <= set(met)
    assert len(met) <= 3
    # What a solved set is judged by is what its last pressure adds, and that is not the weight.
    assert met[-1] != 0


def test_a_value_at_no_pressure_is_taken_as_it_is_known():
    truth = np.array([np.array([0.7, -0.1]) + p * np.array([1.0, 0.2]) + p**2 * 0.01 for p in PRESSURE])
    np.testing.assert_allclose(between(PRESSURE, {i: truth[i] for i in (0, 2, 6)}), truth, atol=1e-12)


def test_a_polynomial_is_found_exactly_and_known_values_are_kept():
    truth = np.array([p * np.array([1.0, 0.2]) + p**2 * 0.01 - p**3 * 1e-4 for p in PRESSURE])
    known = {i: truth[i] for i in (0, 4, 6)}
    found = between(PRESSURE, known)
    np.testing.assert_allclose(found, truth, atol=1e-12)
    assert all((found[i] == truth[i]).all() for i in known)


def test_one_pressure_known_is_taken_in_proportion():
    np.testing.assert_allclose(between(PRESSURE, {6: np.array([4.0])})[:, 0], PRESSURE / 10)


def test_the_estimate_bounds_how_far_two_mean_deviations_lie_apart():
    rng = np.random.default_rng(3)
    fuller, change = rng.normal(size=(2, 7, 3, 6, 3))
    weight = np.array([2.0, 2, 3, 2, 2, 1, 1])
    sparser = fuller + 0.1 * change

    def J(values):
        return np.einsum("sjp,s->j", np.linalg.norm(values, axis=3), weight)

    assert (np.abs(J(fuller) - J(sparser)) / J(fuller)).max() <= relative_error(fuller, sparser, weight)
    assert relative_error(fuller, fuller, weight) == 0
    assert relative_error(np.zeros_like(fuller), np.zeros_like(fuller), weight) == 0
    assert relative_error(fuller, 0.9 * fuller, weight) == pytest.approx(0.1)


def test_the_error_between_pressures_counts_each_by_its_instants():
    """Off by 0.4 of 1 mm at the pressure of three of four instants."""
    fuller, sparser = np.zeros((2, 1, 1, 3)), np.zeros((2, 1, 1, 3))
    fuller[..., 0], sparser[:, 0, 0, 0] = 1.0, (1.0, 0.6)
    assert relative_error(fuller, sparser, np.array([1.0, 3.0])) == pytest.approx(0.3)
