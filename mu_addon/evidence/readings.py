"""Limits of readings: steps of a display, samples at uneven times, single wrong readings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import MuError
from ..measured import Experiment
from ..measured.kinds import quantity_of
from .simulator import Composite
from .unclocked import IN_A_ROW, Points, in_a_run, lone, points

# Largest number of decimals of a gauge; a number with more was not read from a display.
DIGITS = 9
# Share of a step by which written readings may deviate from a multiple of it; readings without steps deviate
# by any. Also levels over readings: if nearly every reading has its own level there is no visible step.
OFF_LEVEL, MOST_LEVELS = 0.05, 0.95
# A reading is set aside if it is so many deviations from all that its neighbours predict.
WRONG = 8.0
# Share of a record's readings that may be isolated: more are no accident, such as corners of a fast cycle.
# Beside a prediction, which has such corners, more may be wrong.
MOST_ALONE, MOST_WRONG = 0.02, 0.1
MANY = 100
FEWEST = 9
# Number of readings whose median residual is the reference; a change counts as equally fast from this share
# of it on, and this many times more readings of such changes must be right.
AROUND_ONE, ALIKE, TIMES_MORE = 9, 0.7, 10
# Readings that stay so many samples before each change come in steps coarser than their noise.
STAYS = 2.0
# A noisy channel that reads its largest or smallest value so often in a row is at the end of its range.
CLIPPED = 5
# Readings around such a stretch are lost with it where this share of them is at the end: their noise is cut.
AROUND, SHARE = 11, 0.2
# Beyond this share too little of a record would be left.
MOST_CLIPPED = 0.6


def quantum(values: Array) -> float:
    """Step of readings (n,), in their unit; 0 if they show none.

    The largest number that divides all of them and all of their differences: with at most `DIGITS` digits, or
    any number, such as a converter's share of its range or a force over a section.

    >>> quantum(np.array([50.0, 49.5, 48.5]))
    0.5
    """
    seen = np.unique(values[np.isfinite(values)])
    return max(_decimal(seen), _any_step(seen, values), _step_of_few(seen, values))


def _decimal(seen: Array) -> float:
    for digits in range(DIGITS + 1):
        scaled = seen * 10.0**digits
        whole = np.round(scaled)
        if np.abs(scaled - whole).max(initial=0.0) < 1e-6 and np.abs(whole).max(initial=0.0) < 2**53:
            steps = np.diff(whole).astype(np.int64)
            return float(np.gcd.reduce(steps) if len(steps) else 1) / 10.0**digits
    return 0.0


def _any_step(seen: Array, values: Array) -> float:
    """Least difference of readings, or down to a fourth of it, that divides all differences."""
    if len(seen) < FEWEST:
        return 0.0
    away = seen - seen[0]
    # Written digits are finite: smaller differences are one reading.
    apart = np.diff(seen)
    written = 1e-6 * float(away[-1])
    apart = apart[apart > written]
    if not len(apart) or len(seen) > MOST_LEVELS * np.count_nonzero(np.isfinite(values)):
        return 0.0
    for share in range(1, 5):
        step = float(apart.min()) / share
        # From near levels to far ones, so that an error of the step does not grow into another count.
        for reach in np.geomspace(8.0 * step, max(8.0 * step, float(away[-1])), 8):
            near = away <= reach
            counts = np.round(away[near] / step)
            step = float(counts @ away[near] / max(counts @ counts, 1.0)) or step
        if np.abs(away / step - np.round(away / step)).max() < OFF_LEVEL:
            return step
    return 0.0


def _step_of_few(seen: Array, values: Array) -> float:
    """Largest step that divides a few levels, each read often, to their last digits.

    By Euclid's algorithm, down to a thousandth of the largest level: for records that stay at one reading.
    """
    if not 3 <= len(seen) < FEWEST or np.count_nonzero(np.isfinite(values)) < CLIPPED * len(seen):
        return 0.0
    levels = np.abs(seen[seen != 0.0])
    least = 1e-3 * float(levels.max())
    step = float(levels[0])
    for level in levels[1:].tolist():
        other = level
        while other > least:
            step, other = other, abs(step - other * round(step / other))
    # Its error grew with each remainder.
    counts = np.round(levels / step)
    step = float(counts @ levels / (counts @ counts))
    off = levels - step * counts
    return step if np.abs(off).max() < 2e-6 * float(levels.max()) else 0.0


def display_steps(experiments: Sequence[Experiment], simulator: Composite) -> dict[tuple[str, str], float]:
    """The step of each predicted channel, by kind and channel, of the readings of all experiments together.

    A record that is mostly held has too few levels for a sure step, but the same instrument reads all.
    Different instruments or zeros have no step in common: 0.
    """
    every: dict[tuple[str, str], list[Array]] = {}
    for e in experiments:
        for channel in simulator.channels(e) if simulator.knows(e) else ():
            every.setdefault((e.kind, channel), []).append(e[channel])
    return {key: quantum(np.concatenate(read)) for key, read in every.items()}


def dwell(values: Array) -> float:
    """Median length of runs of unchanged readings (n,).

    1 where they change at every sample, as in a ramp before a hold.
    """
    return float(np.median(_runs(values)))


def stretch(values: Array) -> float:
    """Mean over readings (n,) of the length of the run of unchanged readings that each lies in.

    Long where a part of a record is held, at any speed of the rest.
    """
    runs = _runs(values)
    return float(runs @ runs / runs.sum())


def _runs(values: Array) -> Array:
    """Lengths of the runs of unchanged readings (n,); 1 where there are none."""
    seen = values[np.isfinite(values)]
    ends = np.concatenate([[0], 1 + np.flatnonzero(np.diff(seen)), [len(seen)]])
    return np.diff(ends) if len(seen) else np.ones(1)


def between_steps(time_s: Array, values: Array) -> Array:
    """Quantised readings (n,) at times (n,) in s made continuous: lines from change to change.

    When a reading changes to the next step, the quantity is halfway between. When it turns back, or stays to
    the end, the middle of the step is the best estimate.
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
    """Differences (n - order,) of readings (n,) at any times (n,) in s, zero for polynomials below `order`.

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


def wrong_readings(time_s: Array, values: Array, step: float = 0.0) -> Array:
    """Mask (n,) of isolated readings (n,) at times (n,) in s, away from all around them.

    Each is compared with the lines through its neighbours on both sides, through the next but one on both
    sides, and through two before and two after it. A corner or a step agrees with one of the last two. A
    reading beyond all four, on one side and by `WRONG` deviations, is wrong. step: of the display, in the
    readings' unit, if known from other records.
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
    size = max(size, max(quantum(y), step) / math.sqrt(12.0), 1e-9 * float(np.ptp(y)))
    low, high = np.nanmin(away, axis=0), np.nanmax(away, axis=0)
    alone = (low > WRONG * size) | (high < -WRONG * size)
    # Beyond the ends the course is unknown.
    alone[:2] = alone[-2:] = False
    if np.count_nonzero(alone) <= max(1, MOST_ALONE * n):
        found[known[alone]] = True
    return found


