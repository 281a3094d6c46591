"""Noise shown by readings alone, which bounds any noise estimated from a misfit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import attrs
import numpy as np

from ..arrays import Array
from .drive import FEWEST, reading_noise
from .noise import Source
from .readings import divided
from .record import DRIVES, KNOWN, Record, Series, repeats

# Noise may be this many times the scatter of readings: slow noise of an instrument is some two to three times
# its fast part (3.1 at most in 42 clean sets of a second code).
TIMES = 4.0
# Share by which an estimate of scatter from n readings is low, times the root of n.
FEW = 4.0
# Assumed accuracy of gauges and load cells, as a share of the largest reading: slow noise up to this needs no
# fast part.
ACCURACY = 0.002
# Bounds of the noise, in words.
STATED, SCATTERED, ASSUMED = "stated accuracy", "scatter of the readings", "usual accuracy"
# White noise exceeds the scatter that readings show by more than this factor in 1 series of 60 where it has
# 12 to 30 readings, and in none of 600 where it has 150.
SURELY = 1.5
# With fewer than `FEWEST` readings no scatter is seen: a model off by this share of them is wrong.
UNSEEN = 0.1
# Noise may be at most this many times the differences of repeats, as slow noise of two records may agree by
# chance.
REPEATED = 3.0
# Of the largest reading: gauges and load cells repeat no better.
REPEATABLE = 2e-4
# A residual below this many times the scatter is of no importance.
NEAR = 2.0
# Blocks in a window of a burst, and times the usual scatter: less happens by chance.
WINDOW, LOUD = 15, 2.5
# Deviations from those around it beyond which a block is a separate burst; largest share of such blocks.
ALONE, MOST = 4.0, 0.2
# Blocks over which separate loud ones are one burst, in which a reading may be near the others by chance.
TOGETHER = 7
# Noise of two records differs by twice its square; what is alike in both, by less than this share of it.
ALIKE = 0.5
# A louder block does not count any more.
LOUDEST = 1e3


def scatter(record: Record, series: Series) -> float:
    """Standard deviation of a series' readings from one to the next, in its unit; nan for too few."""
    e = record.experiments[series.experiment]
    values = e[series.channel]
    seen = np.isfinite(values)
    if np.count_nonzero(seen) < FEWEST:
        return math.nan
    clock = e.columns.get("time_s", np.arange(len(values), dtype=float))
    # The least of several estimates: of few readings it is too small.
    few = 1.0 + FEW / math.sqrt(np.count_nonzero(seen))
    return max(few * reading_noise(clock[seen], values[seen]), series.step / math.sqrt(12.0))


def stated_noise(record: Record, series: Series) -> float:
    """The error that the stated accuracy of a series' instruments allows, in its unit; inf without any.

    That of its instrument and, by the mean slope, of the instruments of its drives.
    """
    e = record.experiments[series.experiment]
    found = e.stated_accuracy(series.channel)
    drives = [c for c in DRIVES if record.driven(series.experiment, c) and np.ptp(e[c]) > 0.0]
    for c in drives:
        stated = e.stated_accuracy(c)
        if math.isfinite(stated) and not (c == "displacement_mm" and "strain" in drives):
            slope = float(np.nanmax(e[series.channel]) - np.nanmin(e[series.channel])) / float(np.ptp(e[c]))
            found = math.hypot(found, stated * slope)
    return found


def noise_limit(record: Record, series: Series) -> tuple[float, str]:
    """The largest standard deviation of noise of a series, in its channel's unit, and its source.

    The accuracy stated for its instruments, or `SURELY` the scatter from reading to reading (`reading_noise`,
    or the display's steps) where this is larger. Without a statement `TIMES` that scatter, or `ACCURACY` of
    the largest reading; `UNSEEN` of it if there are too few readings to estimate it.
    """
    largest = float(np.nanmax(np.abs(record.experiments[series.experiment][series.channel])))
    seen, stated = scatter(record, series), stated_noise(record, series)
    if math.isfinite(stated):
        least = series.step / math.sqrt(12.0) if math.isnan(seen) else SURELY * seen
        return max(stated, least), STATED if stated > least else SCATTERED
    if math.isnan(seen):
        return UNSEEN * largest, ASSUMED
    return max(TIMES * seen, ACCURACY * largest), SCATTERED if TIMES * seen > ACCURACY * largest else ASSUMED


