"""Drives of a specimen, freed of the noise of the gauge that read them.

A model is driven by readings. Noise in them (errors in variables) favours any effect that smooths them, such
as friction, a lag or a clock offset, over the right model.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..measured import Experiment
from .readings import STAYS, between_steps, divided, dwell
from .record import DRIVES
from .simulator import Composite

# Half-widths of windows, in samples.
WIDTHS = (1, 2, 4, 8, 16, 32, 64)
# A wider window counts while its straight line agrees with those of all narrower ones, within so many
# standard deviations: the rule of intersecting confidence intervals (Goldenshluger and Nemirovski 1997).
AGREE = 2.5
# Orders of differences that separate noise from signal: for noise all give one size, for a smooth signal the
# higher ones give less.
ORDERS = (2, 3, 4, 5, 6, 7, 8)
# Noise smaller than this share of a record's range changes no verdict, and is ignored.
NEGLIGIBLE = 1e-6
FEWEST = 9
# Rows of a record whose drive is denoised. Of fewer, corners are most of the differences: those of a triangle
# wave in 15 rows were taken for noise, and moved by 1.9 mm.
DENOISED = 40
# White noise is as large in every second reading; corners and curvature are larger there by more than this.
GROWN = 2.0


def reading_noise(time_s: Array, values: Array) -> float:
    """Standard deviation of white noise in readings (n,) at times (n,) in s, in their unit.

    By the median of higher differences, divided ones, so that samples may be missing or uneven.

    >>> rng, t = np.random.default_rng(0), np.arange(400.0)
    >>> round(float(reading_noise(t, 0.1 * t + rng.normal(0, 0.2, 400))), 2)
    0.2
    """
    found = []
    for order in ORDERS:
        if len(values) < 4 * order:
            break
        found.append(float(np.median(np.abs(divided(time_s, values, order)))) / 0.6745)
    return min(found, default=0.0)


def is_noise(time_s: Array, values: Array, sd: float) -> bool:
    """Return True if a scatter sd of readings (n,) at times (n,) in s is noise, not corners of their course.

    >>> t = np.arange(48.0)
    >>> is_noise(t, np.abs(t % 4 - 2), reading_noise(t, np.abs(t % 4 - 2)))
    False
    """
    apart = [reading_noise(time_s[first::2], values[first::2]) for first in (0, 1)]
    return max(apart) <= GROWN * sd


def denoised(time_s: Array, values: Array, sd: float | None = None) -> Array:
    """Readings (n,), in their unit, freed of white noise by local straight lines; corners are kept.

    time_s (n,): times in s. sd: standard deviation of the noise in the unit of the readings, that of
    `reading_noise` where it is None. At each sample a line is fitted to windows before, after and around it,
    each as wide as is consistent with all narrower ones. The three estimates are averaged with inverse
    variances as weights. Source: Goldenshluger and Nemirovski 1997 (intersecting confidence intervals).
    """
    sd = reading_noise(time_s, values) if sd is None else sd
    weight, total = np.zeros(len(values)), np.zeros(len(values))
    for before, after in ((True, True), (True, False), (False, True)):
        found, variance = _widest(time_s, values, sd, before, after)
        weight += 1.0 / variance
        total += found / variance
    return np.asarray(total / weight)


def _widest(time_s: Array, values: Array, sd: float, before: bool, after: bool) -> tuple[Array, Array]:
    """The line's value (n,) at each sample by the widest window that agrees, and its variance over sd^2."""
    best, spread = values.copy(), np.ones(len(values))
    low, high = values - AGREE * sd, values + AGREE * sd
    agrees = np.ones(len(values), bool)
    for width in WIDTHS:
        if width >= len(values):
            break
        found, variance = _lines(time_s, values, width * before, width * after)
        reach = AGREE * sd * np.sqrt(variance)
        low, high = np.maximum(low, found - reach), np.minimum(high, found + reach)
        agrees &= low <= high
        # A line through two readings is no more certain at its end than the reading.
        better = agrees & (variance < spread)
        best, spread = np.where(better, found, best), np.where(better, variance, spread)
    return best, spread


def _lines(time_s: Array, values: Array, before: int, after: int) -> tuple[Array, Array]:
    """Values (n,) of least-squares lines at each sample over so many samples around it, and variances."""
    n = len(values)
    first = np.maximum(np.arange(n) - before, 0)
    last = np.minimum(np.arange(n) + after, n - 1) + 1
    # About the middle, so that sums keep their digits.
    t = (time_s - time_s.mean()) / max(float(np.ptp(time_s)), 1e-300)
    y = values - values.mean()

    def summed(of: Array) -> Array:
        run = np.concatenate([[0.0], np.cumsum(of)])
        return np.asarray(run[last] - run[first])

    count = (last - first).astype(float)
    st, sy, stt, sty = summed(t), summed(y), summed(t * t), summed(t * y)
    mean_t, mean_y = st / count, sy / count
    squares = np.maximum(stt - st * mean_t, 0.0)
    known = squares > 1e-18 * count
    slope = np.where(known, (sty - st * mean_y) / np.where(known, squares, 1.0), 0.0)
    away = t - mean_t
    variance = 1.0 / count + np.where(known, away**2 / np.where(known, squares, 1.0), 0.0)
    return values.mean() + mean_y + slope * away, np.minimum(variance, 1.0)


def denoised_drives(
    experiments: Sequence[Experiment], simulator: Composite
) -> tuple[list[Experiment], list[Experiment] | None]:
    """The experiments with denoised drives (`denoised`), and a copy with noise added again.

    Drives are the columns of `DRIVES` that no simulator predicts, in experiments with time_s, at least
    `DENOISED` rows and finite values; what is no noise stays (`is_noise`). The copy has the same drives with
    equal simulated noise, denoised again. A model driven by it misfits data of the first list only by the
    gauge's noise. A drive in steps of a display is freed of them (`between_steps`), and its copy stays as
    read. The copy is None where no drive is noisy.
    """
    rng = np.random.default_rng(0)
    found, again = [], []
    for e in experiments:
        drives: list[str] = []
        if simulator.knows(e) and "time_s" in e.columns and len(e) >= FEWEST:
            predicted = simulator.channels(e)
            drives = [c for c in DRIVES if c in e.columns and c not in predicted and np.isfinite(e[c]).all()]
        once, twice = dict(e.columns), dict(e.columns)
        for c in drives:
            if dwell(e[c]) > STAYS and len(np.unique(e[c])) > FEWEST:
                # Steps of the display, not of the drive itself.
                once[c] = between_steps(e["time_s"], e[c])
                continue
            sd = reading_noise(e["time_s"], e[c])
            if (
                len(e) >= DENOISED
                and sd > NEGLIGIBLE * float(np.ptp(e[c]))
                and is_noise(e["time_s"], e[c], sd)
            ):
                once[c] = denoised(e["time_s"], e[c], sd)
                twice[c] = denoised(e["time_s"], once[c] + rng.normal(0.0, sd, len(e)))
        noisy = any(once[c] is not e.columns[c] for c in drives)
        found.append(attrs.evolve(e, columns=once) if noisy else e)
        again.append(attrs.evolve(e, columns=twice) if noisy else e)
    return found, again if any(a is not e for a, e in zip(again, found, strict=True)) else None
