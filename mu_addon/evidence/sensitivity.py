"""Signature of each effect in a record, the part absorbed by nuisances, and similar effects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import MuError
from .effect import Effect, Parameter
from .fit import Fitter
from .record import Record
from .simulator import Composite
from .spanned import unit

# Delta chi squared of 16: detected in nearly every data set, corrected for a library of some 25 effects.
SEEN = 4.0
# Root of delta chi squared below which an effect, at its largest, explains nothing visible.
WORTH = 2.0
# Below this share an effect is a nuisance by another name.
ABSORBED = 2e-3

# A drifting zero equals slow noise: nothing would be left to estimate the noise by.
WANDERING = ("pressure_drift", "force_drift", "angle_drift")


def signatures(
    record: Record, simulator: Composite, values: Mapping[str, float], effects: Sequence[Effect] = ()
) -> Array:
    """Changes (N, m) of the prediction by every effect, small and at its starts, and by every nuisance.

    In the record's units (slopes also over the parameter's). values: by key; if they hold an effect, its
    columns are the derivatives by its parameters. effects: in addition to the simulator's, of one specimen or
    found before. Drifts of zeros are left out, and columns of zeros.
    """
    base = record.predict(simulator, values)
    columns: list[Array] = []

    def slope(key: str, at: float, step: float, by: float, beside: Mapping[str, float]) -> None:
        # A value without a prediction gives no slope.
        found = record.possible(simulator, {**values, **beside, key: at + step})
        if found is not None:
            columns.append((found - base) / by)

    for p in simulator.nuisances:
        if not p.linear:
            slope(p.name, values.get(p.name, p.null), abs(p.step), p.step, {})
    for e in (*simulator.effects, *effects):
        size = e.parameters[0]
        if e.name in WANDERING and e not in effects:
            continue
        if values.get(e.keys[0], size.null) != size.null:
            for key, p in zip(e.keys, e.parameters, strict=True):
                now = values.get(key, p.null)
                h = p.step if p.low <= now + p.step <= p.high else -p.step
                slope(key, now, h, h, {})
            continue
        for shape in e.shapes():
            slope(e.keys[0], size.null, size.step, size.step, shape)
        tried = (record.possible(simulator, {**values, **start}) for start in e.starts())
        columns += [found - base for found in tried if found is not None]
    return np.stack([c for c in columns if c.any()], axis=1) if columns else np.zeros((len(base), 0))


@attrs.frozen(eq=False)
class Sensitivity:
    """Whitened derivative of the data by the size of one effect, at its null, nuisances fitted too.

    column (N + m,): the part not absorbed by nuisances, for the best visible shape, and the cost of moving
    the m nuisances with prior knowledge; unabsorbed: its length over the length before; limit: size at which
    delta chi squared is 16, in the parameter's unit; absorbed_by: the nuisances that absorb most, each with
    its share of the rest; at_bounds: root of delta chi squared at the effect's largest size, nan if not
    computed.
    """

    effect: Effect
    shape: Mapping[str, float]
    column: Array
    unabsorbed: float
    limit: float
    absorbed_by: tuple[str, ...]
    at_bounds: float = math.nan

    @property
    def linear(self) -> bool:
        """True if the effect's detection limit, to first order, lies within its bounds."""
        p = self.effect.parameters[0]
        reach = max(abs(p.high - p.null), abs(p.low - p.null))
        return self.unabsorbed > ABSORBED and self.limit < reach

    @property
    def identifiable(self) -> bool:
        """True if the effect is above its detection limit at some size within its bounds.

        To first order (`linear`), or because `at_bounds` is at least `SEEN`; nuisances must not absorb it.
        """
        return self.linear or (self.unabsorbed > ABSORBED and self.at_bounds >= SEEN)

    @property
    def worth_a_fit(self) -> bool:
        """True if a fit is worthwhile: `linear`, or `at_bounds` at least `WORTH` and not absorbed."""
        return self.linear or (self.unabsorbed > ABSORBED and self.at_bounds >= WORTH)


