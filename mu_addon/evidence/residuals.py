"""Tests of a model's residual against everything it should not depend on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from itertools import combinations, pairwise
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Chambers
from ..errors import InputError
from ..measured import Experiment
from ..measured.pose import at_rest
from .fit import Fit, Fitter
from .lags import DEADBAND_kPa, cycles, play_operator
from .noise import cycle_s, harmonics
from .prediction.unit_pressure import KIND as UNIT
from .record import KNOWN, Record, Series, repeats
from .ringing import modes, ringing
from .spanned import basis, unit

# Share of clean data sets in which any structure may be reported.
FALSE_ALARM = 0.003
BANDS = 16
# The pitch of chambers at 1.0x.
PITCH_MM = Chambers().cell_mm
ANGLE, TURN = "angle_deg", "orientation_deg"
BY_TURN = "turn"
"""Test against the angle that a unit is turned by within a record."""
ALTERNATION = "alternation"
"""Test of readings without a clock for signs that change from each to the next."""
# Fewer readings alternate by the fit alone.
FEWEST_IN_A_ROW = 20
# Of a turn, in which a residual is sought, cut off at so many of its standard deviations (by the median).
HARMONICS, CUT = 4, 3.0
# Digits of a whitened residual that count in its rank.
RANKED = 6
# Directions of a test's columns, each of unit length, that hold less than this are none.
NEAR = 0.03
# A column of which less than this share remains after projection has no information.
ABSORBED = 1e-3
# Moments of a record at which its response may have changed.
EIGHTHS = 8
# Periods of the slowest ringing sought in the longest record: slower motion is no vibration.
PERIODS = 10.0


@attrs.frozen
class Dependence:
    """One test of a whitened residual against a quantity that it must not depend on.

    statistic: a chi squared with `dof` degrees of freedom, or a standard normal deviate. p_value: of that
    test alone, for noise that is white after whitening. where: text on where the dependence is strongest.
    """

    against: str
    statistic: float
    p_value: float
    where: str = ""
    dof: int = 1


def _by_gain(against: str, gain: float, dof: int, spare: float, where: str, tried: float = 1.0) -> Dependence:
    """Test by a gain in chi squared, less what the noise spares; the best of so many that were tried."""
    from scipy.stats import chi2

    return Dependence(against, gain, min(1.0, tried * float(chi2.sf(gain - spare, dof))), where, dof)


def _by_deviate(against: str, z: float, where: str, tried: float = 1.0) -> Dependence:
    """Test by a normal deviate, for more than 0; the largest of so many that were tried."""
    from scipy.stats import norm

    return Dependence(against, z, min(1.0, tried * float(norm.sf(z))), where)


def _by_products(against: str, products: Sequence[Array], where: str) -> list[Dependence]:
    """Test whether two lists of deviates correlate, by their products (n,) in parts; nothing without any."""
    count = sum(map(len, products))
    return (
        [_by_deviate(against, sum(float(p.sum()) for p in products) / math.sqrt(count), where)]
        if count
        else []
    )


def _likelier(together: Dependence, single: Dependence) -> Dependence:
    """The likelier of two tests of one thing, each at half of the false-alarm rate."""
    found = together if together.p_value < single.p_value else single
    return attrs.evolve(found, p_value=min(1.0, 2.0 * found.p_value))


def _rate(e: Experiment) -> Array:
    p = e["pressure_kPa"]
    return np.gradient(p, e["time_s"])


def _direction(e: Experiment) -> Array:
    return np.sign(np.gradient(play_operator(e["pressure_kPa"], DEADBAND_kPa)))


def _most(e: Experiment) -> Array:
    return np.maximum.accumulate(np.abs(np.nan_to_num(e["angle_deg"])))


# Quantities of a sample that the residual must not depend on, by the columns they need.
COVARIATES = (
    ("pressure", ("pressure_kPa",), lambda e: e["pressure_kPa"]),
    ("pressure_rate", ("pressure_kPa", "time_s"), _rate),
    ("loading_direction", ("pressure_kPa", "time_s"), _direction),
    ("largest_angle", ("angle_deg", "time_s"), _most),
    ("strain", ("strain",), lambda e: e["strain"]),
    ("added_mass", ("added_mass_g",), lambda e: e["added_mass_g"]),
    ("time", ("time_s",), lambda e: e["time_s"] - e["time_s"][0]),
    ("cycle", ("pressure_kPa", "time_s"), lambda e: cycles(e["pressure_kPa"])),
)
# Quantities of a whole experiment.
CONDITIONS = (
    ("orientation", lambda e, i: e.orientation_deg),
    ("scale", lambda e, i: e.scale),
    ("temperature", lambda e, i: e.temperature_C if math.isfinite(e.temperature_C) else 23.0),
    ("run_order", lambda e, i: float(i)),
)


@attrs.frozen(eq=False)
class _Left:
    """What a fit leaves of a record of N values: its whitened residual, beside all that it has fitted.

    spare: what the noise may spare of a gain in chi squared, by group of series.
    """

    fitter: Fitter
    fit: Fit
    spare: Mapping[str, float]

    @property
    def record(self) -> Record:
        """The record."""
        return self.fitter.record

    @property
    def residual(self) -> Array:
        """Whitened residual (N,)."""
        return self.fit.residual

    @cached_property
    def clocked(self) -> list[Series]:
        """Series with a clock, of unknown spread."""
        return [s for s in self.record.series if s.group != KNOWN and not math.isnan(s.sample_s)]

    @cached_property
    def fitted(self) -> Array:
        """Orthonormal columns (N, k) that span what is fitted, zeros among it."""
        return np.hstack([self.fitter.zeros_basis, basis(self.fit.jacobian, NEAR)])

    @cached_property
    def response(self) -> Array:
        """See `Fitter.response`."""
        return self.fitter.response(self.fit.values)

    @cached_property
    def channels(self) -> dict[str, Array]:
        """Rows of each channel."""
        series = self.record.series
        names = dict.fromkeys(s.channel for s in series if s.group != KNOWN)
        return {
            c: np.concatenate([np.arange(s.at.start, s.at.stop) for s in series if s.channel == c])
            for c in names
        }

    def saved(self, series: Iterable[Series]) -> float:
        """What the noise may spare of a gain in these series."""
        return sum(self.spare[group] for group in dict.fromkeys(s.group for s in series))

    def place(self, s: Series, block: int) -> str:
        """Experiment, channel and time of a block of a series, as text."""
        return f"{self.record.experiments[s.experiment].name}, {s.channel}, {s.time_s[block]:.4g} s"

    def gained(self, white: Array, rows: Any = slice(None)) -> tuple[float, int]:
        """Chi squared that whitened columns (n, d) of some rows take beside what is fitted, and their rank.

        Near dependences are left out, as in `basis`; so is a column that is fitted but for rounding.
        """
        one, q = unit(white), self.fitted[rows]
        onto = q.T @ one
        gram = one.T @ one - onto.T @ onto
        along = one.T @ self.residual[rows] - onto.T @ (self.fitted.T @ self.residual)
        size = np.sqrt(np.maximum(np.diag(gram), 0.0))
        kept = size > 1e-6
        size = size[kept]
        squares, vectors = np.linalg.eigh(gram[np.ix_(kept, kept)] / np.outer(size, size))
        resolved = squares > NEAR**2
        parts = vectors.T @ (along[kept] / size)
        return float(np.sum(parts[resolved] ** 2 / squares[resolved])), int(resolved.sum())

    def deviates(self, columns: Array) -> Array:
        """Normal deviates (m,) of columns (N, m), each alone beside what is fitted; 0 if that has it."""
        white = self.fitter.whitened(columns)
        before = np.linalg.norm(white, axis=0)
        white -= self.fitted @ (self.fitted.T @ white)
        length = np.linalg.norm(white, axis=0)
        resolved = length > ABSORBED * np.maximum(before, 1e-300)
        return np.where(resolved, white.T @ self.residual / np.where(resolved, length, 1.0), 0.0)


def dependence_table(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """Every test of a fit's residual, in a fixed order, except for quantities that do not vary.

    The noise is the fitter's, estimated with every smooth cause set aside. A test therefore shows the model's
    misfit, and sometimes the slowest part of the noise, which such data hardly determine.
    """
    left = _Left(fitter, fit, dict.fromkeys(fitter.deviance(fit), 0.0))
    return [*_fitted_tests(left), *_plain_tests(left)]


def strict_table(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """The tests of `dependence_table` under two estimates of the noise; the larger p-value of each counts.

    A dependence must gain more likelihood than the noise does when it is estimated from the residual itself,
    as if that had no cause. Tests without a fit are repeated under that second noise.
    """
    own, refitted = fitter.under_its_own_noise(fit)
    before, after = fitter.deviance(fit), own.deviance(refitted)
    left = _Left(fitter, fit, {group: max(before[group] - after[group], 0.0) for group in before})
    both = zip(_plain_tests(left), _plain_tests(_Left(own, refitted, {})), strict=True)
    return [*_fitted_tests(left), *(max(pair, key=lambda d: d.p_value) for pair in both)]


def _fitted_tests(left: _Left) -> list[Dependence]:
    record, found = left.record, []
    known = [s for s in record.series if s.group == KNOWN]
    if known:
        square = sum(float(left.residual[s.at] @ left.residual[s.at]) for s in known)
        # A nuisance that no reading depends on, as a density without a mass, takes none.
        fitted = np.count_nonzero(left.fit.jacobian.any(axis=0))
        dof = max(sum(s.at.stop - s.at.start for s in known) - fitted, 1)
        found.append(_by_gain("spread", square, dof, 0.0, "all"))
    if len(known) == len(record.series):
        return found
    for name, needs, of in COVARIATES:
        held = {
            i: np.asarray(of(e), float)
            for i, e in enumerate(record.experiments)
            if all(c in e.columns for c in needs)
            and ("pressure_kPa" not in needs or record.driven(i, "pressure_kPa"))
        }
        found += _by_channel(left, name, _powers(record, held))
    found += _by_channel(left, "angle", _powers(record, _angles(left)))
    for name, condition in CONDITIONS:
        values = np.array([condition(e, i) for i, e in enumerate(record.experiments)], float)
        found += _by_channel(left, name, _by_condition(record, values, left.response))
    return [*found, *_chambers(left), *_phase(left), *_breaks(left), *_ringing(left)]


def _plain_tests(left: _Left) -> list[Dependence]:
    tests = (_by_turn, _steps, _spectrum, _cycles_alike, _repeats_alike, _alternating, _outliers)
    return [d for test in tests for d in test(left)]


def structure(table: Sequence[Dependence]) -> tuple[str, ...]:
    """Quantities that the residual depends on, strongest first, at a false-alarm rate of `FALSE_ALARM`.

    The rate is divided by the number of tests (Bonferroni).
    """
    level = FALSE_ALARM / max(len(table), 1)
    return tuple(d.against for d in sorted(table, key=lambda d: d.p_value) if d.p_value < level)


def taken_by_scales(fitter: Fitter, fit: Fit) -> float:
    """Chi squared that a scale factor of each experiment's response takes from a fit's residual."""
    of, response = fitter.record.of_experiment, _Left(fitter, fit, {}).response
    own = response[:, None] * (of[:, None] == np.arange(len(fitter.record.experiments)))
    return float(np.sum((basis(fitter.project(own), NEAR).T @ fit.residual) ** 2))


def _angles(left: _Left) -> dict[int, Array]:
    """Angle (n,) at each sample, by experiments that have one: as predicted, which has no noise.

    A measured angle has the noise of the residual that it would be compared with, but as a drive it has no
    noise.
    """
    row = {s.experiment: s.row for s in reversed(left.record.series) if s.channel == ANGLE}
    simulator, values = left.fitter.simulator, left.fit.values
    return {
        i: simulator.predict(e, values)[row[i]] if i in row else np.nan_to_num(e[ANGLE])
        for i, e in enumerate(left.record.experiments)
        if ANGLE in e.columns and "time_s" in e.columns
    }


def _powers(record: Record, values: Mapping[int, Array], degree: int = 4) -> Array | None:
    """Chebyshev powers (N, d) of a covariate's samples (n,) by experiment; None where it does not vary."""
    if not values:
        return None
    low, high = min(v.min() for v in values.values()), max(v.max() for v in values.values())
    if not high > low:
        return None
    few = len(np.unique(np.concatenate([np.unique(v)[:20] for v in values.values()])))
    degree = min(degree, few - 1)

    def powers(i: int) -> Array:
        if i not in values:
            return np.zeros((degree, len(record.experiments[i])))
        x = 2.0 * (values[i] - low) / (high - low) - 1.0
        return np.polynomial.chebyshev.chebvander(x, degree)[:, 1:].T

    return record.laid_out(powers)


