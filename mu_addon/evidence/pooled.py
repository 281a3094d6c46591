"""Specimens, sessions and experiments that differ: values of their own, of one distribution."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np

from ..measured import Experiment
from .effect import OF, Effect, Parameter
from .fit import Fit, Fitter
from .owned import BATCH_EFFECT, OF_NONE, OF_THE_BENCH
from .residuals import strict_table, structure
from .selection import (
    FALSE_ALARM_RATE,
    RIVAL_DELTA_CHI2,
    Cause,
    Selection,
    at_a_bound,
    sudden,
)

Array = np.ndarray[Any, Any]

# Of fewer owners a spread is not estimated: two that differ are one and another.
FEWEST = 3
# Rounds of spread, values and slopes about them, and the change of the spread that ends them.
ROUNDS, SETTLED = 4, 0.02
# Names of drifts have a course in time besides a size, and cannot be told apart by one number an owner.
DRIFTS = "_drift"
# Rise of -2 log L that a 95 % interval of one number allows.
RISE = 3.84


@attrs.frozen
class Spread:
    """Standard deviation of values between owners, in their parameter's unit, by restricted likelihood.

    low95, high95: profile interval. gain: of -2 log L over no spread at all; of it `log_det` is paid for the
    freedom of the values. values (j,): of each owner, drawn toward their common mean by as much as the data
    leave them uncertain.
    """

    value: float
    low95: float
    high95: float
    gain: float
    log_det: float
    values: Array


def spread_of(slopes: Array, residual: Array, most: float) -> Spread:
    """The spread of j owners' values that a residual shows.

    slopes (n, j): of the whitened prediction by the value of each owner, orthogonal to all that is fitted
    anyway; residual (n,): whitened, with every value at 0. Values are normal about 0 with a standard
    deviation s: the residual's covariance is I + s^2 Z Z^T, and -2 log L = log det(I + s^2 G)
    - s^2 b^T (I + s^2 G)^-1 b with G = Z^T Z, b = Z^T r (Harville, J. Am. Stat. Assoc. 72 (1977) 320).
    most: largest standard deviation that is tried.
    """
    gram, along = slopes.T @ slopes, slopes.T @ residual
    weight, directions = np.linalg.eigh(gram)
    weight = np.maximum(weight, 0.0)
    c2 = (directions.T @ along) ** 2
    tried = np.concatenate([[0.0], np.geomspace(1e-5 * most, most, 2000)])
    grown = 1.0 + tried[:, None] ** 2 * weight
    deviance = (np.log(grown) - tried[:, None] ** 2 * c2 / grown).sum(axis=1)
    best = int(np.argmin(deviance))
    within = tried[deviance <= deviance[best] + RISE]
    s2 = tried[best] ** 2
    values = directions @ (s2 / (1.0 + s2 * weight) * (directions.T @ along))
    log_det = float(np.log(grown[best]).sum())
    ends = float(within[0]), float(within[-1])
    return Spread(float(tried[best]), *ends, float(-deviance[best]), log_det, values)


def pooled_effects(effects: Sequence[Effect], experiments: Sequence[Experiment]) -> tuple[Effect, ...]:
    """Effects whose size may be another one in each specimen, session or experiment, before any is known.

    Those of one size that may have either sign. What measures differs by session, where sessions are given,
    and by experiment; what is printed by specimen, and so does the modulus. Each has one parameter an owner.
    """
    kinds = tuple(dict.fromkeys(e.kind for e in experiments))
    found = []
    for effect in (*effects, attrs.evolve(BATCH_EFFECT, kinds=kinds)):
        p = effect.parameters[0]
        one_number = len(effect.parameters) == 1 and p.low < p.null < p.high
        if effect.name in OF_NONE or effect.name.endswith(DRIFTS) or not one_number:
            continue
        own = [e for e in experiments if e.kind in effect.kinds]
        for among, owners in _groups(effect.name, own).items():
            if len(owners) >= FEWEST:
                each = tuple(_own(p, f"{among} {owner}") for owner in owners)
                found.append(attrs.evolve(effect, parameters=each, among=among))
    return tuple(found)


def _groups(name: str, experiments: Sequence[Experiment]) -> dict[str, tuple[str, ...]]:
    """Names of owners by what they are: specimens, or sessions and experiments for what measures."""
    if name not in OF_THE_BENCH:
        named = {"specimen": [e.specimen for e in experiments]}
    else:
        named = {"session": [e.session for e in experiments], "experiment": [e.name for e in experiments]}
    # Where a group has some without a name, nothing says whose they are.
    whole = {k: tuple(dict.fromkeys(v)) for k, v in named.items() if all(v)}
    if len(set(whole.values())) < len(whole):
        whole.pop("experiment", None)
    return whole


def _own(p: Parameter, owner: str) -> Parameter:
    return attrs.evolve(p, name=f"{p.name}{OF}{owner}")


def select_pooled(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """A selection that explains too little, with the effect in which owners differ that explains it.

    Unchanged where there is none. The false-positive probability is that of a spread at its bound of 0 (half
    a chi squared of one degree), times the number of effects and groupings that were tried. What every second
    quarter of the records tells of each owner must predict the other quarters. Neither a step
    change nor an effect of one size for all may explain more. Rivals are other effects, or groupings, whose
    likelihood is as good.
    """
    from scipy.stats import chi2

    record = fitter.record
    effects = pooled_effects(fitter.simulator.effects, record.experiments)
    fits: list[tuple[float, Fit]] = []
    for effect in effects:
        progress(effect.title)
        one = _fitted(fitter, found.base, effect)
        if one is not None:
            fits.append(one)
    if not fits:
        return found
    fits.sort(key=lambda one: -one[0])
    gain, best = fits[0]
    p = min(1.0, len(effects) * 0.5 * float(chi2.sf(max(gain, 0.0), 1)))
    if p >= FALSE_ALARM_RATE or at_a_bound(best) or not _predicts(fitter, found.base, best):
        return found
    table = tuple(strict_table(fitter, best))
    if structure(table) or sudden(found.table_base, found.base, best):
        return found
    # Smooth structure may pass for slow noise; then what all owners share explains more than what differs.
    if any(single.chi2 < best.chi2 for single in found.singles):
        return found
    rivals = tuple(f.effects[0].title for g, f in fits[1:] if gain - g < RIVAL_DELTA_CHI2)
    cause = Cause(best.effects[0], p, found.base.chi2 - best.chi2, rivals)
    return attrs.evolve(found, chosen=best, causes=(cause,), table=table, doubted="", p_best=p)


def _fitted(fitter: Fitter, base: Fit, effect: Effect) -> tuple[float, Fit] | None:
    """Gain in -2 log L and fit of an effect whose owners differ; None where the data show none."""
    fit, spread, before = base, None, math.nan
    start = dict.fromkeys(effect.keys, effect.parameters[0].null)
    for _ in range(ROUNDS):
        values = {**fit.values, **{k: fit.values.get(k, start[k]) for k in effect.keys}}
        at = fitter.predict(values)
        slopes = np.empty((len(at), len(effect.keys)), order="F")
        for i, (key, p) in enumerate(zip(effect.keys, effect.parameters, strict=True)):
            slopes[:, i] = (fitter.predict({**values, key: values[key] + p.step}) - at) / p.step
        off = np.array([values[k] - start[k] for k in effect.keys])
        white = fitter.project(slopes)
        fitted_anyway = base.jacobian if fit is base else fit.jacobian[:, : -len(effect.keys)]
        q = _directions(fitted_anyway)
        white -= q @ (q.T @ white)
        # As it would be with all values at 0.
        residual = fit.residual + white @ off
        residual = residual - q @ (q.T @ residual)
        p = effect.parameters[0]
        spread = spread_of(white, residual, p.high - p.null)
        if not spread.value > 0.0:
            return None
        each = tuple(attrs.evolve(own, spread=spread.value) for own in effect.parameters)
        effect = attrs.evolve(effect, parameters=each, spread=(spread.value, spread.low95, spread.high95))
        guess = dict(zip(effect.keys, (spread.values + p.null).tolist(), strict=True))
        bounded = {k: min(max(v, p.low), p.high) for k, v in guess.items()}
        fit = fitter.best([effect], [{**fit.values, **bounded}])
        if not math.isfinite(fit.chi2):
            return None
        if abs(spread.value - before) < SETTLED * spread.value:
            break
        before = spread.value
    assert spread is not None
    # What it gained as fitted: the values may be at bounds, or the slopes have changed.
    return base.chi2 - fit.chi2 - spread.log_det, fit


def _directions(columns: Array) -> Array:
    """Orthonormal columns that span those given, without directions that are none."""
    length = np.linalg.norm(columns, axis=0)
    u, s, _ = np.linalg.svd(columns[:, length > 0] / length[length > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-9 * max(s.max(initial=0.0), 1e-300)])


def _predicts(fitter: Fitter, base: Fit, best: Fit) -> bool:
    """Whether owners' values from every second quarter of the records predict the quarters between."""
    record = fitter.record
    quarter = np.zeros(len(record), int)
    for s in record.series:
        many = s.at.stop - s.at.start
        quarter[s.at] = np.minimum(4 * np.arange(many) // max(many, 1), 3)
    lost = 0.0
    for side in (0, 1):
        left_out = quarter % 2 == side
        rest = fitter.without(left_out)
        chi2 = []
        for model in (base, best):
            again = rest.fit(model.effects, model.values)
            r = fitter.whitening(record.values - fitter.predict(again.values))[left_out]
            chi2.append(float(r @ r))
        lost += chi2[0] - chi2[1]
    return lost > 0.0
