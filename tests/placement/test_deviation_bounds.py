"""Candidates left out before all is solved: bounds hold, and what is kept is what all would give."""

import numpy as np
import pytest

from mu_addon.placement.deviation import deviation_of
from mu_addon.placement.deviation_bounds import Contest, first_and_rest, lower_bounds

PRESSURES = np.array([-20.0, -10.0, 10.0, 20.0, 30.0, 40.0])


def made_up(seed, candidates=10):
    """Distances (k, s, j) of candidates by instant, and the number (k,) of each instant's state."""
    noise = np.random.default_rng(seed)
    by_state = noise.gamma(1.5, 0.3, (candidates, len(PRESSURES), 7)) * noise.gamma(
        2.0, 0.5, (candidates, 1, 1)
    )
    index = np.concatenate([np.arange(len(PRESSURES)), noise.integers(0, len(PRESSURES), 7)])
    return by_state, index


@pytest.mark.parametrize("seed", range(25))
def test_a_bound_never_exceeds_the_mean_and_grows_with_each_state(seed):
    by_state, index = made_up(seed)
    means = np.array([deviation_of(one[index]).J_hat for one in by_state])
    instants = np.bincount(index)
    distance = by_state.mean(axis=2).T
    before = np.zeros(len(means))
    for count in range(len(PRESSURES) + 1):
        solved = np.where(np.arange(len(PRESSURES))[:, None] < count, distance, np.nan)
        bounds = lower_bounds(solved, instants)
        assert (bounds >= before).all()
        assert (bounds <= means * (1.0 + 1e-12)).all()
        before = bounds
    np.testing.assert_allclose(before, means, rtol=1e-12)


@pytest.mark.parametrize("best", [1, 3])
@pytest.mark.parametrize("margin_mm", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(15))
def test_the_best_of_a_contest_are_the_best_of_all(seed, best, margin_mm):
    by_state, index = made_up(seed)
    instants, distance = np.bincount(index), by_state.mean(axis=2).T
    means = lower_bounds(distance, instants)
    contest, (first, rest) = Contest(best, margin_mm), first_and_rest(PRESSURES)
    solved = np.full_like(distance, np.nan)
    solved[first] = distance[first]
    leaders = np.argsort(lower_bounds(solved, instants))[:best]
    solved[:, leaders] = distance[:, leaders]
    for number in rest:
        goes_on = contest.open(lower_bounds(solved, instants), np.isfinite(solved).all(axis=0))
        solved[number, goes_on] = distance[number, goes_on]
    complete = np.isfinite(solved).all(axis=0)
    wanted = {*np.argsort(means)[:best].tolist(), *np.flatnonzero(means <= means.min() + margin_mm).tolist()}
    assert wanted <= {*np.flatnonzero(complete).tolist()}


def test_instants_that_are_not_compared_are_in_no_bound():
    distance = np.array([[1.0, np.nan], [5.0, 5.0]])
    assert lower_bounds(distance, np.array([2, 0])).tolist() == [1.0, 0.0]


def test_equal_candidates_are_both_kept():
    at_least = np.array([0.1 + 0.2, 0.3])
    assert Contest().open(at_least, np.array([False, True])).tolist() == [True, False]


def test_nothing_is_left_out_before_the_best_are_known():
    nothing = np.zeros(4, bool)
    assert Contest(best=2).open(np.arange(4.0), nothing).all()


@pytest.mark.parametrize(
    ("pressure", "first", "rest"),
    [
        (PRESSURES, [40, 30, 20, 10], [-10, -20]),
        ([0.0, -5.0, 10.0], [10, 0], [-5]),  # weight alone is a state
        ([0.0, 10.0, 20.0], [20, 0], [10]),
        ([-10.0, -20.0], [-10], [-20]),
        ([7.0], [7], []),
    ],
)
def test_cheap_and_telling_pressures_come_first(pressure, first, rest):
    given = np.array(pressure, float)
    begun, left = first_and_rest(given)
    assert (given[begun].tolist(), given[left].tolist()) == (first, rest)
