"""Tests of a model's residual against everything it should not depend on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from typing import Any

import attrs
import numpy as np

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

Array = np.ndarray[Any, Any]

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


def dependence_table(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """Every test of a fit's residual, in a fixed order, except for quantities that do not vary.

    The noise is the fitter's, estimated with every smooth cause set aside. A test therefore shows the model's
    misfit, and sometimes the slowest part of the noise, which such data hardly determine.
    """
    spare = dict.fromkeys(fitter.deviance(fit), 0.0)
    return [*_fitted_tests(fitter, fit, spare), *_plain_tests(fitter, fit)]


def strict_table(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """The tests of `dependence_table` under two estimates of the noise; the larger p-value of each counts.

    A dependence must gain more likelihood than the noise does when it is estimated from the residual itself,
    as if that had no cause. Tests without a fit are repeated under that second noise.
    """
    own, refitted = fitter.under_its_own_noise(fit)
    before, after = fitter.deviance(fit), own.deviance(refitted)
    spare = {group: max(before[group] - after[group], 0.0) for group in before}
    found = _fitted_tests(fitter, fit, spare)
    once, again = (_plain_tests(f, m) for f, m in ((fitter, fit), (own, refitted)))
    found += [max(pair, key=lambda d: d.p_value) for pair in zip(once, again, strict=True)]
    return found


def _fitted_tests(fitter: Fitter, fit: Fit, spare: Mapping[str, float]) -> list[Dependence]:
    record, r = fitter.record, fit.residual
    found = []
    if any(s.group == KNOWN for s in record.series):
        rows = np.concatenate([np.arange(s.at.start, s.at.stop) for s in record.series if s.group == KNOWN])
        dof = max(len(rows) - len(fit.keys), 1)
        found.append(_by_gain("spread", float(r[rows] @ r[rows]), dof, 0.0, "all"))
    if all(s.group == KNOWN for s in record.series):
        return found
    fitted = _fitted(fitter, fit)
    for name, needs, of in COVARIATES:
        held = {
            i: np.asarray(of(e), float)
            for i, e in enumerate(record.experiments)
            if all(c in e.columns for c in needs)
            and ("pressure_kPa" not in needs or record.driven(i, "pressure_kPa"))
        }
        found += _tested(fitted, name, _powers(record, held), spare)
    found += _tested(fitted, "angle", _powers(record, _angles(fitter, fit)), spare)
    response = _response(fitter, fit)
    for name, condition in CONDITIONS:
        values = np.array([condition(e, i) for i, e in enumerate(record.experiments)], float)
        found += _tested(fitted, name, _by_condition(record, values, response), spare)
    return [
        *found,
        *_chambers(fitter, fit, response, spare),
        *_phase(fitter, fit, spare),
        *_breaks(fitter, fit, response, spare),
        *_ringing(fitter, fit, spare),
    ]


def _plain_tests(fitter: Fitter, fit: Fit) -> list[Dependence]:
    record, r = fitter.record, fit.residual
    return [
        *_by_turn(fitter, fit),
        *_steps(fitter, fit),
        *_spectrum(fitter, fit),
        *_cycles_alike(record, r),
        *_repeats_alike(record, r),
        *_alternating(record, r),
        *_outliers(record, r),
    ]


def structure(table: Sequence[Dependence]) -> tuple[str, ...]:
    """Quantities that the residual depends on, strongest first, at a false-alarm rate of `FALSE_ALARM`.

    The rate is divided by the number of tests (Bonferroni).
    """
    level = FALSE_ALARM / max(len(table), 1)
    return tuple(d.against for d in sorted(table, key=lambda d: d.p_value) if d.p_value < level)


def _response(fitter: Fitter, fit: Fit) -> Array:
    """Change (N,) of the prediction by the first nuisance that is not a zero."""
    if not fitter.curved:
        return np.ones(len(fitter.record))
    p = fitter.curved[0]
    moved = {**fit.values, p.name: fit.values[p.name] + p.step}
    return (fitter.predict(moved) - fitter.predict(fit.values)) / p.step


def taken_by_scales(fitter: Fitter, fit: Fit) -> float:
    """Chi squared that a scale factor of each experiment's response takes from a fit's residual."""
    record = fitter.record
    response = _response(fitter, fit)
    own = response[:, None] * (record.of_experiment[:, None] == np.arange(len(record.experiments)))
    q = _basis(fitter.project(own))
    return float(np.sum((q.T @ fit.residual) ** 2))


def _channels(record: Record) -> tuple[str, ...]:
    return tuple(dict.fromkeys(s.channel for s in record.series if s.group != KNOWN))


def _angles(fitter: Fitter, fit: Fit) -> dict[int, Array]:
    """Angle (n,) at each sample, by experiments that have one: as predicted, which has no noise.

    A measured angle has the noise of the residual that it would be compared with, but as a drive it has no
    noise.
    """
    found = {}
    for i, e in enumerate(fitter.record.experiments):
        if ANGLE not in e.columns or "time_s" not in e.columns:
            continue
        rows = [s.row for s in fitter.record.series if s.experiment == i and s.channel == ANGLE]
        if rows:
            found[i] = fitter.simulator.predict(e, fit.values)[rows[0]]
        else:
            found[i] = np.nan_to_num(e[ANGLE])
    return found


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


def _by_turn(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """Test against the angle that a unit is turned by within a record.

    Such readings have no clock, so their noise is estimated from the same residual. A share of the residual
    is tested (by the beta distribution), not its size over that noise. Misfits are cut off at `CUT` of their
    standard deviations, since they include outliers. Records are also compared (`_turned_alike`).
    """
    from scipy.stats import beta

    record, r, found = fitter.record, fit.residual, []
    for channel in _channels(record):
        members = [s for s in record.series if s.channel == channel and _turned(record, s)]
        if not members:
            continue
        turned = np.radians(np.concatenate([s.mean(record.experiments[s.experiment][TURN]) for s in members]))
        misfit = _cut([r[s.at] for s in members])
        left = len(misfit) - len(members) - len(fit.keys)
        apart = np.unique(np.round(turned % (2.0 * np.pi), 6))
        for order in range(1, min(HARMONICS, (len(apart) - 1) // 2) + 1):
            wave = np.stack([np.cos(order * turned), np.sin(order * turned)], axis=1)
            q = _basis(wave - wave.mean(axis=0))
            share = float(np.sum((q.T @ misfit) ** 2) / max(misfit @ misfit, 1e-300))
            dof = q.shape[1]
            p = float(beta.sf(min(share, 1.0), dof / 2, max(left - dof, 1) / 2))
            found.append(Dependence(BY_TURN, share, p, f"{channel}, {order} times a turn", dof))
    worst = sorted(found, key=lambda d: d.p_value)[:1]
    either = [attrs.evolve(d, p_value=min(1.0, len(found) * d.p_value)) for d in worst]
    either += _turned_alike(record, r)
    least = sorted(either, key=lambda d: d.p_value)[:1]
    return [attrs.evolve(d, p_value=min(1.0, len(either) * d.p_value)) for d in least]


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


def _alternating(record: Record, r: Array) -> list[Dependence]:
    """Test whether a residual (N,) changes its sign from reading to reading, by normal scores.

    Without a clock the noise is the scatter from one to the next, so that such a misfit is as large as it.
    """
    own = [r[s.at] for s in record.series if math.isnan(s.sample_s) and s.group != KNOWN]
    scores = [_scores(x) for x in own if len(x) >= FEWEST_IN_A_ROW]
    return _by_products(ALTERNATION, [-z[1:] * z[:-1] for z in scores], "readings without a clock")


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


@attrs.frozen(eq=False)
class _Fitted:
    """Fitted subspace: k orthonormal columns span it, with the residual's (N,) components `along` (k,) them.

    rows, own: of each channel, its rows of the record, and the columns there.
    """

    fitter: Fitter
    residual: Array
    along: Array
    rows: Mapping[str, Array]
    own: Mapping[str, Array]
    groups: Mapping[str, str]


def _fitted(fitter: Fitter, fit: Fit) -> _Fitted:
    record = fitter.record
    q = np.hstack([fitter.zeros_basis, _basis(fit.jacobian)])
    rows = {
        channel: np.concatenate(
            [np.arange(s.at.start, s.at.stop) for s in record.series if s.channel == channel]
        )
        for channel in _channels(record)
    }
    own = {channel: q[at] for channel, at in rows.items()}
    groups = {s.channel: s.group for s in record.series}
    return _Fitted(fitter, fit.residual, q.T @ fit.residual, rows, own, groups)


def _chambers(fitter: Fitter, fit: Fit, response: Array, spare: Mapping[str, float]) -> list[Dependence]:
    """Test whether markers' response to the modulus depends on their chamber.

    A chamber that bends unlike the rest moves the markers beyond it, and none before it. `where` names the
    marker that deviates most, and its position at rest in chambers from the inlet.
    """
    record = fitter.record
    place = _marker_places(record)
    levels = np.unique(list(place.values()))
    if len(levels) < 2:
        return []
    block, own = np.zeros((len(record), min(2, len(levels) - 1))), np.zeros((len(record), len(levels)))
    for s in record.series:
        if s.channel in place and s.group != KNOWN:
            at = int(np.searchsorted(levels, place[s.channel]))
            x = 2.0 * (levels[at] - levels[0]) / (levels[-1] - levels[0]) - 1.0
            block[s.at] = response[s.at, None] * x ** np.arange(1, block.shape[1] + 1)
            own[s.at, at] = response[s.at]
    q = _basis(fit.jacobian)
    white, each = (_unit(fitter.project(columns)) for columns in (block, own))
    onto = q.T @ white
    gain, dof = _gained(
        white.T @ white - onto.T @ onto, white.T @ fit.residual - onto.T @ (q.T @ fit.residual)
    )
    if not dof:
        return []
    groups = {s.group for s in record.series if s.channel in place}
    most = levels[int(np.argmax(np.abs(each.T @ fit.residual)))]
    named = next(c for c, level in place.items() if level == most).partition("_")[0]
    where = f"{named}, {most:g} chambers from the inlet"
    return [_by_gain("chamber", gain, dof, sum(spare[g] for g in groups), where)]


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
    channels = _channels(record)
    return {c: chamber[n] for c in channels for n in chamber if c.startswith(f"marker{n}_")}


def _tested(
    fitted: _Fitted, name: str, columns: Array | None, spare: Mapping[str, float]
) -> list[Dependence]:
    """Joint test of all channels and the best single one, each at half of the false-alarm rate.

    columns (N, d): of all channels, each with separate sizes.
    """
    if columns is None:
        return []
    # Series are whitened separately, so one pass serves all channels.
    every = fitted.fitter.whitened(columns)
    singles, groups = [], set()
    for channel, rows in fitted.rows.items():
        white, q = _unit(every[rows]), fitted.own[channel]
        onto = q.T @ white
        gain, dof = _gained(
            white.T @ white - onto.T @ onto, white.T @ fitted.residual[rows] - onto.T @ fitted.along
        )
        if dof:
            group = fitted.groups[channel]
            singles.append(_by_gain(name, gain, dof, spare[group], channel))
            groups.add(group)
    return _jointly(name, singles, sum(spare[g] for g in groups), "all channels")


def _jointly(name: str, singles: Sequence[Dependence], spare: float, where: str) -> list[Dependence]:
    """All of some tests together, or the last of the best ones alone; nothing without any."""
    if not singles:
        return []
    gain, dof = sum(d.statistic for d in singles), sum(d.dof for d in singles)
    best = min(reversed(singles), key=lambda d: d.p_value)
    single = attrs.evolve(best, p_value=min(1.0, len(singles) * best.p_value))
    return [_likelier(_by_gain(name, gain, dof, spare, where), single)]


def _gained(gram: Array, along: Array) -> tuple[float, int]:
    """Chi squared that columns take, and their rank, from their products and those with the residual (d,).

    Near dependences are left out, as in `_basis`; so is a column of unit length that is zero but for
    rounding.
    """
    size = np.sqrt(np.maximum(np.diag(gram), 0.0))
    kept = size > 1e-6
    size = size[kept]
    if not len(size):
        return 0.0, 0
    squares, vectors = np.linalg.eigh(gram[np.ix_(kept, kept)] / np.outer(size, size))
    resolved = squares > NEAR**2
    parts = vectors.T @ (along[kept] / size)
    return float(np.sum(parts[resolved] ** 2 / squares[resolved])), int(resolved.sum())


def _unit(columns: Array) -> Array:
    length = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(length > 0, length, 1.0))


def _basis(columns: Array) -> Array:
    """Orthonormal basis of columns, near dependences left out."""
    if not columns.shape[1]:
        return columns
    u, sizes, _ = np.linalg.svd(_unit(columns), full_matrices=False)
    return np.asarray(u[:, sizes > NEAR])


def _clocked(record: Record) -> list[Series]:
    return [s for s in record.series if s.group != KNOWN and not math.isnan(s.sample_s)]


def _phase(fitter: Fitter, fit: Fit, spare: Mapping[str, float]) -> list[Dependence]:
    """Test for structure that repeats in every cycle: its harmonics, by channel and experiment."""
    singles, groups = [], set()
    bases: dict[Any, Array | None] = {}
    for s in _clocked(fitter.record):
        key = s.experiment, s.group, s.clock
        if key not in bases:
            columns = harmonics(fitter.record, s)
            bases[key] = None
            if columns is not None and columns.shape[1] > 1:
                bases[key] = _basis(fitter.whitening.series(s, columns))
        b = bases[key]
        if b is not None:
            gain = float(np.sum((b.T @ fit.residual[s.at]) ** 2))
            where = f"{fitter.record.experiments[s.experiment].name}, {s.channel}"
            singles.append(_by_gain("phase_of_cycle", gain, b.shape[1], spare[s.group], where))
            groups.add(s.group)
    found = _jointly("phase_of_cycle", singles, sum(spare[g] for g in groups), "")
    best = min(reversed(singles), key=lambda d: d.p_value, default=None)
    # Where it is strongest is told in either case.
    return [attrs.evolve(best, p_value=d.p_value) for d in found if best]


def _spectrum(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """Power of the whitened residual by bands of frequency, series of a group and of one clock together.

    The rounding error of readings in steps is a sawtooth, a tone, where the quantity rises steadily. Where it
    stays between two steps readings alternate by a whole one. Both are expected in a band in addition to the
    noise.
    """
    bands: dict[tuple[str, float], list[tuple[Array, Array, Array]]] = {}
    for s in _clocked(fitter.record):
        x = fit.residual[s.at]
        if len(x) < 32:
            continue
        f = np.fft.rfftfreq(len(x))[1:-1] / (s.sample_s * float(np.median(s.count)))
        saw, flips = _rounding(fitter, fit, s)
        rounded = _power(fitter.whitening.series(s, saw)) + flips / fitter.sources[s.group].white ** 2
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
    worst = sorted(tests, key=lambda d: (d.p_value, d.where))[:1]
    return [attrs.evolve(d, p_value=min(1.0, d.p_value * len(tests))) for d in worst]


def _power(x: Array) -> Array:
    """The periodogram of a whitened series (b,), its ends left out."""
    return np.asarray(np.abs(np.fft.rfft(x - x.mean())[1:-1]) ** 2 / len(x))


# Change from sample to sample, in steps of a display, below which what is read stays.
STILL = 0.1


def _rounding(fitter: Fitter, fit: Fit, series: Series) -> tuple[Array, float]:
    """Rounding error to a channel's steps in a fit's prediction of a series (b,), in its unit.

    Also the variance of readings that alternate between two steps, over all of the series.
    """
    if not series.step:
        return np.zeros(series.at.stop - series.at.start), 0.0
    e = fitter.record.experiments[series.experiment]
    read = e[series.channel]
    exact = fitter.simulator.predict(e, fit.values)[series.row] - read[np.isfinite(read)][0]
    still = float(np.mean(np.abs(np.diff(exact)) < STILL * series.step))
    saw = series.step * np.round(exact / series.step) - exact
    return series.mean(saw), still * (0.5 * series.step) ** 2


def _cycles_alike(record: Record, r: Array) -> list[Dependence]:
    """Test whether the whitened residuals of successive cycles correlate."""
    products = []
    for s in _clocked(record):
        e = record.experiments[s.experiment]
        period = cycle_s(e) if record.driven(s.experiment, "pressure_kPa") else None
        if period is None:
            continue
        lag = round(period / (s.sample_s * float(np.median(s.count))))
        x = r[s.at]
        if 4 < lag < len(x):
            products.append(x[lag:] * x[:-lag])
    return _by_products("phase_of_cycle", products, "all cyclic records")


def _repeats_alike(record: Record, r: Array) -> list[Dependence]:
    """Test whether repeats of a protocol leave the same residual; their difference is noise."""
    pairs = [(r[s.at], r[o.at]) for s, o in combinations(_clocked(record), 2) if repeats(record, s, o)]
    products = [a[: len(b)] * b[: len(a)] for a, b in pairs]
    return _by_products("repeat", products, "all repeats")


def _steps(fitter: Fitter, fit: Fit) -> list[Dependence]:
    """Test whether a channel jumped once, in an experiment or between two: every position is tried."""
    r = fit.residual
    best, tried = (0.0, ""), 0
    known: dict[Any, Array] = {}
    for s in _clocked(fitter.record):
        b = s.at.stop - s.at.start
        if b < 16:
            continue
        key = (s.group, b, s.sample_s, s.count[0])
        if key not in known:
            jump = np.tril(np.ones((b, b)))[:, 4:-4]
            white = fitter.whitening.series(s, jump - jump.mean(axis=0))
            known[key] = white / np.linalg.norm(white, axis=0)
        z = np.abs(known[key].T @ r[s.at])
        tried += len(z)
        at = int(np.argmax(z))
        if z[at] > best[0]:
            name = fitter.record.experiments[s.experiment].name
            best = (float(z[at]), f"{name}, {s.channel}, {s.time_s[at + 4]:.4g} s")
    # Jumps at neighbouring places are nearly the same test, yet no fewer than a third are independent.
    both = [(*best, tried), *([_moved(fitter, fit)] if len(fitter.record.experiments) > 1 else [])]
    found = [_by_deviate("jump", z, where, 2.0 * len(both) * many) for z, where, many in both if many]
    return sorted(found, key=lambda d: d.p_value)[:1]


def _moved(fitter: Fitter, fit: Fit) -> tuple[float, str, int]:
    """The clearest jump between two experiments, in standard deviations, as text, and the number tried.

    Of channels whose one zero is fitted for all experiments: a reglued marker or a moved camera has another
    one from then on.
    """
    record = fitter.record
    every: dict[str, list[Series]] = {}
    for s in _clocked(record):
        every.setdefault(s.channel, []).append(s)
    places: list[tuple[str, int]] = []
    columns = []
    for channel, own in every.items():
        # The first is the zero itself, which must be one that is fitted.
        for first in sorted({s.experiment for s in own}):
            column = np.zeros(len(record))
            for s in own:
                column[s.at] = s.experiment >= first
            places.append((channel, first))
            columns.append(column)
    if not columns:
        return 0.0, "", 0
    stacked = np.stack(columns, axis=1)
    whole = np.linalg.norm(fitter.whitened(stacked), axis=0)
    white = fitter.project(stacked)
    absorbed = np.linalg.norm(white, axis=0) <= 1e-6 * whole
    zeros = {channel for (channel, _), gone in zip(places, absorbed, strict=True) if gone}
    q = _basis(fit.jacobian)
    white -= q @ (q.T @ white)
    length = np.linalg.norm(white, axis=0)
    best, tried = (0.0, ""), 0
    for (channel, first), along, size, before in zip(
        places, white.T @ fit.residual, length, whole, strict=True
    ):
        if channel not in zeros or size <= ABSORBED * before:
            continue
        tried += 1
        z = abs(float(along) / float(size))
        if z > best[0]:
            best = z, f"{channel}, from {record.experiments[first].name} on"
    return *best, tried


def _breaks(fitter: Fitter, fit: Fit, response: Array, spare: Mapping[str, float]) -> list[Dependence]:
    """Test whether the response changed at some moment: every eighth of every experiment is tried.

    Each channel has a separate size, and its zero and the fitted parameters are free in each.
    """
    record = fitter.record
    # Experiment, time, words, and which eighth.
    moments: list[tuple[int, float, str, int]] = []
    for i, e in enumerate(record.experiments):
        t = e.columns.get("time_s")
        if t is not None:
            at = t[0] + np.linspace(0.0, 1.0, 9)[:-1] * (t[-1] - t[0])
            moments += [(i, float(v), f"{e.name}, {v:.4g} s", k) for k, v in enumerate(at)]
    moments = moments[1:]
    if not moments:
        return []
    places = [[k for k, m in enumerate(moments) if m[0] == i] for i in range(len(record.experiments))]
    # For experiments after the moment the whole response counts: eight moments' columns, and that one.
    eighth = np.zeros((len(record), 9))
    for s in _clocked(record):
        eighth[s.at, 0] = response[s.at]
        for k in places[s.experiment]:
            eighth[s.at, 1 + moments[k][3]] = response[s.at] * (s.time_s >= moments[k][1])
    white = fitter.whitening(eighth)
    level = fitter.whitening(np.ones(len(record)))
    gains, dof = np.zeros(len(moments)), 0
    saved = sum(spare[g] for g in {s.group for s in _clocked(record)})
    for channel in _channels(record):
        members = [s for s in record.series if s.channel == channel]
        own = [np.column_stack([level[s.at], fit.jacobian[s.at]]) for s in members]
        q = np.split(_basis(np.concatenate(own)), np.cumsum([len(o) for o in own])[:-1])
        # Of each experiment: squares, products with what was fitted, and with the residual.
        square = np.zeros((len(record.experiments), 9))
        onto = np.zeros((len(record.experiments), 9, q[0].shape[1]))
        along = np.zeros((len(record.experiments), 9))
        total = np.zeros(q[0].shape[1])
        for s, part in zip(members, q, strict=True):
            w, r = white[s.at], fit.residual[s.at]
            square[s.experiment] += np.sum(w**2, axis=0)
            onto[s.experiment] += w.T @ part
            along[s.experiment] += w.T @ r
            total += part.T @ r
        own_, later = (np.array([m[i] for m in moments]) for i in (0, 3))
        before = [v[own_, 1 + later] + _beyond(v[:, 0])[own_] for v in (square, onto, along)]
        left = before[0] - np.sum(before[1] ** 2, axis=1)
        resolved = left > 1e-6 * np.maximum(before[0], 1e-300)
        gain = (before[2] - before[1] @ total) ** 2 / np.where(resolved, left, 1.0)
        gains += np.where(resolved, gain, 0.0)
        dof += 1
    best = int(np.argmax(gains))
    return [_by_gain("break", float(gains[best]), dof, saved, moments[best][2], len(moments))]


def _beyond(v: Array) -> Array:
    """Sums (n, ...) of v (n, ...) over all later rows."""
    return np.asarray(v.sum(axis=0) - np.cumsum(v, axis=0))


def _ringing(fitter: Fitter, fit: Fit, spare: Mapping[str, float]) -> list[Dependence]:
    """Test whether a unit under pressure swings after each change of it: one size for all channels.

    The residual is tested along the motion of a mass that the fitted model drives, by the largest of many
    modes.
    """
    record = fitter.record
    driven = [
        s for s in _clocked(record) if record.driven(s.experiment, "pressure_kPa") and len(s.time_s) > 16
    ]
    if not driven:
        return []
    longest = max(float(s.time_s[-1] - s.time_s[0]) for s in driven)
    # A mode somewhat faster than half the clock is seen, at another frequency.
    fastest = max(0.75 * (len(s.time_s) - 1) / float(s.time_s[-1] - s.time_s[0]) for s in driven)
    hertz, damping = modes(PERIODS / longest, fastest)
    if not len(hertz):
        return []
    still = fitter.predict(fit.values)
    swings = np.zeros((len(record), len(hertz)))
    clocks: dict[Any, list[Series]] = {}
    for s in driven:
        clocks.setdefault((s.experiment, s.clock), []).append(s)
    for members in clocks.values():
        together = np.stack([still[s.at] for s in members], axis=1)
        found = ringing(members[0].time_s, together, hertz, damping)
        for k, s in enumerate(members):
            swings[s.at] = found[:, k]
    swings = fitter.project(swings)
    before = np.linalg.norm(swings, axis=0)
    q = _basis(fit.jacobian)
    swings -= q @ (q.T @ swings)
    length = np.linalg.norm(swings, axis=0)
    resolved = length > ABSORBED * np.maximum(before, 1e-300)
    gains = np.where(resolved, swings.T @ fit.residual / np.where(resolved, length, 1.0), 0.0) ** 2
    best = int(np.argmax(gains))
    saved = sum(spare[g] for g in {s.group for s in driven})
    where = f"{hertz[best]:.3g} Hz, after changes of pressure"
    return [_by_gain("ringing", float(gains[best]), 1, saved, where, len(hertz))]


def _outliers(record: Record, r: Array) -> list[Dependence]:
    clocked = _clocked(record)
    if not clocked:
        return []
    worst, where, tried = 0.0, "", 0
    for s in clocked:
        # In a burst the size of errors is unknown.
        z = np.abs(r[s.at]) if s.louder is None else np.where(s.louder > 1.0, 0.0, np.abs(r[s.at]))
        tried += len(z)
        if z.max() > worst:
            at = int(np.argmax(z))
            name = record.experiments[s.experiment].name
            worst, where = float(z[at]), f"{name}, {s.channel}, {s.time_s[at]:.4g} s"
    return [_by_deviate("outlier", worst, where, 2.0 * tried)]
