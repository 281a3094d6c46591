"""Tests in time: repetition, frequency, jumps, breaks, swings, outliers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import combinations, pairwise
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ..noise import cycle_s, harmonics
from ..record import Record, Series, repeats
from ..ringing import modes, ringing
from ..spanned import basis, unit
from .dependence import Dependence, by_deviate, by_gain, by_products, jointly, least
from .left import NEAR, Left

BANDS = 16
# Moments of a record at which its response may have changed.
EIGHTHS = 8
# Periods of the slowest ringing sought in the longest record: slower motion is no vibration.
PERIODS = 10.0
# Change from sample to sample, in steps of a display, below which what is read stays.
STILL = 0.1


def phase_of_cycle(left: Left) -> list[Dependence]:
    """Test for structure that repeats in every cycle: its harmonics, by channel and experiment."""
    singles, members = [], []
    bases: dict[Any, Array | None] = {}
    for s in left.clocked:
        key = s.experiment, s.group, s.clock
        if key not in bases:
            waves = harmonics(left.record, s)
            bases[key] = None if waves is None else basis(left.fitter.whitening.series(s, waves), NEAR)
        b = bases[key]
        if b is not None:
            gain = float(np.sum((b.T @ left.residual[s.at]) ** 2))
            where = f"{left.record.experiments[s.experiment].name}, {s.channel}"
            singles.append(by_gain("phase_of_cycle", gain, b.shape[1], left.spare[s.group], where))
            members.append(s)
    found = jointly("phase_of_cycle", singles, left.saved(members), "")
    best = min(reversed(singles), key=lambda d: d.p_value, default=None)
    # Where it is strongest is told in either case.
    return [attrs.evolve(best, p_value=d.p_value) for d in found if best]


def cycles_alike(left: Left) -> list[Dependence]:
    """Test whether the whitened residuals of successive cycles correlate."""
    products = []
    for s in left.clocked:
        driven = left.record.driven(s.experiment, "pressure_kPa")
        period = cycle_s(left.record.experiments[s.experiment]) if driven else None
        lag = round(period / (s.sample_s * float(np.median(s.count)))) if period else 0
        x = left.residual[s.at]
        if 4 < lag < len(x):
            products.append(x[lag:] * x[:-lag])
    return by_products("phase_of_cycle", products, "all cyclic records")


def repeats_alike(left: Left) -> list[Dependence]:
    """Test whether repeats of a protocol leave the same residual; their difference is noise."""
    pairs = [(s.at, o.at) for s, o in combinations(left.clocked, 2) if repeats(left.record, s, o)]
    both = [(left.residual[a], left.residual[b]) for a, b in pairs]
    return by_products("repeat", [a[: len(b)] * b[: len(a)] for a, b in both], "all repeats")


def by_frequency(left: Left) -> list[Dependence]:
    """Power of the whitened residual by bands of frequency, series of a group and of one clock together.

    The rounding error of readings in steps is a sawtooth, a tone, where the quantity rises steadily. Where it
    stays between two steps readings alternate by a whole one. Both are expected in a band in addition to the
    noise.
    """
    bands: dict[tuple[str, float], list[tuple[Array, Array, Array]]] = {}
    for s in left.clocked:
        x = left.residual[s.at]
        if len(x) < 32:
            continue
        f = np.fft.rfftfreq(len(x))[1:-1] / (s.sample_s * float(np.median(s.count)))
        saw, flips = _rounding(left, s)
        white = left.fitter.sources[s.group].white
        rounded = _power(left.fitter.whitening.series(s, saw)) + flips / white**2
        bands.setdefault((s.group, s.sample_s), []).append((f, _power(x), rounded))
    tests: list[Dependence] = []
    for (group, _), members in bands.items():
        f, power, rounded = (np.concatenate(column) for column in zip(*members, strict=True))
        edges = np.quantile(f, np.linspace(0.0, 1.0, BANDS + 1))
        for low, high in pairwise(edges):
            inside = (f >= low) & (f <= high)
            # Twice a periodogram's ordinate is chi squared of two degrees.
            value, dof = 2.0 * float(power[inside].sum()), 2 * int(inside.sum())
            if dof:
                value /= 1.0 + 2.0 * float(rounded[inside].sum()) / dof
                where = f"{group}, {low:.3g} to {high:.3g} Hz"
                tests.append(by_gain("frequency", value, dof, 0.0, where))
    return least(sorted(tests, key=lambda d: d.where))


def _power(x: Array) -> Array:
    """The periodogram of a whitened series (b,), its ends left out."""
    return np.asarray(np.abs(np.fft.rfft(x - x.mean())[1:-1]) ** 2 / len(x))


def _rounding(left: Left, series: Series) -> tuple[Array, float]:
    """Rounding error to a channel's steps in a fit's prediction of a series (b,), in its unit.

    Also the variance of readings that alternate between two steps, over all of the series.
    """
    if not series.step:
        return np.zeros(series.at.stop - series.at.start), 0.0
    e = left.record.experiments[series.experiment]
    read = e[series.channel]
    predicted = left.fitter.simulator.predict(e, left.fit.values)[series.row]
    exact = predicted - read[np.isfinite(read)][0]
    still = float(np.mean(np.abs(np.diff(exact)) < STILL * series.step))
    saw = series.step * np.round(exact / series.step) - exact
    return series.mean(saw), still * (0.5 * series.step) ** 2


def jumped(left: Left) -> list[Dependence]:
    """Test whether a channel jumped once, in an experiment or between two: every position is tried."""
    best, tried = (0.0, ""), 0
    known: dict[Any, Array] = {}
    for s in left.clocked:
        b = s.at.stop - s.at.start
        if b < 16:
            continue
        key = (s.group, b, s.sample_s, s.count[0])
        if key not in known:
            jump = np.tril(np.ones((b, b)))[:, 4:-4]
            known[key] = unit(left.fitter.whitening.series(s, jump - jump.mean(axis=0)))
        z = np.abs(known[key].T @ left.residual[s.at])
        tried += len(z)
        at = int(np.argmax(z))
        if z[at] > best[0]:
            best = float(z[at]), left.place(s, at + 4)
    # Jumps at neighbouring places are nearly the same test, yet no fewer than a third are independent.
    both = [(*best, tried), *([_moved(left)] if len(left.record.experiments) > 1 else [])]
    found = [by_deviate("jump", z, where, 2.0 * len(both) * many) for z, where, many in both if many]
    return sorted(found, key=lambda d: d.p_value)[:1]


def _moved(left: Left) -> tuple[float, str, int]:
    """The clearest jump between two experiments, in standard deviations, as text, and the number tried.

    Of channels whose one zero is fitted for all experiments: a reglued marker or a moved camera has another
    one from then on.
    """
    places: list[tuple[str, int]] = []
    columns: list[Array] = []
    for channel in dict.fromkeys(s.channel for s in left.clocked):
        own = [s for s in left.clocked if s.channel == channel]
        zero, *jumps = (_from(left.record, own, first) for first in sorted({s.experiment for s in own}))
        whole = np.linalg.norm(left.fitter.whitened(zero))
        if np.linalg.norm(left.fitter.project(zero)) <= 1e-6 * whole:
            places += [(channel, first) for first in sorted({s.experiment for s in own})[1:]]
            columns += jumps
    if not columns:
        return 0.0, "", 0
    z = np.abs(left.deviates(np.stack(columns, axis=1)))
    at = int(np.argmax(z))
    channel, first = places[at]
    where = f"{channel}, from {left.record.experiments[first].name} on"
    return float(z[at]), where if z[at] else "", int(np.count_nonzero(z))


def _from(record: Record, series: Iterable[Series], first: int) -> Array:
    """A column (N,) that is 1 in these series from an experiment on, and 0 elsewhere."""
    column = np.zeros(len(record))
    for s in series:
        column[s.at] = s.experiment >= first
    return column


def changed(left: Left) -> list[Dependence]:
    """Test whether the response changed at some moment: every eighth of every experiment is tried.

    Each channel has a separate size, and its zero and the fitted parameters are free in each.
    """
    record, of, time = left.record, left.record.of_experiment, np.full(len(left.record), math.nan)
    for s in left.clocked:
        time[s.at] = s.time_s
    clocks = {i: e["time_s"] for i, e in enumerate(record.experiments) if "time_s" in e.columns}
    moments = [(i, k) for i in clocks for k in range(EIGHTHS)][1:]
    if not moments:
        return []
    nothing = np.zeros(2)
    ends = np.array([clocks.get(i, nothing)[[0, -1]] for i in range(len(record.experiments))])
    begins, lasts = ends[of, :1], np.diff(ends)[of]
    since = time[:, None] >= begins + np.arange(EIGHTHS) / EIGHTHS * lasts
    white = left.fitter.whitening(left.response[:, None] * since)
    # In later experiments the whole response has changed.
    test, eighth = np.array(moments).T
    later = np.where(of[:, None] > test, white[:, :1], np.where(of[:, None] == test, white[:, eighth], 0.0))
    level, gains = left.fitter.whitening(np.ones(len(record))), np.zeros(len(moments))
    for rows in left.channels.values():
        q = basis(np.column_stack([level[rows], left.fit.jacobian[rows]]), NEAR)
        before = np.sum(later[rows] ** 2, axis=0)
        own = later[rows] - q @ (q.T @ later[rows])
        square = np.sum(own**2, axis=0)
        resolved = square > 1e-6 * np.maximum(before, 1e-300)
        along = own.T @ left.residual[rows]
        gains += np.where(resolved, along**2 / np.where(resolved, square, 1.0), 0.0)
    best = int(np.argmax(gains))
    i, k = moments[best]
    moment = clocks[i][0] + k / EIGHTHS * (clocks[i][-1] - clocks[i][0])
    where, saved = f"{record.experiments[i].name}, {moment:.4g} s", left.saved(left.clocked)
    return [by_gain("break", float(gains[best]), len(left.channels), saved, where, len(moments))]


def swinging(left: Left) -> list[Dependence]:
    """Test whether a unit under pressure swings after each change of it: one size for all channels.

    The residual is tested along the motion of a mass that the fitted model drives, by the largest of many
    modes.
    """
    record = left.record
    driven = [s for s in left.clocked if record.driven(s.experiment, "pressure_kPa") and len(s.time_s) > 16]
    if not driven:
        return []
    lasts = [float(s.time_s[-1] - s.time_s[0]) for s in driven]
    # A mode somewhat faster than half the clock is seen, at another frequency.
    fastest = max(0.75 * (len(s.time_s) - 1) / last for s, last in zip(driven, lasts, strict=True))
    hertz, damping = modes(PERIODS / max(lasts), fastest)
    if not len(hertz):
        return []
    still = left.fitter.predict(left.fit.values)
    swings = np.zeros((len(record), len(hertz)))
    clocks: dict[Any, list[Series]] = {}
    for s in driven:
        clocks.setdefault((s.experiment, s.clock), []).append(s)
    for members in clocks.values():
        together = np.stack([still[s.at] for s in members], axis=1)
        found = ringing(members[0].time_s, together, hertz, damping)
        for k, s in enumerate(members):
            swings[s.at] = found[:, k]
    gains = left.deviates(swings) ** 2
    best = int(np.argmax(gains))
    where = f"{hertz[best]:.3g} Hz, after changes of pressure"
    return [by_gain("ringing", float(gains[best]), 1, left.saved(driven), where, len(hertz))]


def outliers(left: Left) -> list[Dependence]:
    """Test the largest residual of all readings outside bursts."""
    best, tried = (0.0, ""), 0
    for s in left.clocked:
        z = np.abs(left.residual[s.at])
        # In a burst the size of errors is unknown.
        z = z if s.louder is None else np.where(s.louder > 1.0, 0.0, z)
        tried += len(z)
        if z.max() > best[0]:
            best = float(z.max()), left.place(s, int(np.argmax(z)))
    return [by_deviate("outlier", *best, 2.0 * tried)] if tried else []
