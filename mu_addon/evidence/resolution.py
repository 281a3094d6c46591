"""What readings cannot tell: steps of a display, samples at uneven times, single readings that are wrong."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from ..measured import Experiment
from .simulator import Composite

Array = np.ndarray[Any, Any]

# Digits behind the point that a gauge may have; what has more was not read off a display.
DIGITS = 9
# A reading is set aside if it is so many deviations from all that its neighbours predict.
WRONG = 8.0
# Of a record so few readings may be wrong: what happens more often is no accident.
MOST_WRONG = 0.02
FEWEST = 9
# Readings that stay so many samples before each change come in steps coarser than their noise.
STAYS = 2.0
# A noisy channel that reads its largest or smallest value so often in a row is at the end of its range.
CLIPPED = 5
# Readings around such a stretch are lost with it where this share of them is at the end: their noise is cut.
AROUND, SHARE = 11, 0.2
# Beyond this share nothing of a record would be left to judge.
MOST_CLIPPED = 0.6


def quantum(values: Array) -> float:
    """The step in which readings (n,) come, in their unit; 0 where they show none.

    The largest number of which all of them and all of their differences are whole multiples, with `DIGITS`
    digits at most.

    >>> quantum(np.array([50.0, 49.5, 48.5]))
    0.5
    """
    seen = np.unique(values[np.isfinite(values)])
    for digits in range(DIGITS + 1):
        scaled = seen * 10.0**digits
        whole = np.round(scaled)
        if np.abs(scaled - whole).max(initial=0.0) < 1e-6 and np.abs(whole).max(initial=0.0) < 2**53:
            steps = np.diff(whole).astype(np.int64)
            return float(np.gcd.reduce(steps) if len(steps) else 1) / 10.0**digits
    return 0.0


def dwell(values: Array) -> float:
    """How many readings (n,) follow one another without a change, in the median of all such runs.

    1 where they change at every sample, as in a ramp before a hold.
    """
    seen = values[np.isfinite(values)]
    ends = np.concatenate([[0], 1 + np.flatnonzero(np.diff(seen)), [len(seen)]])
    return float(np.median(np.diff(ends))) if len(seen) else 1.0


def between_steps(time_s: Array, values: Array) -> Array:
    """Quantised readings (n,) at times (n,) in s as what may have been read: lines from change to change.

    Where a reading changes to the next step the quantity lies halfway; where it turns back, or stays to the
    end, the middle of the step is the best that is known.
    """
    changed = np.flatnonzero(np.diff(values))
    if not len(changed):
        return values
    times = 0.5 * (time_s[changed] + time_s[changed + 1])
    halfway = 0.5 * (values[changed] + values[changed + 1])
    turns = np.flatnonzero(halfway[1:] == halfway[:-1])
    middles = 0.5 * (times[turns] + times[turns + 1])
    places = np.concatenate([time_s[:1], times, middles, time_s[-1:]])
    known = np.concatenate([values[:1], halfway, values[changed[turns] + 1], values[-1:]])
    order = np.argsort(places, kind="stable")
    return np.interp(time_s, places[order], known[order])


def divided(time_s: Array, values: Array, order: int) -> Array:
    """Differences (n - order,) of readings (n,) at any times (n,) in s that no polynomial below `order` has.

    Of white noise each has its standard deviation: divided differences with weights of unit length.
    """
    t = np.lib.stride_tricks.sliding_window_view(time_s, order + 1)
    y = np.lib.stride_tricks.sliding_window_view(values, order + 1)
    # By the window's own length, so that products keep their digits.
    t = (t - t[:, :1]) / np.maximum(t[:, -1:] - t[:, :1], 1e-300)
    apart = t[:, :, None] - t[:, None, :] + np.eye(order + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = 1.0 / apart.prod(axis=2)
        weights /= np.linalg.norm(weights, axis=1, keepdims=True)
        found = (weights * y).sum(axis=1)
    return np.asarray(found[np.isfinite(found)])


def wrong_readings(time_s: Array, values: Array) -> Array:
    """Which readings (n,) at times (n,) in s stand alone, away from all around them: (n,) bool.

    Each is compared with the lines through its neighbours on both sides, through the next but one on both
    sides, and through two before and two after it. A corner or a step agrees with one of the latter two; what
    lies beyond all four, on one side and by `WRONG` deviations, belongs to nothing.
    """
    found = np.zeros(len(values), bool)
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < FEWEST:
        return found
    t, y = time_s[known], values[known]
    n = len(y)
    away = np.full((4, n), math.nan)
    for row, (first, second) in enumerate(((-1, 1), (-2, 2), (-2, -1), (1, 2))):
        at = np.arange(max(0, -first), n - max(0, second))
        t1, t2, y1, y2 = t[at + first], t[at + second], y[at + first], y[at + second]
        away[row, at] = y[at] - y1 - (t[at] - t1) / np.where(t2 > t1, t2 - t1, 1.0) * (y2 - y1)
    size = float(np.nanmedian(np.abs(away[0]))) / 0.6745
    size = max(size, quantum(y) / math.sqrt(12.0), 1e-9 * float(np.ptp(y)))
    low, high = np.nanmin(away, axis=0), np.nanmax(away, axis=0)
    alone = (low > WRONG * size) | (high < -WRONG * size)
    # Beyond the ends nothing says how it goes on.
    alone[:2] = alone[-2:] = False
    if np.count_nonzero(alone) <= max(1, MOST_WRONG * n):
        found[known[alone]] = True
    return found


def clipped_readings(time_s: Array, values: Array) -> Array:
    """Which readings (n,) at times (n,) in s are at the end of their channel's range: (n,) bool.

    Those that stay at the record's largest or smallest value for `CLIPPED` samples, though the channel is
    noisy and does not read in steps; with them those between, whose noise is cut off on one side.
    """
    found = np.zeros(len(values), bool)
    known = np.flatnonzero(np.isfinite(values))
    if len(known) < 8 * CLIPPED or dwell(values) > STAYS:
        return found
    y = values[known]
    for end in (y.max(), y.min()):
        at = y == end
        runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at, [0]]))))[::2]
        if not len(runs) or runs.max() < CLIPPED:
            continue
        free = ~at
        if np.count_nonzero(free) < 4 * CLIPPED:
            continue
        noise = float(np.median(np.abs(divided(time_s[known[free]], y[free], 6))))
        if noise > 1e-6 * float(np.ptp(y)):
            near = np.convolve(at, np.ones(AROUND) / AROUND, mode="same")
            found[known[at | (near >= SHARE)]] = True
    return found if np.count_nonzero(found) <= MOST_CLIPPED * len(known) else np.zeros(len(values), bool)


def without_wrong_readings(
    experiments: Sequence[Experiment], simulator: Composite
) -> tuple[list[Experiment], list[str]]:
    """The experiments without predicted readings that stand alone or were clipped, and which, in words.

    See `wrong_readings` and `clipped_readings`.
    """
    found, words = [], []
    for e in experiments:
        columns = dict(e.columns)
        if simulator.knows(e) and "time_s" in columns:
            for channel in simulator.channels(e):
                clipped = clipped_readings(e["time_s"], e[channel])
                if clipped.any():
                    columns[channel] = np.where(clipped, math.nan, e[channel])
                    first = e["time_s"][clipped][0]
                    words.append(
                        f"{e.name}, {channel}: {np.count_nonzero(clipped)} of {len(e)} readings are at the "
                        f"end of the channel's range or beside it, first at {first:.4g} s, and do not count"
                    )
                wrong = wrong_readings(e["time_s"], columns[channel])
                if wrong.any():
                    columns[channel] = np.where(wrong, math.nan, columns[channel])
                    at = ", ".join(f"{t:.4g} s" for t in e["time_s"][wrong][:5])
                    more = " and others" if np.count_nonzero(wrong) > 5 else ""
                    words.append(
                        f"{e.name}, {channel}: {np.count_nonzero(wrong)} of {len(e)} readings stand alone, "
                        f"away from those before and after them (at {at}{more}), and do not count"
                    )
        changed = any(columns[c] is not e.columns[c] for c in columns)
        found.append(attrs.evolve(e, columns=columns) if changed else e)
    return found, words
