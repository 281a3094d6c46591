"""The search by predictions against all paths, and what it says of its risk."""

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.generators import value_of
from mu_addon.placement.search import FIRST, front, probability_of_better, searching


def search_paths(predicted_mm, check, most=100):
    return value_of(searching(predicted_mm, most), check)


def test_a_perfect_prediction_needs_only_the_first_checks():
    J = np.linspace(1.0, 2.0, 200)
    outcome = search_paths(J, lambda numbers: J[numbers] * 1.3)
    assert outcome.best == 0
    assert outcome.complete
    assert len(outcome.checked) == FIRST


def test_a_useless_prediction_is_admitted():
    rng = np.random.default_rng(0)
    J = rng.uniform(1.0, 2.0, 300)
    outcome = search_paths(np.ones(300), lambda numbers: J[numbers], 40)
    assert not outcome.complete
    assert outcome.risk > 0.05
    assert len(outcome.checked) == 40


def test_the_risk_holds_over_many_searches():
    """With normal errors as assumed, the best is missed no more often than the risk allows."""
    missed = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        predicted_mm = np.exp(rng.normal(0, 0.5, 300))
        J = predicted_mm * np.exp(rng.normal(0.1, 0.08, 300))
        missed += search_paths(predicted_mm, lambda numbers, J=J: J[numbers]).best != np.argmin(J)
    # The bound is on each search, and a miss also needs the better path to be left unchecked.
    assert missed <= 200 * 0.05


def test_everything_checked_leaves_no_risk():
    J = np.array([0.3, 0.1, 0.2])
    assert probability_of_better(np.ones(3), J) == 0.0
    outcome = search_paths(np.ones(3), lambda numbers: J[numbers])
    assert outcome.complete
    assert outcome.best == 1


@pytest.mark.parametrize("wrong", [np.array([]), np.array([1.0, 0.0])])
def test_predictions_that_cannot_be_compared_are_refused(wrong):
    with pytest.raises(InputError, match="no path"):
        search_paths(wrong, lambda numbers: np.ones(len(numbers)))


def test_the_front_holds_what_is_neither_shorter_nor_worse_than_another():
    length = np.array([25.0, 25.0, 30.0, 40.0, 40.0, 50.0])
    J = np.array([0.10, 0.05, 0.04, 0.20, 0.30, np.nan])
    assert front(length, J).tolist() == [2, 3]


def test_paths_that_cannot_be_made_are_left_out_and_the_best_of_the_rest_is_found():
    J = np.linspace(1.0, 2.0, 40)
    impossible = np.arange(40) % 3 == 0

    def check(numbers):
        return np.where(impossible[numbers], np.nan, J[numbers])

    outcome = search_paths(J, check)
    assert outcome.best == 1
    assert set(outcome.left_out) <= set(np.flatnonzero(impossible))
    assert 0 in outcome.left_out
    assert not set(outcome.left_out) & set(outcome.checked)


def test_a_search_of_impossible_paths_alone_says_so():
    with pytest.raises(InputError, match="none of the paths is possible"):
        search_paths(np.ones(5), lambda numbers: np.full(len(numbers), np.nan))