def shown_noise(record: Record, series: Series) -> float:
    """The standard deviation of `noise_limit`."""
    return noise_limit(record, series)[0]


def by_repeats(record: Record, series: Series, left: Array) -> float:
    """The largest standard deviation of noise that a series' repeats allow, in its unit; inf without any.

    left (N,): a misfit in the record's units. A residual common to repeats is no noise. No instrument repeats
    better than its steps, or `REPEATABLE` of the largest reading.
    """
    own = left[series.at]
    apart = [
        float(np.sqrt(np.mean((own - left[o.at]) ** 2) / 2.0))
        for o in record.series
        if o is not series and len(left[o.at]) == len(own) and repeats(record, series, o)
    ]
    if not apart:
        return math.inf
    largest = float(np.nanmax(np.abs(record.experiments[series.experiment][series.channel])))
    few = 1.0 + FEW / math.sqrt(len(own))
    return max(REPEATED * few * max(apart), REPEATABLE * largest, series.step)


def within_accuracy(record: Record, sources: Mapping[str, Source]) -> dict[str, Source]:
    """Sources of noise by group, none larger than a stated accuracy allows (`noise_limit`).

    The slow part is made smaller first: readings show the white one.
    """
    found = dict(sources)
    for group, source in sources.items():
        members = [s for s in record.series if s.group == group]
        if all(math.isfinite(stated_noise(record, s)) for s in members):
            most = _root_mean_square([shown_noise(record, s) for s in members])
            slow = math.sqrt(max(most**2 - source.white**2, 0.0))
            found[group] = attrs.evolve(source, white=min(source.white, most), slow=min(source.slow, slow))
    return found


def bounded(record: Record, sources: Mapping[str, Source]) -> dict[str, Source]:
    """Sources of noise by group, none larger than its readings show (`shown_noise`, in the root mean square).

    A larger one is scaled down as a whole, so that its correlation time stays.
    """
    found = {}
    for group, source in within_accuracy(record, sources).items():
        most = _root_mean_square([shown_noise(record, s) for s in record.series if s.group == group])
        share = most / math.hypot(source.white, source.slow)
        smaller = attrs.evolve(source, white=share * source.white, slow=share * source.slow)
        found[group] = smaller if share < 1.0 else source
    return found


def within_scatter_without_clock(record: Record, sources: Mapping[str, Source]) -> dict[str, Source]:
    """Sources of noise by group, those of readings without a clock no larger than readings show (`bounded`).

    There each value stands alone, and the whole misfit would pass for white noise.
    """
    most = bounded(record, sources)
    timed = {s.group for s in record.series if not math.isnan(s.sample_s)}
    return {g: source if g in timed else most[g] for g, source in sources.items()}


def _root_mean_square(values: Sequence[float]) -> float:
    return math.sqrt(sum(v**2 for v in values) / max(len(values), 1))


@attrs.frozen
class Excess:
    """The series whose error exceeds its noise the most.

    error, noise: root mean square of the misfit and its largest noise, in the channel's unit. where: its
    experiment and channel. by: source of that noise, as text.
    """

    error: float
    noise: float
    where: str
    by: str = SCATTERED

    @property
    def times(self) -> float:
        """Error over noise."""
        return self.error / max(self.noise, 1e-300)


def excess(record: Record, left: Array) -> Excess | None:
    """Series of a misfit (N,), in the record's units, that exceeds its noise the most; None within it.

    Series by series, so that neither their number nor their length dilutes one misfit.
    """
    found = []
    for s in record.series:
        if s.group != KNOWN:
            own = left[s.at] if s.louder is None else left[s.at] / s.louder
            error = float(np.sqrt(np.mean(own**2)))
            where = f"{record.experiments[s.experiment].name}, {s.channel}"
            most, by = noise_limit(record, s)
            apart = by_repeats(record, s, left)
            found.append(Excess(error, min(most, apart), where, by if most < apart else SCATTERED))
    worst = max(found, key=lambda e: e.times, default=None)
    return worst if worst is not None and worst.times > 1.0 else None


