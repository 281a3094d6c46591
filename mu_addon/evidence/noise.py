"""Noise of instruments: white and slow (a first-order process), its estimate, and whitening by it."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..measured import Experiment
from .readings import STAYS
from .record import KNOWN, Record, Series


@attrs.frozen
class Source:
    """Noise of a group of series, in the unit of its channel: a white part and a slow part.

    white: standard deviation of one sample's independent noise. slow: standard deviation of an
    Ornstein-Uhlenbeck process with correlation time time_s in s: an AR(1) series of rho = exp(-dt/time_s)
    when sampled.
    """

    white: float
    slow: float
    time_s: float


class Whitening:
    """Linear map from the series of a record to series of independent noise of unit variance.

    sources: noise by group; groups: those to whiten, all by default. Block means of white plus first-order
    noise have, after an AR(1) difference within each clock, a tridiagonal covariance, which is factored by
    its band. log_dets: logarithm of the covariance's determinant, by group. Values of known spread are
    already in units of it and stay unchanged.
    """

    def __init__(self, record: Record, sources: Mapping[str, Source], groups: Sequence[str] = ()) -> None:
        self.log_dets: dict[str, float] = {}
        self._sources = dict(sources)
        self._parts: list[tuple[slice, Any]] = []
        self._single: dict[Any, _Factor] = {}
        for group in groups or record.groups:
            if group == KNOWN:
                continue
            members = [s for s in record.series if s.group == group]
            factor = _Clocks(members).factor(sources[group])
            self._parts.append((slice(members[0].at.start, members[-1].at.stop), factor))
            self.log_dets[group] = factor.log_det

    def __call__(self, columns: Array) -> Array:
        """Whitened columns (N,) or (N, k); rows of groups that are not whitened stay."""
        found = np.array(columns, float, order="F")
        for rows, factor in self._parts:
            found[rows] = factor.applied(found[rows])
        return found

    def series(self, series: Series, columns: Array) -> Array:
        """Columns (b,) or (b, k) of one series, whitened; unchanged for a series of known spread."""
        if series.group == KNOWN:
            return columns
        key = series.group, series.clock
        if key not in self._single:
            self._single[key] = _Clocks([series]).factor(self._sources[series.group])
        return self._single[key].applied(columns)


@attrs.frozen(eq=False)
class _Factor:
    """Whitens rows (n, k): scales each, less the part carried over from the one before, solved by the band.

    inverse (n,), carried (n - 1,): of the scale, and of the part carried over. band (2, n): the covariance's
    factor with ones on its diagonal, whose inverse is diagonal (n,).
    """

    inverse: Array
    carried: Array
    band: Array
    diagonal: Array
    log_det: float

    def applied(self, x: Array) -> Array:
        """Whitened rows of x (n,) or (n, k)."""
        from scipy.linalg.lapack import dtbtrs

        # Columns are contiguous in memory, for LAPACK and for the loops before it.
        columns = np.ascontiguousarray(x.T).reshape(-1, len(x))
        y: Array = columns * self.inverse
        y[:, 1:] -= self.carried * columns[:, :-1]
        solved, _ = dtbtrs(self.band, y.T, uplo="L", diag="U", overwrite_b=1)
        y = solved.T
        y *= self.diagonal
        return np.asarray(y.T if x.ndim == 2 else y[0])


# Share of white noise treated as slow: the factor needs some, and so little has no effect.
LEAST_SLOW = 1e-4


class _Clocks:
    """Covariance of several series one after the other, factored once for all that share a clock."""

    def __init__(self, members: Sequence[Series]) -> None:
        first: dict[Any, Series] = {}
        for s in members:
            first.setdefault(s.clock, s)
        lengths = [len(s.time_s) for s in first.values()]
        begins = dict(zip(first, np.cumsum([0, *lengths[:-1]]).tolist(), strict=True))
        rows = [begins[s.clock] + np.arange(len(s.time_s)) for s in members]
        # Where no two share a clock every row is its own.
        self._rows = np.concatenate(rows) if len(members) > len(first) else None
        self._many = [sum(s.clock == clock for s in members) for clock in first]
        self._ends = np.cumsum(lengths)
        self._timed = np.repeat([not math.isnan(s.sample_s) for s in first.values()], lengths)
        self._step = np.repeat([s.sample_s for s in first.values()], lengths)
        self._count = np.concatenate([s.count for s in first.values()])
        # A burst of noise equals an average of fewer samples.
        louder = [s.count if s.louder is None else s.count / s.louder**2 for s in first.values()]
        self._averaged = np.concatenate(louder)
        # Nothing carries over into the first of a series, nor between values without a clock.
        apart = [np.diff(s.time_s, prepend=-math.inf) for s in first.values()]
        self._apart = np.where(self._timed, np.concatenate(apart), math.inf)

    def factor(self, source: Source) -> _Factor:
        """The factor under one source, for rows of all series."""
        from scipy.linalg.lapack import dpbtrf

        phi = np.exp(-self._apart / source.time_s)
        kept, first = _block(self._count, self._step / source.time_s)
        slow = max(source.slow, LEAST_SLOW * source.white)
        # Noise that does not last from block to block is white; the rest keeps some variance.
        variance = np.maximum(slow**2 * kept, 1e-12 * source.white**2 / self._averaged)
        # Without a clock each value stands alone.
        c = np.where(self._timed, variance, source.white**2)
        v = np.where(self._timed, source.white**2 / self._averaged + slow**2 * first - variance, 0.0)
        u = v / c
        before = np.concatenate([[0.0], u[:-1]])
        band = np.zeros((2, len(c)))
        band[0] = 1.0 - phi**2 + u + phi**2 * before
        band[1, :-1] = -(phi * before)[1:]
        factor, failed = dpbtrf(band, lower=1)
        if failed:
            band[0] *= 1.0 + 1e-9
            factor, _ = dpbtrf(band, lower=1)
        logs = np.add.reduceat(np.log(c) + 2.0 * np.log(factor[0]), np.concatenate([[0], self._ends[:-1]]))
        inverse, diagonal = 1.0 / np.sqrt(c), 1.0 / factor[0]
        below = np.zeros(len(c))
        below[:-1] = factor[1, :-1] * diagonal[:-1]
        carried = np.concatenate([[0.0], phi[1:] * inverse[:-1]])
        if self._rows is not None:
            # The last row of a clock has none below it: any series may follow it.
            below[self._ends - 1] = 0.0
            inverse, carried, below, diagonal = (v[self._rows] for v in (inverse, carried, below, diagonal))
        whole = np.stack([np.ones(len(below)), below])
        return _Factor(inverse, carried[1:], whole, diagonal, float(logs @ self._many))


def _block(count: Array, step: Array) -> tuple[Array, Array]:
    """Covariance of two blocks' means over exp(-distance), and variance of one's, for unit slow noise."""
    if (count == 1).all():
        return np.ones(len(count)), np.ones(len(count))
    a = np.maximum(step, 1e-9)
    kept = (np.sinh(count * a / 2.0) / (count * np.sinh(a / 2.0))) ** 2
    r = np.exp(-a)
    # Sum over pairs of samples of r^|i - j|.
    total = count + 2.0 * (r * count / (1.0 - r) - r * (1.0 - r**count) / (1.0 - r) ** 2)
    return kept, total / count**2


def estimate(record: Record, residual: Array, columns: Sequence[Array]) -> dict[str, Source]:
    """White and slow noise of each group of series, by restricted maximum likelihood.

    residual (N,): of the base model, in the record's units. columns: for each series an array (b, k), each
    column with a free size in that series. Their span does not count as noise, so that an effect neither
    increases the noise nor is whitened away. The restricted likelihood accounts for these degrees of freedom.
    Groups of known spread are left out.
    """
    found = {}
    for group in record.groups:
        if group == KNOWN:
            continue
        members = [i for i, s in enumerate(record.series) if s.group == group]
        found[group] = _rounded(
            _estimate(record, group, members, residual, columns), [record.series[i] for i in members]
        )
    return found


def _rounded(source: Source, series: Sequence[Series]) -> Source:
    """A source no smaller than the rounding of readings to a gauge's steps.

    Rounding errors are uniform within half a step. Where readings stay for several samples the error does
    too: it is slow noise, with the mean length of such runs as its time.
    """
    white = max(source.white, *(s.step / math.sqrt(12.0) for s in series))
    staying = [s for s in series if s.stays > STAYS and not math.isnan(s.sample_s)]
    slow = max((s.step / math.sqrt(12.0) for s in staying), default=0.0)
    if slow <= source.slow:
        return attrs.evolve(source, white=white)
    time_s = max(min(s.stays, 0.5 * float(s.count.sum())) * s.sample_s for s in staying)
    return Source(white, slow, time_s)


# Series that suffice for three numbers; the search begins with fewer.
SERIES = 24
FIRST_SERIES = 8


def _estimate(
    record: Record, group: str, members: Sequence[int], residual: Array, columns: Sequence[Array]
) -> Source:
    series = [record.series[i] for i in members]
    square, dof = 0.0, 0
    for i, s in zip(members, series, strict=True):
        q = np.linalg.qr(columns[i])[0]
        r = residual[s.at] - q @ (q.T @ residual[s.at])
        square += float(r @ r)
        dof += max(len(r) - columns[i].shape[1], 0)
    total = math.sqrt(square / max(dof, 1)) or 1e-9
    timed = [s for s in series if not math.isnan(s.sample_s)]
    if not timed:
        pure = _pure_error(record, series, residual)
        return Source(total if pure is None else pure, 0.0, 1.0)
    if dof < 12:
        return Source(total, 0.0, 1.0)
    sample = float(np.median([s.sample_s for s in timed]))
    block = float(np.median([np.median(s.count) for s in timed]))
    longest = max(float(s.time_s[-1] - s.time_s[0]) for s in timed)
    short, every = (_some(members, most) for most in (FIRST_SERIES, SERIES))
    deviance = _deviance(record, group, short, residual, columns, (sample, longest))
    best = None
    for time in (3.0 * sample * block, 15.0 * sample * block):
        found = _minimum(lambda x: deviance(x)[0], np.array([-0.5 * math.log(block), math.log(time)]), 0.7)
        if best is None or found.fun < best.fun:
            best = found
    assert best is not None
    if len(every) > len(short):
        deviance = _deviance(record, group, every, residual, columns, (sample, longest))
        best = _minimum(lambda x: deviance(x)[0], best.x, 0.15)
    return _source(best.x, sample, longest, deviance(best.x)[1])


def _pure_error(record: Record, series: Sequence[Series], residual: Array) -> float | None:
    """Standard deviation of rows whose drives repeat to the digit; None without two such.

    Few repeats estimate it badly, so the bound is taken that four in five such estimates keep below.
    """
    from scipy.stats import chi2

    alike: dict[Any, list[float]] = {}
    for s in series:
        e = record.experiments[s.experiment]
        drives = [e.columns[c] for c in sorted(e.columns) if record.driven(s.experiment, c)]
        place = (s.channel, e.scale, e.orientation_deg, e.axis, e.mode, e.section_mm, e.length_mm, e.cells)
        for block, value in enumerate(residual[s.at]):
            row = s.samples(block)
            if row.stop - row.start == 1:
                alike.setdefault((place, *(float(d[row.start]) for d in drives)), []).append(float(value))
    repeats = [np.array(v) for v in alike.values() if len(v) > 1]
    dof = sum(len(v) - 1 for v in repeats)
    if dof < 2:
        return None
    square = sum(float(np.sum((v - v.mean()) ** 2)) for v in repeats)
    return math.sqrt(square / float(chi2.ppf(0.2, dof))) or None


def _some(members: Sequence[int], most: int) -> list[int]:
    """Return at most so many members, spaced evenly from the first to the last."""
    chosen = np.unique(np.round(np.linspace(0, len(members) - 1, most)).astype(int))
    return [members[i] for i in chosen]


def _minimum(deviance: Callable[[Array], float], x0: Array, size: float) -> Any:
    from scipy.optimize import minimize

    simplex = x0 + size * np.vstack([np.zeros(len(x0)), np.eye(len(x0))])
    options = {"initial_simplex": simplex, "xatol": 0.02, "fatol": 0.05, "maxfev": 120}
    return minimize(deviance, x0, method="Nelder-Mead", options=options)


def _deviance(
    record: Record,
    group: str,
    members: Sequence[int],
    residual: Array,
    columns: Sequence[Array],
    clock: tuple[float, float],
) -> Callable[[Array], tuple[float, float]]:
    """Restricted deviance, for some members of a group, and the size of the noise at which it is least.

    By the logarithms of slow over white noise and of time_s; the size of both together has a closed form.
    """
    k = max(columns[i].shape[1] for i in members)
    places, series, start = [], [], 0
    for i in members:
        s = record.series[i]
        b = s.at.stop - s.at.start
        places.append((slice(start, start + b), columns[i].shape[1]))
        series.append(s)
        start += b
    stack = np.zeros((start, k + 1), order="F")
    for i, (at, many) in zip(members, places, strict=True):
        stack[at, :many] = columns[i]
        stack[at, k] = residual[record.series[i].at]

    dof = max(start - sum(many for _, many in places), 1)
    clocks = _Clocks(series)
    # Missing columns of a series are zero; a one on the diagonal removes them from the solution.
    lacking = np.stack([np.diag(np.arange(k) >= many).astype(float) for _, many in places])

    def deviance(x: Array) -> tuple[float, float]:
        factor = clocks.factor(_source(x, *clock))
        w = factor.applied(stack)
        grams = np.stack([w[at].T @ w[at] for at, _ in places])
        gram, onto = grams[:, :k, :k], grams[:, :k, k:]
        small = 1e-12 * np.trace(gram, axis1=1, axis2=2)
        lower = np.linalg.cholesky(gram + small[:, None, None] * np.eye(k) + lacking)
        half = np.linalg.solve(lower, onto)
        value = factor.log_det + 2.0 * float(np.log(np.diagonal(lower, axis1=1, axis2=2)).sum())
        square = float(grams[:, k, k].sum() - np.sum(half**2))
        size = math.sqrt(max(square, 1e-300) / dof)
        return value + 2.0 * dof * math.log(size), size

    return deviance


def _source(x: Array, sample_s: float, longest_s: float, size: float = 1.0) -> Source:
    """White noise of `size`, times slow over white, and time_s, by the logarithms of the last two."""
    low, high = math.log(0.5 * sample_s), math.log(max(longest_s, 4.0 * sample_s))
    return Source(size, size * math.exp(min(max(x[0], -12.0), 12.0)), math.exp(min(max(x[1], low), high)))


def span(record: Record, signatures: Array) -> list[Array]:
    """Orthonormal columns (b, k) for each series that span the smooth changes by causes, known or not.

    signatures (N, m): changes of the prediction by effects and nuisances. The columns also include a
    constant, a linear drift of timed series, and the harmonics of a repeated cycle. Directions with less than
    a hundredth of a signature's size are left out. At most a fifth of a timed series (half of one without a
    clock) is spent.
    """
    found = []
    for s in record.series:
        b = s.at.stop - s.at.start
        here = signatures[s.at]
        constant = np.ones((b, 1)) / math.sqrt(b)
        parts = [_centred(here)]
        if not math.isnan(s.sample_s):
            drift = np.linspace(-1.0, 1.0, b)[:, None]
            parts.append(_centred(drift))
        cycle = harmonics(record, s)
        if cycle is not None:
            parts.append(_centred(cycle))
        every = np.hstack(parts)
        # By the products of columns, fewer than rows: with far more digits than needed.
        squares, vectors = np.linalg.eigh(every.T @ every)
        most = max(b // 5 - 1, 0) if not math.isnan(s.sample_s) else max(b // 2 - 1, 0)
        many = min(int((squares > 1e-4).sum()), most)
        first = np.argsort(-squares)[:many]
        found.append(np.hstack([constant, every @ (vectors[:, first] / np.sqrt(squares[first]))]))
    return found


def _centred(columns: Array) -> Array:
    """Columns without their mean, of unit length; those that were constant are dropped."""
    c = columns - columns.mean(axis=0)
    size = np.linalg.norm(c, axis=0)
    kept = size > 1e-9 * (np.linalg.norm(columns, axis=0) + 1e-300)
    return np.asarray(c[:, kept] / size[kept])


def harmonics(record: Record, s: Series, orders: int = 12) -> Array | None:
    """Sines and cosines (b, 2 k) of the pressure cycle that a series' experiment repeats, of amplitude 1.

    k is at most `orders`, and less where samples are too far apart. None where no cycle is repeated, pressure
    is not the drive or there is no clock.
    """
    e = record.experiments[s.experiment]
    if math.isnan(s.sample_s) or not record.driven(s.experiment, "pressure_kPa"):
        return None
    period = cycle_s(e)
    if period is None:
        return None
    most = min(orders, int(period / (4.0 * s.sample_s * np.median(s.count))))
    phase = 2.0 * math.pi * s.time_s[:, None] / period * np.arange(1, most + 1)
    return np.hstack([np.sin(phase), np.cos(phase)]) if most else None


@functools.lru_cache(maxsize=256)
def cycle_s(e: Experiment) -> float | None:
    """Period in s of an experiment's pressure cycle (see `repeated`), or None."""
    return repeated(e["time_s"], e["pressure_kPa"])


