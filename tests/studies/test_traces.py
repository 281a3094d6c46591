"""What is drawn of a channel: extremes in every column of pixels, the same however the samples came in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.sensing.traces import Traces, steady_range, unbroken


@given(
    st.lists(st.floats(0.0, 0.4), min_size=1, max_size=60),
    st.lists(st.integers(1, 20), min_size=1, max_size=20),
)
def test_extremes_are_those_of_all_samples_however_they_are_cut(steps, cuts):
    """Against a plain loop over the samples that are still in the window."""
    time = np.cumsum(steps)
    values = np.sin(7.0 * np.arange(len(time)))[:, None] * [1.0, -3.0]
    traces = Traces(2, seconds=4.0, bins=16)
    start = 0
    for cut in [*cuts, len(time)]:
        traces.add(time[start : start + cut], values[start : start + cut])
        start += cut
    traces.add(time[start:], values[start:])
    age, low, high = traces.extremes()
    place = np.floor(time / 0.25).astype(int)
    wanted = [k for k in range(place[-1] - 15, place[-1] + 1) if (place == k).any()]
    assert len(age) == len(wanted)
    for column, k in enumerate(wanted):
        np.testing.assert_array_equal(low[:, column], values[place == k].min(axis=0))
        np.testing.assert_array_equal(high[:, column], values[place == k].max(axis=0))
    assert (np.diff(age) > 0).all()
    assert age[0] >= -4.0
    assert age[-1] <= 0.0


def test_a_spike_of_one_sample_in_a_thousand_is_seen():
    traces = Traces(1, seconds=10.0, bins=100)
    values = np.zeros((50_000, 1))
    values[31_415] = 3.3
    traces.add(np.arange(50_000) / 5000, values)
    age, _, high = traces.extremes()
    assert len(age) == 100
    assert high.max() == 3.3
    assert np.count_nonzero(high) == 1


def test_what_is_no_number_leaves_a_hole_and_a_pause_another():
    traces = Traces(2, seconds=10.0, bins=100)
    time = np.concatenate([np.arange(0, 3, 0.05), np.arange(6, 9, 0.05)])
    values = np.column_stack([np.ones(len(time)), np.full(len(time), np.nan)])
    traces.add(time, values)
    age, low, _ = traces.extremes()
    assert np.isnan(low[1]).all()
    assert (low[0] == 1).all()
    assert [part.stop - part.start for part in unbroken(age, 0.5)] == [30, 30]
    assert unbroken(age[:0], 0.5) == []


def test_after_a_pause_longer_than_the_window_nothing_old_is_left():
    traces = Traces(1, seconds=1.0, bins=10)
    traces.add(np.arange(0, 1, 0.01), np.full((100, 1), 7.0))
    traces.add(np.array([1000.0]), np.array([[1.0]]))
    age, low, high = traces.extremes()
    assert len(age) == 1
    assert low[0, 0] == high[0, 0] == 1.0


def test_a_late_sample_does_not_turn_time_back():
    traces = Traces(1, seconds=1.0, bins=10)
    traces.add(np.array([5.05]), np.array([[1.0]]))
    traces.add(np.array([4.95, 2.0]), np.array([[2.0], [9.0]]))
    age, low, _ = traces.extremes()
    assert low[0].tolist() == [2.0, 1.0]
    assert traces.end_s == 5.05
    assert age[0] == pytest.approx(-0.1)


def test_the_axis_keeps_still_while_the_signal_fits_and_fills_it():
    first = steady_range(None, 1.0, 2.0)
    assert first[0] < 1.0
    assert first[1] > 2.0
    assert steady_range(first, 1.2, 1.9) == first
    assert steady_range(first, 0.5, 1.9)[0] < 0.5, "it grows at once"
    assert steady_range(first, 1.5, 1.6) != first, "and shrinks where hardly any of it is used"
    narrow = steady_range(None, 2.0, 2.0)
    assert narrow[0] < 2.0 < narrow[1]
    assert steady_range(narrow, 2.0, 2.0) == narrow
    assert steady_range(first, np.nan, np.nan) == first