def _by_turn(left: _Left) -> list[Dependence]:
    """Test against the angle that a unit is turned by within a record.

    Such readings have no clock, so their noise is estimated from the same residual. A share of the residual
    is tested (by the beta distribution), not its size over that noise. Misfits are cut off at `CUT` of their
    standard deviations, since they include outliers. Records are also compared (`_turned_alike`).
    """
    from scipy.stats import beta

    record, found = left.record, []
    for channel in left.channels:
        members = [s for s in record.series if s.channel == channel and _turned(record, s)]
        if not members:
            continue
        turned = np.radians(np.concatenate([s.mean(record.experiments[s.experiment][TURN]) for s in members]))
        misfit = _cut([left.residual[s.at] for s in members])
        free = len(misfit) - len(members) - len(left.fit.keys)
        apart = np.unique(np.round(turned % (2.0 * np.pi), 6))
        for order in range(1, min(HARMONICS, (len(apart) - 1) // 2) + 1):
            wave = np.stack([np.cos(order * turned), np.sin(order * turned)], axis=1)
            q = basis(wave - wave.mean(axis=0), NEAR)
            share = float(np.sum((q.T @ misfit) ** 2) / max(misfit @ misfit, 1e-300))
            dof = q.shape[1]
            p = float(beta.sf(min(share, 1.0), dof / 2, max(free - dof, 1) / 2))
            found.append(Dependence(BY_TURN, share, p, f"{channel}, {order} times a turn", dof))
    return _least([*_least(found), *_turned_alike(record, left.residual)])


def _least(tests: Sequence[Dependence]) -> list[Dependence]:
    """The likeliest of some tests, its p-value times their number; nothing without any."""
    return [
        attrs.evolve(d, p_value=min(1.0, len(tests) * d.p_value))
        for d in sorted(tests, key=lambda d: d.p_value)[:1]
    ]


def _turned(record: Record, s: Series) -> bool:
    """Return True if a series is read at rest while its unit is turned."""
    e = record.experiments[s.experiment]
    return TURN in e.columns and np.ptp(e[TURN]) > 0.0 and math.isnan(s.sample_s) and s.group != KNOWN


def _cut(misfits: Sequence[Array]) -> Array:
    """Misfits (n,) of records one after the other, about each one's median, cut off and of mean 0 in each."""
    about = [m - np.median(m) for m in misfits]
    most = CUT * 1.4826 * float(np.median(np.abs(np.concatenate(about)))) or math.inf
    cut = [np.clip(m, -most, most) for m in about]
    return np.concatenate([m - m.mean() for m in cut])


def _turned_alike(record: Record, r: Array) -> list[Dependence]:
    """Test whether records leave the same residual (N,) at the same orientations, by normal scores."""
    scores: list[dict[float, float]] = []
    for s in record.series:
        if _turned(record, s) and s.at.stop - s.at.start > 2:
            turned = np.round(s.mean(record.experiments[s.experiment][TURN]) % 360.0, 6).tolist()
            scores.append(dict(zip(turned, _scores(r[s.at]).tolist(), strict=True)))
    products = [np.array([a[o] * b[o] for o in a.keys() & b.keys()]) for a, b in combinations(scores, 2)]
    return _by_products(BY_TURN, products, "all records alike")


def _alternating(left: _Left) -> list[Dependence]:
    """Test whether a residual changes its sign from reading to reading, by normal scores.

    Without a clock the noise is the scatter from one to the next, so that such a misfit is as large as it.
    """
    alone = [s for s in left.record.series if math.isnan(s.sample_s) and s.group != KNOWN]
    parts = [left.residual[s.at] for s in alone if s.at.stop - s.at.start >= FEWEST_IN_A_ROW]
    products = [-z[1:] * z[:-1] for z in map(_scores, parts)]
    return _by_products(ALTERNATION, products, "readings without a clock")


def _scores(values: Array) -> Array:
    """Normal scores (n,) of values by their ranks, of unit standard deviation; zeros where all are one.

    van der Waerden 1952: an outlier is no larger than other readings, and readings that a display rounds to
    one number have one rank.
    """
    from scipy.stats import norm, rankdata

    z = norm.ppf(rankdata(np.round(values, RANKED)) / (len(values) + 1.0))
    return np.asarray(z / z.std()) if z.any() else z


def _by_condition(record: Record, values: Array, response: Array) -> Array | None:
    """The response (N,) to the modulus, stronger or weaker by a condition of whole experiments: (N, 2)."""
    if len(np.unique(values)) < 2:
        return None
    x = (values - values.mean()) / np.ptp(values)
    return np.asarray(response[:, None] * x[record.of_experiment][:, None] ** np.arange(1, 3))


def _chambers(left: _Left) -> list[Dependence]:
    """Test whether markers' response to the modulus depends on their chamber.

    A chamber that bends unlike the rest moves the markers beyond it, and none before it. `where` names the
    marker that deviates most, and its position at rest in chambers from the inlet.
    """
    record = left.record
    place = _marker_places(record)
    levels = np.unique(list(place.values()))
    if len(levels) < 2:
        return []
    members = [s for s in record.series if s.channel in place and s.group != KNOWN]
    chamber = np.full(len(record), -1)
    for s in members:
        chamber[s.at] = np.searchsorted(levels, place[s.channel])
    x = 2.0 * (levels[chamber] - levels[0]) / (levels[-1] - levels[0]) - 1.0
    response = np.where(chamber < 0, 0.0, left.response)[:, None]
    along = response * x[:, None] ** np.arange(1, min(2, len(levels) - 1) + 1)
    gain, dof = left.gained(left.fitter.project(along))
    if not dof:
        return []
    each = left.fitter.project(response * (chamber[:, None] == np.arange(len(levels))))
    most = levels[int(np.argmax(np.abs(unit(each).T @ left.residual)))]
    named = next(c for c, level in place.items() if level == most).partition("_")[0]
    where = f"{named}, {most:g} chambers from the inlet"
    return [_by_gain("chamber", gain, dof, left.saved(members), where)]


def _marker_places(record: Record) -> dict[str, float]:
    """Positions of the markers on the axis at rest, by their channels, in chambers from the inlet."""
    bent = [e for e in record.experiments if e.kind == UNIT]
    try:
        seen = at_rest(bent)
    except InputError:
        # Without a moment of rest the markers' positions are unknown.
        return {}
    scale = {e.name: e.scale for e in bent}
    # To half a chamber: positions of glued markers are no more accurate.
    chamber = {n: round(2 * z / (PITCH_MM * scale[name])) / 2 for n, (_, (*_, z), name) in seen.items()}
    channels = dict.fromkeys(s.channel for s in record.series if s.group != KNOWN)
    return {c: chamber[n] for c in channels for n in chamber if c.startswith(f"marker{n}_")}


def _by_channel(left: _Left, name: str, columns: Array | None) -> list[Dependence]:
    """Joint test of all channels and the best single one, each at half of the false-alarm rate.

    columns (N, d): of all channels, each with separate sizes.
    """
    if columns is None:
        return []
    # Series are whitened separately, so one pass serves all channels.
    white, singles, groups = left.fitter.whitened(columns), [], {}
    group = {s.channel: s.group for s in left.record.series}
    for channel, rows in left.channels.items():
        gain, dof = left.gained(white[rows], rows)
        if dof:
            groups[group[channel]] = left.spare[group[channel]]
            singles.append(_by_gain(name, gain, dof, groups[group[channel]], channel))
    return _jointly(name, singles, sum(groups.values()), "all channels")


def _jointly(name: str, singles: Sequence[Dependence], spare: float, where: str) -> list[Dependence]:
    """All of some tests together, or the last of the best ones alone; nothing without any."""
    if not singles:
        return []
    gain, dof = sum(d.statistic for d in singles), sum(d.dof for d in singles)
    best = min(reversed(singles), key=lambda d: d.p_value)
    single = attrs.evolve(best, p_value=min(1.0, len(singles) * best.p_value))
    return [_likelier(_by_gain(name, gain, dof, spare, where), single)]


def _phase(left: _Left) -> list[Dependence]:
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
            singles.append(_by_gain("phase_of_cycle", gain, b.shape[1], left.spare[s.group], where))
            members.append(s)
    found = _jointly("phase_of_cycle", singles, left.saved(members), "")
    best = min(reversed(singles), key=lambda d: d.p_value, default=None)
    # Where it is strongest is told in either case.
    return [attrs.evolve(best, p_value=d.p_value) for d in found if best]


def _spectrum(left: _Left) -> list[Dependence]:
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
                tests.append(_by_gain("frequency", value, dof, 0.0, where))
    return _least(sorted(tests, key=lambda d: d.where))


def _power(x: Array) -> Array:
    """The periodogram of a whitened series (b,), its ends left out."""
    return np.asarray(np.abs(np.fft.rfft(x - x.mean())[1:-1]) ** 2 / len(x))


# Change from sample to sample, in steps of a display, below which what is read stays.
STILL = 0.1


def _rounding(left: _Left, series: Series) -> tuple[Array, float]:
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


def _cycles_alike(left: _Left) -> list[Dependence]:
    """Test whether the whitened residuals of successive cycles correlate."""
    products = []
    for s in left.clocked:
        driven = left.record.driven(s.experiment, "pressure_kPa")
        period = cycle_s(left.record.experiments[s.experiment]) if driven else None
        lag = round(period / (s.sample_s * float(np.median(s.count)))) if period else 0
        x = left.residual[s.at]
        if 4 < lag < len(x):
            products.append(x[lag:] * x[:-lag])
    return _by_products("phase_of_cycle", products, "all cyclic records")


def _repeats_alike(left: _Left) -> list[Dependence]:
    """Test whether repeats of a protocol leave the same residual; their difference is noise."""
    pairs = [(s.at, o.at) for s, o in combinations(left.clocked, 2) if repeats(left.record, s, o)]
    both = [(left.residual[a], left.residual[b]) for a, b in pairs]
    return _by_products("repeat", [a[: len(b)] * b[: len(a)] for a, b in both], "all repeats")


def _steps(left: _Left) -> list[Dependence]:
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
    found = [_by_deviate("jump", z, where, 2.0 * len(both) * many) for z, where, many in both if many]
    return sorted(found, key=lambda d: d.p_value)[:1]


def _moved(left: _Left) -> tuple[float, str, int]:
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


def _breaks(left: _Left) -> list[Dependence]:
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
    return [_by_gain("break", float(gains[best]), len(left.channels), saved, where, len(moments))]


def _ringing(left: _Left) -> list[Dependence]:
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
    return [_by_gain("ringing", float(gains[best]), 1, left.saved(driven), where, len(hertz))]


def _outliers(left: _Left) -> list[Dependence]:
    best, tried = (0.0, ""), 0
    for s in left.clocked:
        z = np.abs(left.residual[s.at])
        # In a burst the size of errors is unknown.
        z = z if s.louder is None else np.where(s.louder > 1.0, 0.0, z)
        tried += len(z)
        if z.max() > best[0]:
            best = float(z.max()), left.place(s, int(np.argmax(z)))
    return [_by_deviate("outlier", *best, 2.0 * tried)] if tried else []