def repeated(time_s: Array, signal: Array) -> float | None:
    """Period in s that a signal (n,) repeats at least twice, or None.

    By the first return of its normalised autocorrelation to above 0.75, after it fell below 0.2. time_s (n,):
    ascending; the signal is resampled evenly in time, its unit does not matter.
    """
    n = len(signal)
    x = np.interp(np.linspace(time_s[0], time_s[-1], n), time_s, signal)
    x = x - x.mean()
    if n < 16 or not x.any():
        return None
    power = np.abs(np.fft.rfft(x, 2 * n)) ** 2
    # Of overlapping parts, so that whole cycles correlate fully.
    together = np.fft.irfft(power)[: n // 2 + 1] / (n - np.arange(n // 2 + 1)) * n
    together = together / together[0]
    low = int(np.argmax(together < 0.2)) if (together < 0.2).any() else n
    if low >= len(together) - 2:
        return None
    back = np.flatnonzero(together[low:] > 0.75)
    if not len(back):
        return None
    # The first return, not a later one that happens to be a little closer.
    begin = low + int(back[0])
    ends = np.flatnonzero(together[begin:] <= 0.75)
    if not len(ends):
        return None
    peak = begin + int(np.argmax(together[begin : begin + int(ends[0])]))
    return float(peak * (time_s[-1] - time_s[0]) / (n - 1))
