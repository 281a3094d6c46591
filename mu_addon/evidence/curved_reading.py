"""Test: does a curved gauge explain more than the chosen effects?"""

from __future__ import annotations

import math

import numpy as np

from ..arrays import Array
from .fit import Fit, Fitter
from .record import KNOWN

# Gauss-Newton steps of the nuisances beside a curved reading; the last one changes almost nothing.
STEPS = 4
# Chi squared by which a curved reading must do better than one effect alone, whose law may be another.
ONE_EFFECT = 9.2


def curved_reading(fitter: Fitter, base: Fit, chosen: Fit) -> str:
    """Readings that would explain more than the effects if their gauge were curved, as text; else empty.

    A channel's reading is modelled as y + a |y| + b y**2 of its prediction y without effects: a change of
    slope at zero, and a change with size. Both sizes are fitted with the nuisances and compared with the
    chosen effects by Akaike's criterion. Several effects on one curve imitate most others.
    """
    if chosen is base:
        return ""
    spent = chosen.chi2 + 2.0 * (len(chosen.keys) - len(base.keys))
    spent -= ONE_EFFECT if len(chosen.effects) == 1 else 0.0
    about = {kind for e in chosen.effects for kind in e.kinds}
    for group in fitter.record.groups:
        kind, _, quantity = group.partition(" ")
        if group == KNOWN or kind not in about:
            continue
        rows = np.zeros((len(fitter.record), 1))
        for s in fitter.record.series:
            rows[s.at] = float(s.group == group)
        if _chi2(fitter, base, rows) + 2.0 * 2 < spent:
            names = " and ".join(n.replace("_", " ") for n in chosen.names)
            return f"{quantity} readings that are not proportional to it explain more than {names}"
    return ""


def _chi2(fitter: Fitter, base: Fit, rows: Array) -> float:
    """Chi squared of the base model with curved readings in some rows (N, 1), 1 there and 0 elsewhere.

    inf if there is no prediction at their nuisances.
    """
    values, curved, found = dict(base.values), fitter.curved, math.inf
    known = np.zeros((len(fitter.known), 2 + len(curved)))
    for row, p in enumerate(fitter.known):
        known[row, 2 + curved.index(p)] = 1.0 / p.spread
    for _ in range(STEPS):
        y = fitter.possible(values)
        if y is None:
            return math.inf
        columns = [rows[:, 0] * np.abs(y), rows[:, 0] * y**2]
        for p in curved:
            moved = fitter.possible({**values, p.name: values[p.name] + p.step})
            columns.append(np.zeros_like(y) if moved is None else (moved - y) / p.step)
        every = np.vstack([fitter.project(np.stack(columns, axis=1)), known])
        off = [(p.null - values[p.name]) / p.spread for p in fitter.known]
        left = np.concatenate([fitter.project(fitter.record.values - y), off])
        length = np.linalg.norm(every, axis=0)
        length[length == 0.0] = 1.0
        size = np.linalg.lstsq(every / length, left, rcond=1e-12)[0] / length
        found = float(np.sum((left - every @ size) ** 2))
        for p, change in zip(curved, size[2:].tolist(), strict=True):
            values[p.name] = min(max(values[p.name] + change, p.low), p.high)
    return found
