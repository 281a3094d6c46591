"""Outlying readings of a fit whose residual is otherwise clean: they decide no verdict."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..arrays import Array
from ..measured import Experiment
from .fit import Fit, Fitter
from .readings import ALIKE, MOST_WRONG, TIMES_MORE
from .record import KNOWN, Series
from .residual_tests.table import FALSE_ALARM

NAME = "outlier"


def without_outliers(
    experiments: Sequence[Experiment], fitter: Fitter, fit: Fit, tests: int
) -> tuple[list[Experiment], list[str]]:
    """The experiments without readings whose residual exceeds chance, and a text on these readings.

    By a normal deviate each, at the rate at which `structure` sees an outlier among so many tests.
    Unchanged if a series has more of them than `MOST_WRONG`, or if they look like a clock offset or a lag:
    each is off by at most the prediction's change there, and so is more than one in `TIMES_MORE` of the
    readings that change as fast.
    """
    from scipy.stats import norm

    record = fitter.record
    series = [s for s in record.series if s.group != KNOWN and not np.isnan(s.sample_s)]
    tried = sum(s.at.stop - s.at.start for s in series)
    limit = float(norm.isf(FALSE_ALARM / (2.0 * max(tried, 1) * max(tests, 1))))
    off = np.abs(fit.residual) > limit
    if _where_it_is_fast(fitter, fit, series, off):
        return list(experiments), []
    columns: dict[str, dict[str, Array]] = {}
    words = []
    for s in series:
        beyond = np.flatnonzero(off[s.at])
        if not len(beyond):
            continue
        if len(beyond) > max(1.0, MOST_WRONG * (s.at.stop - s.at.start)):
            return list(experiments), []
        e = record.experiments[s.experiment]
        values = columns.setdefault(e.name, {}).get(s.channel, e[s.channel]).copy()
        for block in beyond:
            values[s.samples(int(block))] = np.nan
        columns[e.name][s.channel] = values
        at = ", ".join(f"{s.time_s[b]:.4g} s" for b in beyond[:5])
        words.append(
            f"{e.name}, {s.channel}: the reading at {at} lies farther from the fit than noise does and, "
            "with nothing else left, does not count"
        )
    found = [
        attrs.evolve(e, columns={**e.columns, **columns[e.name]}) if e.name in columns else e
        for e in experiments
    ]
    return found, words


def _where_it_is_fast(fitter: Fitter, fit: Fit, series: Sequence[Series], off: Array) -> bool:
    """Return True if a late prediction may explain readings `off` (N,), as they lie where it changes fast."""
    predicted, values = fitter.predict(fit.values), fitter.record.values
    change = np.zeros(len(predicted))
    for s in series:
        change[s.at] = np.ptp(sliding_window_view(np.pad(predicted[s.at], 1, "edge"), 3), axis=1)
    for s in series:
        own = np.concatenate([np.arange(o.at.start, o.at.stop) for o in series if o.channel == s.channel])
        for i in np.flatnonzero(off[s.at]) + s.at.start:
            if abs(values[i] - predicted[i]) > change[i] or _alone(i, s.at, change, values - predicted):
                continue
            alike = own[change[own] >= ALIKE * change[i]]
            if np.count_nonzero(~off[alike]) < TIMES_MORE * np.count_nonzero(off[alike]):
                return True
    return False


def _alone(i: int, at: slice, change: Array, left: Array) -> bool:
    """Return True if readings next to i, where the prediction changes as fast, are right: i is not late.

    at: the series; change (N,), left (N,): the prediction's change from sample to sample, and the residual.
    """
    beside = [
        j for j in (i - 2, i - 1, i + 1, i + 2) if at.start <= j < at.stop and change[j] > 0.5 * change[i]
    ]
    late = np.abs(left[i]) * change[beside] / max(change[i], 1e-300)
    return len(beside) > 1 and bool(np.all(np.abs(left[beside]) < 0.5 * late))