def sensitivities(
    fitter: Fitter, values: Mapping[str, float], effects: Sequence[Effect] | None = None
) -> list[Sensitivity]:
    """Sensitivity of the data to every effect of the simulator, or to `effects`, in each shape, at its null.

    values: of the nuisances, by name and in their units, around which derivatives are taken. A nuisance at a
    bound absorbs nothing.
    """
    simulator = fitter.simulator
    base = fitter.predict(values)
    nuisances = []
    names: list[Parameter] = []
    for p in simulator.nuisances:
        column = _slope(fitter, values, p.name, p)
        # A nuisance at its bound cannot absorb more.
        if column.any() and p.low < values.get(p.name, p.null) < p.high:
            nuisances.append(column)
            names.append(p)
    n = fitter.project(np.stack(nuisances, axis=1), zeros=False) if nuisances else np.zeros((len(base), 0))
    # A nuisance with prior knowledge moves at a cost.
    prior = np.zeros((len(fitter.known), n.shape[1]))
    for row, known in enumerate(fitter.known):
        if known in names:
            prior[row, names.index(known)] = 1.0 / known.spread
    n = np.vstack([n, prior])
    lengths = np.linalg.norm(n, axis=0)
    q = np.linalg.qr(n)[0]
    found: list[Sensitivity] = []
    for e in simulator.effects if effects is None else effects:
        size = e.parameters[0]
        for shape in e.shapes():
            slope = _slope(fitter, {**values, **shape}, e.keys[0], size)
            if not slope.any():
                slope = _secant(fitter, {**values, **shape}, e)
            j = fitter.project(slope, zeros=False)
            j = np.concatenate([j, np.zeros(len(prior))])
            whole = float(np.linalg.norm(j))
            left: Array = j - q @ (q.T @ j)
            left -= q @ (q.T @ left)
            rest = float(np.linalg.norm(left))
            limit = SEEN / rest if rest > 1e-9 * whole and whole > 0 else math.inf
            absorbed = _absorbers(n, names, lengths, j) if whole > 0 else ()
            share = rest / whole if whole > 0 else 0.0
            found.append(Sensitivity(e, shape, left, share, limit, absorbed))
    return found


def _slope(fitter: Fitter, values: Mapping[str, float], key: str, p: Parameter) -> Array:
    """Derivative (N,) of the prediction by one value, central unless a bound is in the way.

    One-sided where the other side has no prediction. 0 where neither has: `Composite.refused` has the reason.
    """
    at, h = values.get(key, p.null), 1.0 if p.linear else 0.05 * p.step
    up = fitter.possible({**values, key: at + h})
    down = fitter.possible({**values, key: at - h}) if p.low <= at - h <= p.high else None
    if up is not None and down is not None:
        return np.asarray((up - down) / (2.0 * h))
    here = fitter.predict({**values, key: at})
    if up is not None:
        return np.asarray((up - here) / h)
    if down is not None:
        return np.asarray((here - down) / h)
    try:
        fitter.predict({**values, key: at + h})
    except MuError as error:
        fitter.simulator.refused[key.partition(".")[0]] = error.what
    return np.zeros_like(here)


def _secant(fitter: Fitter, values: Mapping[str, float], effect: Effect) -> Array:
    """Mean slope (N,) to the start that moves the prediction most, of an effect without slope at its null.

    A wall that the unit does not reach has no effect until it is near enough.
    """
    size, plain = effect.parameters[0], fitter.predict(values)
    tried = {s: fitter.possible({**values, effect.keys[0]: s}) for s in size.starts if s != size.null}
    slopes = [(found - plain) / (s - size.null) for s, found in tried.items() if found is not None]
    return max(slopes, key=lambda slope: float(np.linalg.norm(slope)), default=np.zeros_like(plain))


def _absorbers(n: Array, names: Sequence[Parameter], lengths: Array, j: Array) -> tuple[str, ...]:
    if not n.shape[1]:
        return ()
    by = np.linalg.lstsq(n / lengths, j, rcond=None)[0]
    order = np.argsort(-np.abs(by))
    most = float(np.abs(by[order[0]]))
    return tuple(names[i].name for i in order[:2] if abs(by[i]) > 0.3 * most > 0)


def best_seen(found: Sequence[Sensitivity]) -> dict[str, Sensitivity]:
    """The best visible shape of each effect, by its name: identifiable first, then least absorbed."""
    best: dict[str, Sensitivity] = {}
    for s in found:
        known = best.get(s.effect.name)
        if known is None or (s.identifiable, s.unabsorbed) > (known.identifiable, known.unabsorbed):
            best[s.effect.name] = s
    return best


def similarity(found: Sequence[Sensitivity]) -> Array:
    """Cosines (m, m) between the whitened signatures of m sensitivities, after nuisances were projected out.

    0 for an effect that nuisances absorb entirely.
    """
    columns = unit(np.stack([s.column if s.unabsorbed > ABSORBED else 0.0 * s.column for s in found], axis=1))
    return np.asarray(columns.T @ columns)
