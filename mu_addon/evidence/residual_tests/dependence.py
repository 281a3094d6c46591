"""One test's outcome, and how outcomes of several are taken together."""

from __future__ import annotations

import math
from collections.abc import Sequence

import attrs
import numpy as np

from ...arrays import Array


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


def by_gain(against: str, gain: float, dof: int, spare: float, where: str, tried: float = 1.0) -> Dependence:
    """Test by a gain in chi squared, less what the noise spares; the best of so many that were tried."""
    from scipy.stats import chi2

    return Dependence(against, gain, min(1.0, tried * float(chi2.sf(gain - spare, dof))), where, dof)


def by_deviate(against: str, z: float, where: str, tried: float = 1.0) -> Dependence:
    """Test by a normal deviate, for more than 0; the largest of so many that were tried."""
    from scipy.stats import norm

    return Dependence(against, z, min(1.0, tried * float(norm.sf(z))), where)


def by_products(against: str, products: Sequence[Array], where: str) -> list[Dependence]:
    """Test whether two lists of deviates correlate, by their products (n,) in parts; nothing without any."""
    count = sum(map(len, products))
    return (
        [by_deviate(against, sum(float(p.sum()) for p in products) / math.sqrt(count), where)]
        if count
        else []
    )


def likelier(together: Dependence, single: Dependence) -> Dependence:
    """The likelier of two tests of one thing, each at half of the false-alarm rate."""
    found = together if together.p_value < single.p_value else single
    return attrs.evolve(found, p_value=min(1.0, 2.0 * found.p_value))


def jointly(name: str, singles: Sequence[Dependence], spare: float, where: str) -> list[Dependence]:
    """All of some tests together, or the last of the best ones alone; nothing without any."""
    if not singles:
        return []
    gain, dof = sum(d.statistic for d in singles), sum(d.dof for d in singles)
    best = min(reversed(singles), key=lambda d: d.p_value)
    single = attrs.evolve(best, p_value=min(1.0, len(singles) * best.p_value))
    return [likelier(by_gain(name, gain, dof, spare, where), single)]


def least(tests: Sequence[Dependence]) -> list[Dependence]:
    """The likeliest of some tests, its p-value times their number; nothing without any."""
    return [
        attrs.evolve(d, p_value=min(1.0, len(tests) * d.p_value))
        for d in sorted(tests, key=lambda d: d.p_value)[:1]
    ]


# Digits of a whitened residual that count in its rank.
RANKED = 6


def normal_scores(values: Array) -> Array:
    """Normal scores (n,) of values by their ranks, of unit standard deviation; zeros where all are one.

    van der Waerden 1952: an outlier is no larger than other readings, and readings that a display rounds to
    one number have one rank.
    """
    from scipy.stats import norm, rankdata

    z = norm.ppf(rankdata(np.round(values, RANKED)) / (len(values) + 1.0))
    return np.asarray(z / z.std()) if z.any() else z
