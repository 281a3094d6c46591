"""Significance of an effect: its gain, and the probability of that gain by noise alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .fit import Fit, Fitter
from .found_causes import RIVAL_DELTA_CHI2
from .hypotheses import by_search
from .sensitivity import ABSORBED, Sensitivity

DRAWS = 20000


def gain_of(fitter: Fitter, less: Fit, more: Fit) -> float:
    """Twice the log likelihood gained by an effect: the least under a common noise and under separate ones.

    Without the second, slow noise estimated too small would pass for a cause; without the first, noise
    swollen by a cause would hide it. The gains by gauges' noise alone and by a search for its starts
    (`by_search`) are subtracted.
    """
    searched = by_search(more) - by_search(less)
    gain = less.chi2 - more.chi2 - searched
    if gain < RIVAL_DELTA_CHI2:
        return gain
    own = []
    for fit in (less, more):
        under, refitted = fitter.under_its_own_noise(fit)
        own.append(sum(under.deviance(refitted).values()))
    return min(gain, own[0] - own[1] - searched) - by_gauges(fitter, less, more)


def by_gauges(fitter: Fitter, less: Fit, more: Fit) -> float:
    """Gain of a model's last effect by smoothing the gauges' noise, which the right model cannot have.

    On data that the model without it predicts, driven by other readings of the same noise. It is doubled,
    since that is one draw, and of readings that were denoised before.
    """
    other = fitter.driven_again(less) if math.isfinite(less.chi2) else None
    if other is None:
        return 0.0
    without = other.best(less.effects, [less.values])
    if not math.isfinite(without.chi2):
        return math.inf
    starts = [more.values, *({**less.values, **s} for s in more.effects[-1].starts())]
    return 2.0 * max(without.chi2 - other.best(more.effects, starts).chi2, 0.0)


def false_alarm_probability(fit: Fit, seen: Sequence[Sensitivity], gain: float) -> float:
    """Probability that noise alone lets some effect of the library gain as much on top of a fit.

    The parametric bootstrap of the linearised library: gains are squares of the noise along each effect's
    signature, one-sided at a bound. Far in the tail, they are approximated by independent squares, fitted in
    number to the bootstrap's last hundredth.
    """
    from scipy.stats import chi2

    columns, one_sided = [], []
    for s in seen:
        if s.worth_a_fit and s.effect.name not in fit.names:
            columns.append(s.column / np.linalg.norm(s.column))
            p = s.effect.parameters[0]
            one_sided.append(p.null in (p.low, p.high))
    if not columns:
        return 1.0
    u = np.stack(columns, axis=1)
    # Prior knowledge of nuisances is uncertain like the data, and may imitate effects too.
    q = np.vstack([fit.jacobian, fit.prior])
    u = np.vstack([u, np.zeros((len(q) - len(u), u.shape[1]))])
    q = np.linalg.qr(q)[0] if q.shape[1] else q
    u -= q @ (q.T @ u)
    length = np.linalg.norm(u, axis=0)
    u = u[:, length > ABSORBED] / length[length > ABSORBED]
    sides = np.array(one_sided)[length > ABSORBED]
    if not len(sides):
        return 1.0
    values, vectors = np.linalg.eigh(u.T @ u)
    half = vectors * np.sqrt(np.clip(values, 0.0, None))
    z = np.random.default_rng(0).normal(size=(DRAWS, len(half))) @ half.T
    most = np.max(np.where(sides, np.maximum(z, 0.0), np.abs(z)) ** 2, axis=1)
    more = int((most >= gain).sum())
    if more >= 50:
        return more / DRAWS
    tail = float(np.quantile(most, 0.99))
    alike = 0.01 / float(chi2.sf(tail, 1))
    return min(1.0, max(alike, 1.0) * float(chi2.sf(max(gain, 0.0), 1)))


def by_count(gain: float, dof: int, tried: float) -> float:
    """Probability that noise alone lets the best of so many fits gain as much, by Bonferroni's bound.

    gain: in chi squared of `dof` degrees of freedom.
    """
    from scipy.stats import chi2

    return min(1.0, tried * float(chi2.sf(max(gain, 0.0), dof)))
