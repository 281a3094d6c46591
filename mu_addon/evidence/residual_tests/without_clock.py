"""Tests of readings without a clock: of a unit that is turned, and of signs that alternate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from ...arrays import Array
from ..record import KNOWN, Record, Series
from ..spanned import basis
from .dependence import Dependence, by_products, least, normal_scores
from .left import NEAR, Left

TURN = "orientation_deg"
BY_TURN = "turn"
ALTERNATION = "alternation"
# Fewer readings alternate by the fit alone.
FEWEST_IN_A_ROW = 20
# Of a turn, in which a residual is sought, cut off at so many of its standard deviations (by the median).
HARMONICS, CUT = 4, 3.0


def by_turn(left: Left) -> list[Dependence]:
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
    return least([*least(found), *_turned_alike(record, left.residual)])


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
            scores.append(dict(zip(turned, normal_scores(r[s.at]).tolist(), strict=True)))
    products = [np.array([a[o] * b[o] for o in a.keys() & b.keys()]) for a, b in combinations(scores, 2)]
    return by_products(BY_TURN, products, "all records alike")


def alternating(left: Left) -> list[Dependence]:
    """Test whether a residual changes its sign from reading to reading, by normal scores.

    Without a clock the noise is the scatter from one to the next, so that such a misfit is as large as it.
    """
    alone = [s for s in left.record.series if math.isnan(s.sample_s) and s.group != KNOWN]
    parts = [left.residual[s.at] for s in alone if s.at.stop - s.at.start >= FEWEST_IN_A_ROW]
    products = [-z[1:] * z[:-1] for z in map(normal_scores, parts)]
    return by_products(ALTERNATION, products, "readings without a clock")
