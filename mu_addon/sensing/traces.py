"""Channels of the last seconds for drawing: minimum and maximum in every pixel column.

Each sample is processed once, on arrival, so that drawing takes equal time at 10 Hz and 10 kHz and shows a
spike of one sample.
"""

from __future__ import annotations

import copy
import itertools

import numpy as np

from ..arrays import Array


class Traces:
    """Extremes of `channels` values over the last `seconds`, in `bins` equal steps of time."""

    def __init__(self, channels: int, seconds: float, bins: int) -> None:
        self.step_s = seconds / bins
        self.end_s = -np.inf
        """Time of the latest sample."""
        self._newest = 0
        self._low = np.full((channels, bins), np.nan)
        self._high = np.full((channels, bins), np.nan)

    @property
    def bins(self) -> int:
        """Steps of time."""
        return self._low.shape[1]

    def copy(self) -> Traces:
        """An independent copy."""
        return copy.deepcopy(self)

    def add(self, time_s: Array, values: Array) -> None:
        """Add samples: times (n,) in s and values (n, channels); values that are not numbers are left out."""
        if not len(time_s):
            return
        place = np.floor(time_s / self.step_s).astype(np.int64)
        newest = int(place.max())
        if not np.isfinite(self.end_s):
            self._newest = newest
        first = max(self._newest + 1, newest - self.bins + 1)
        emptied = np.arange(first, newest + 1) % self.bins
        self._low[:, emptied] = self._high[:, emptied] = np.nan
        self._newest = max(self._newest, newest)
        self.end_s = max(self.end_s, float(time_s.max()))
        kept = place > self._newest - self.bins
        at = place[kept] % self.bins
        for k, column in enumerate(values[kept].T):
            np.fmin.at(self._low[k], at, column)
            np.fmax.at(self._high[k], at, column)

    def extremes(self) -> tuple[Array, Array, Array]:
        """Age (b,) in s of every step that holds samples, oldest first, and lowest and highest (channels, b).

        The latest sample's age is 0, earlier ones' negative.
        """
        number = np.arange(self._newest - self.bins + 1, self._newest + 1)
        order = number % self.bins
        seen = np.isfinite(self._low[:, order]).any(axis=0)
        age = (number[seen] + 0.5) * self.step_s - self.end_s
        return np.minimum(age, 0.0), self._low[:, order][:, seen], self._high[:, order][:, seen]


def unbroken(age_s: Array, gap_s: float) -> list[slice]:
    """Stretches of times (b,) in s, ascending, without a gap longer than that."""
    cuts = np.flatnonzero(np.diff(age_s) > gap_s) + 1
    ends = [0, *cuts.tolist(), len(age_s)]
    return [slice(a, b) for a, b in itertools.pairwise(ends) if b > a]


def steady_range(before: tuple[float, float] | None, low: float, high: float) -> tuple[float, float]:
    """A range around low .. high, unchanged while they fit and fill a third of it."""
    if not (np.isfinite(low) and np.isfinite(high)):
        return before or (0.0, 1.0)
    if before is not None and before[0] <= low and high <= before[1]:
        wide = before[1] - before[0]
        # As narrow as it gets, or filled.
        if wide <= 2e-3 * max(abs(low), abs(high)) or high - low >= wide / 3:
            return before
    room = max(0.15 * (high - low), 5e-4 * max(abs(low), abs(high)), 1e-6)
    return low - room, high + room