def with_bursts(record: Record, left: Array) -> tuple[Record, list[str]]:
    """The record with each block's noise if it varies in time or with load, and a text on where.

    By the scatter of a misfit (N,) from block to block, in windows, to which a smooth error of the model does
    not contribute. Unchanged where the scatter is even, or as loud in a repeat, which leaves the same.
    """
    found, words = [], []
    for s in record.series:
        louder = None if s.group == KNOWN or math.isnan(s.sample_s) else _loudness(s.time_s, left[s.at])
        if louder is not None and _alike(record, s, left, louder > 1.0):
            louder = None
        found.append(attrs.evolve(s, louder=louder))
        if louder is not None:
            at = s.time_s[int(np.argmax(louder))]
            words.append(
                f"{record.experiments[s.experiment].name}, {s.channel}: the noise is up to "
                f"{louder.max():.2g} times the usual, most at {at:.4g} s; readings there count for less"
            )
    return attrs.evolve(record, series=tuple(found)) if words else record, words


def _alike(record: Record, series: Series, left: Array, loud: Array) -> bool:
    """Return True if a repeat of a series leaves the same misfit (N,) in its loud blocks (b,) of a mask."""
    own = left[series.at][loud]
    others = [
        left[o.at][loud]
        for o in record.series
        if o is not series and o.at.stop - o.at.start == len(loud) and repeats(record, series, o)
    ]
    return any(float(np.sum((own - other) ** 2)) < ALIKE * float(np.sum(own**2)) for other in others)


def _loudness(time_s: Array, left: Array) -> Array | None:
    """Noise (b,) of each block of a misfit (b,) over the usual, where it is `LOUD` or more; None if even.

    By the scatter of windows, and of single blocks by their distance from those around them: at most a share
    `MOST` of all. Blocks between loud blocks of one burst get the noise of the quieter of these.
    """
    from scipy.ndimage import maximum_filter1d, median_filter

    if len(left) < 4 * WINDOW:
        return None
    scatter = np.abs(divided(time_s, left, 2))
    if len(scatter) != len(left) - 2:
        return None
    usual = float(np.median(scatter))
    if not usual > 0.0:
        return None
    local = maximum_filter1d(median_filter(scatter, WINDOW, mode="nearest"), WINDOW)
    share = np.pad(local / usual, 1, "edge")
    apart = np.abs(left - median_filter(left, WINDOW, mode="nearest"))
    apart /= max(1.4826 * float(np.median(apart)), 1e-300)
    alone = apart > np.maximum(ALONE, 2.0 * share)
    if np.count_nonzero(alone) <= MOST * len(left):
        share = _joined(np.where(alone, apart, share), np.flatnonzero(alone))
    share = np.minimum(share, LOUDEST)
    return np.where(share > LOUD, share, 1.0) if (share > LOUD).any() else None


def _joined(share: Array, alone: Array) -> Array:
    """The noise (b,) of blocks over the usual, with that of blocks between separate loud ones of one burst.

    alone: numbers of the separate loud ones.
    """
    found = share.copy()
    for first, last in pairwise(alone.tolist()):
        if last - first <= TOGETHER:
            between = slice(first + 1, last)
            found[between] = np.maximum(share[between], min(share[first], share[last]))
    return found


def within_scatter(record: Record, left: Array) -> bool:
    """Return True if a misfit (N,) is below `NEAR` times the scatter, and no stretch above `TIMES`.

    It must also be within the scatter of repeats (`by_repeats`).
    """
    for s in record.series:
        own = left[s.at] if s.louder is None else left[s.at] / s.louder
        stretch = np.convolve(own, np.ones(min(WINDOW, len(own))) / min(WINDOW, len(own)), "valid")
        # Slow noise stays for a while where it goes.
        worst = max(float(np.sqrt(np.mean(own**2))), NEAR / TIMES * float(np.abs(stretch).max(initial=0.0)))
        most = min(NEAR * scatter(record, s), by_repeats(record, s, left), shown_noise(record, s))
        if s.group == KNOWN or not worst < most:
            return False
    return True