def clipped_readings(time_s: Array, values: Array) -> Array:
    """Mask (n,) of readings (n,) at times (n,) in s that lie at the end of their channel's range.

    Readings that stay at the record's largest or smallest value for `CLIPPED` samples, although the channel
    is noisy and has no steps, and the readings between them, whose noise is cut off on one side.
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
        if np.count_nonzero(free) < 4 * CLIPPED or stretch(y[free]) > CLIPPED:
            # A coarse display stays at other readings too.
            continue
        noise = float(np.median(np.abs(divided(time_s[known[free]], y[free], 6))))
        if noise > 1e-6 * float(np.ptp(y)):
            near = np.convolve(at, np.ones(AROUND) / AROUND, mode="same")
            found[known[at | (near >= SHARE)]] = True
    return found if np.count_nonzero(found) <= MOST_CLIPPED * len(known) else np.zeros(len(values), bool)


def without_wrong_readings(
    experiments: Sequence[Experiment], simulator: Composite
) -> tuple[list[Experiment], list[str]]:
    """The experiments without isolated or clipped predicted readings, and a text on these.

    See `wrong_readings` and `clipped_readings`.
    """
    found, words = [], []
    steps = display_steps(experiments, simulator)
    for e in experiments:
        columns = dict(e.columns)
        for channel in _timed_channels(e, simulator):
            clipped = clipped_readings(e["time_s"], e[channel])
            if clipped.any():
                columns[channel] = np.where(clipped, math.nan, e[channel])
                first = e["time_s"][clipped][0]
                words.append(
                    f"{e.name}, {channel}: {np.count_nonzero(clipped)} of {len(e)} readings are at the "
                    f"end of the channel's range or beside it, first at {first:.4g} s, and do not count"
                )
            wrong = wrong_readings(e["time_s"], columns[channel], steps[e.kind, channel])
            _set_aside(e, channel, columns, wrong, words)
        changed = any(columns[c] is not e.columns[c] for c in columns)
        found.append(attrs.evolve(e, columns=columns) if changed else e)
    return found, words


def unpredicted_readings(values: Array, predicted: Array, step: float = 0.0) -> Array:
    """Mask (n,) of readings (n,) that lie away from their prediction (n,) unlike those around them.

    By `WRONG` deviations from the median residual of `AROUND_ONE` readings, one or two together. A clock
    offset or a lag does that wherever the prediction changes fast. A residual that it could explain therefore
    counts only if ten times as many equally fast readings have none. step: as in `wrong_readings`.
    """
    found = np.zeros(len(values), bool)
    known = np.flatnonzero(np.isfinite(values) & np.isfinite(predicted))
    if len(known) < AROUND_ONE:
        return found
    off, plain = (values - predicted)[known], predicted[known]
    beside = np.lib.stride_tricks.sliding_window_view
    away = np.abs(off - np.median(beside(np.pad(off, AROUND_ONE // 2, "reflect"), AROUND_ONE), axis=1))
    size = float(np.median(away)) / 0.6745
    size = max(size, max(quantum(values), step) / math.sqrt(12.0), 1e-9 * float(np.ptp(values[known])))
    alone = away > WRONG * size
    alone[:IN_A_ROW] = alone[-IN_A_ROW:] = False
    # What lasts is the model's.
    alone &= ~in_a_run(alone)
    fast = np.ptp(beside(np.pad(plain, 1, "edge"), 3), axis=1)
    for i in np.flatnonzero(alone & (away <= fast)):
        alike = fast >= ALIKE * fast[i]
        if np.count_nonzero(alike & ~alone) < TIMES_MORE * np.count_nonzero(alike & alone):
            return found
    # In a short record as many are no accident beside a prediction either.
    most = MOST_WRONG if len(off) >= MANY else MOST_ALONE
    if np.count_nonzero(alone) <= max(1, most * len(off)):
        found[known[alone]] = True
    return found


def without_unpredicted_readings(
    experiments: Sequence[Experiment], simulator: Composite, values: Mapping[str, float]
) -> tuple[list[Experiment], list[str]]:
    """The experiments without readings that are isolated in a fit's residual, and a text on these.

    Where a quantity changes fast from sample to sample, only the prediction shows that a reading is wrong; so
    where there is no clock (`unclocked.lone`).
    """
    found: list[Experiment] = []
    words: list[str] = []
    unclocked: dict[tuple[str, str], list[Points]] = {}
    steps = display_steps(experiments, simulator)
    for e in experiments:
        columns = dict(e.columns)
        channels = simulator.channels(e) if simulator.knows(e) else ()
        try:
            predicted = simulator.predict(e, values) if channels else np.empty((0, len(e)))
        except MuError:
            if e.role == "fit":
                raise
            # Held-out experiments without a prediction are reported with their gain.
            found.append(e)
            continue
        for row, channel in enumerate(channels):
            copied = next(
                (c for c in channels[:row] if np.array_equal(e[c], e[channel], equal_nan=True)), None
            )
            if copied is not None:
                # It does not count twice, and stays equal so that the record detects it.
                columns[channel] = columns[copied]
            elif "time_s" in e.columns:
                wrong = unpredicted_readings(e[channel], predicted[row], steps[e.kind, channel])
                _set_aside(e, channel, columns, wrong, words)
            elif (own := points(e, channel, predicted[row], steps[e.kind, channel])) is not None:
                unclocked.setdefault((e.kind, channel), []).append(own)
        changed = any(columns[c] is not e.columns[c] for c in columns)
        found.append(attrs.evolve(e, columns=columns) if changed else e)
    for every in unclocked.values():
        for p, alone in zip(every, lone(every), strict=True):
            at = experiments.index(p.experiment)
            columns, wrong = dict(found[at].columns), np.zeros(len(p.experiment), bool)
            wrong[p.rows[alone]] = True
            _set_aside(p.experiment, p.channel, columns, wrong, words, p.drive)
            found[at] = attrs.evolve(found[at], columns=columns) if wrong.any() else found[at]
    return found, words


def _timed_channels(experiment: Experiment, simulator: Composite) -> tuple[str, ...]:
    known = simulator.knows(experiment) and "time_s" in experiment.columns
    return simulator.channels(experiment) if known else ()


def _set_aside(
    e: Experiment,
    channel: str,
    columns: dict[str, Array],
    wrong: Array,
    words: list[str],
    by: str = "time_s",
) -> None:
    if not wrong.any():
        return
    columns[channel] = np.where(wrong, math.nan, columns[channel])
    quantity, unit = quantity_of(by) or (by, "")
    at = ", ".join(f"{v:.4g} {unit}".rstrip() for v in e[by][wrong][:5])
    at = at if by == "time_s" else f"{quantity.replace('_', ' ')} {at}"
    more = " and others" if np.count_nonzero(wrong) > 5 else ""
    words.append(
        f"{e.name}, {channel}: {np.count_nonzero(wrong)} of {len(e)} readings stand alone, "
        f"away from those before and after them (at {at}{more}), and do not count"
    )
