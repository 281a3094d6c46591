"""Generalised least squares: nuisances, and parameters of effects, fitted to whitened records."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import MuError
from .effect import Effect, Parameter
from .noise import Source, Whitening, estimate
from .record import Record
from .scatter import bounded
from .simulator import Composite

ITERATIONS = 25
# Gain of chi squared below which a fit ends, at least; or share of its excess over the noise.
GAIN, RELATIVE = 1e-2, 1e-4
# A fit that is expected to gain less than this share of its excess over one from another start is ended.
ALIKE = 1e-3
# That is trusted of a fit that is expected to gain less than this share of its chi squared: far from its
# minimum, a wall that stops the unit promises a tenth of what it gains. Or of one expected to end within this
# share of the other's excess: it is on the way to the same minimum.
SETTLED, SAME = 0.2, 0.05
# Group of prior knowledge.
PRIOR = "known before"


@attrs.frozen(eq=False)
class Fit:
    """A model fitted to a record of N values: its effects, its fitted values and the residual.

    values: by key, each in its parameter's unit. chi2: sum of squares of the whitened residual (N,), with the
    linear nuisances (zeros) fitted, and of deviations from prior knowledge in standard deviations. keys (k,):
    free parameters. jacobian (N, k): whitened derivatives in the coordinates of the fit (logarithms where
    `logarithmic`), zeros projected out; covariance (k, k): of those coordinates. prior (m, k): derivatives of
    the m deviations from prior knowledge. Nuisances come before effects.
    """

    effects: tuple[Effect, ...]
    values: Mapping[str, float]
    chi2: float
    residual: Array
    keys: tuple[str, ...]
    jacobian: Array
    covariance: Array
    prior: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its effects, in the order of `effects`."""
        return tuple(e.name for e in self.effects)

    def sd(self, key: str) -> float:
        """Standard deviation of a free value, in its parameter's unit, by the curvature of chi squared.

        Raises ValueError for a key that was not free.
        """
        i = self.keys.index(key)
        slope = self.values[key] if self._logarithmic(key) else 1.0
        return abs(slope) * math.sqrt(max(float(self.covariance[i, i]), 0.0))

    def _logarithmic(self, key: str) -> bool:
        for e in self.effects:
            for name, p in zip(e.keys, e.parameters, strict=True):
                if name == key:
                    return logarithmic(p)
        return False


def logarithmic(p: Parameter) -> bool:
    """Return True if a parameter is fitted by its logarithm: low, null positive, high > 30 times low."""
    return p.low > 0 and p.high / p.low > 30 and p.null > 0


class Fitter:
    """Fits models to one record of N values by generalised least squares under given noise.

    sources: noise by group of series. kept (N,) bool: values that count, all by default. whitening: of the
    record by these sources, if already computed. Attributes: curved, nonlinear nuisances; known, those with
    prior knowledge; zeros_basis (N, z), orthonormal whitened columns that span the linear nuisances (zeros of
    channels).
    """

    def __init__(
        self,
        record: Record,
        simulator: Composite,
        sources: Mapping[str, Source],
        kept: Array | None = None,
        whitening: Whitening | None = None,
    ) -> None:
        self.record = record
        self.simulator = simulator
        self.sources = dict(sources)
        self._kept = kept
        self.whitening = whitening or Whitening(record, sources)
        base = record.predict(simulator, {})
        self._linear: list[Parameter] = []
        columns = []
        for p in simulator.nuisances:
            if p.linear:
                column = record.predict(simulator, {p.name: p.null + 1.0}) - base
                if column.any():
                    self._linear.append(p)
                    columns.append(column)
        self.curved = tuple(p for p in simulator.nuisances if not p.linear)
        self.known = tuple(p for p in self.curved if math.isfinite(p.spread))
        white = self.whitened(np.stack(columns, axis=1)) if columns else np.zeros((len(record), 0))
        self.zeros_basis, r = np.linalg.qr(white)
        # A zero whose channel is left out altogether stays as it is.
        self._of_zeros = np.linalg.pinv(r, rcond=1e-11)
        self._own: dict[Fit, tuple[Fitter, Fit]] = {}
        self._left_out: dict[tuple[bytes, Fit], float] = {}

    def without(self, left_out: Array) -> Fitter:
        """A fitter to the same record and noise that ignores the values where left_out (N,) is True."""
        kept = ~left_out if self._kept is None else self._kept & ~left_out
        return Fitter(self.record, self.simulator, self.sources, kept, self.whitening)

    def left_out(self, rows: Array, model: Fit) -> float:
        """Chi squared of the values rows (N,) under a model fitted to the others; inf without prediction."""
        key = rows.tobytes(), model
        if key not in self._left_out:
            found = self.without(rows).fit(model.effects, model.values)
            predicted = self.possible(found.values)
            r = None if predicted is None else self.whitening(self.record.values - predicted)[rows]
            self._left_out[key] = math.inf if r is None else float(r @ r)
        return self._left_out[key]

    def whitened(self, columns: Array) -> Array:
        """Columns (N,) or (N, k) in the record's units, whitened; 0 where values do not count."""
        w = self.whitening(columns)
        if self._kept is not None:
            w[~self._kept] = 0.0
        return w

    def project(self, columns: Array, zeros: bool = True) -> Array:
        """Columns (N,) or (N, k) whitened and, if `zeros`, orthogonal to the linear nuisances."""
        w = self.whitened(columns)
        return w - self.zeros_basis @ (self.zeros_basis.T @ w) if zeros and self.zeros_basis.shape[1] else w

    def deviance(self, fit: Fit) -> dict[str, float]:
        """-2 log likelihood of a fit, by group of series and of `PRIOR` (knowledge before any data).

        Without the constant of the normal density: log determinant of the covariance plus squared whitened
        residual.
        """
        found = dict(self.whitening.log_dets)
        # Prior knowledge has a likelihood as well.
        found[PRIOR] = fit.chi2 - float(fit.residual @ fit.residual)
        for s in self.record.series:
            r = fit.residual[s.at]
            found[s.group] = found.get(s.group, 0.0) + float(r @ r)
        return found

    def under_its_own_noise(self, fit: Fit) -> tuple[Fitter, Fit]:
        """A fitter with the noise of a fit's residual, as if that had no cause, and the fit redone by it.

        Only a constant is set aside in each series (`noise.estimate`), and no more is noise than the readings
        show (`scatter.bounded`). Results are kept by fit.
        """
        if fit not in self._own:
            left = self.record.values - self.predict(fit.values)
            constant = [np.ones((s.at.stop - s.at.start, 1)) for s in self.record.series]
            sources = bounded(self.record, estimate(self.record, left, constant))
            own = Fitter(self.record, self.simulator, sources)
            self._own[fit] = own, own.fit(fit.effects, fit.values)
        return self._own[fit]

    def driven_again(self, fit: Fit) -> Fitter | None:
        """A fitter to a fit's noise-free prediction, whose model is driven by a second reading of the gauges.

        The second reading is `Record.again`. A gain in chi squared there is due to the gauges' noise alone.
        None where the gauges have no noise.
        """
        record = self.record
        if record.again is None:
            return None
        values = self.predict(fit.values)
        other = attrs.evolve(record, experiments=record.again, values=values, again=None)
        return Fitter(other, self.simulator, self.sources, self._kept, self.whitening)

    def zeros(self, left: Array) -> dict[str, float]:
        """Values of the linear nuisances, by name and in their units, that fit `left` best.

        left (N,): residual, not whitened, in the units of the record.
        """
        if not self._linear:
            return {}
        found = self._of_zeros @ (self.zeros_basis.T @ self.whitened(left))
        return {p.name: p.null + float(z) for p, z in zip(self._linear, found, strict=True)}

    def predict(self, values: Mapping[str, float]) -> Array:
        """Prediction (N,) in the record's units, not whitened, for values by key; nulls where missing."""
        return self.record.predict(self.simulator, values)

    def possible(self, values: Mapping[str, float]) -> Array | None:
        """Return `predict`; None where the model has no finite prediction (`Record.possible`)."""
        return self.record.possible(self.simulator, values)

    def response(self, values: Mapping[str, float], record: Record | None = None) -> Array:
        """Change (N,) of a record's prediction by the first nuisance that is not a zero; ones without any.

        record: another one than the fitter's own.
        """
        record = record or self.record
        if not self.curved:
            return np.ones(len(record))
        p = self.curved[0]
        moved = record.predict(self.simulator, {**values, p.name: values[p.name] + p.step})
        return np.asarray((moved - record.predict(self.simulator, values)) / p.step)

    def fit(
        self,
        effects: Sequence[Effect] = (),
        start: Mapping[str, float] | None = None,
        fixed: Mapping[str, float] | None = None,
        reached: float = math.inf,
    ) -> Fit:
        """Minimise chi squared over the nuisances and the parameters of `effects`, from one start.

        start: values by key, by default the first start of a parameter, else its null. fixed: values by key
        that are held; a held value costs its deviation from prior knowledge. Values are in the parameters'
        units. reached: chi squared of a fit from another start; a fit that has settled, or nears the same
        minimum, and is not expected to fall below it ends. Damped Gauss-Newton steps (Levenberg and
        Marquardt) within the bounds, with finite-difference derivatives and at most `ITERATIONS` steps.
        Values without a prediction (`possible`) count as infinitely bad; raises the prediction's error if the
        start is one.
        """
        start, fixed = start or {}, dict(fixed or {})
        free: list[tuple[str, Parameter]] = [(p.name, p) for p in self.curved]
        for e in effects:
            free += zip(e.keys, e.parameters, strict=True)
        free = [(k, p) for k, p in free if k not in fixed]
        first = {k: p.starts[0] if p.starts else p.null for k, p in free}
        logs = np.array([logarithmic(p) for _, p in free], bool)
        x = np.array([start.get(k, first[k]) for k, _ in free], float)
        low, high = (np.array([getattr(p, side) for _, p in free], float) for side in ("low", "high"))
        with np.errstate(divide="ignore", invalid="ignore"):
            x, low, high = (np.where(logs, np.log(np.abs(v)), v) for v in (x, low, high))
        step = np.array([1e-3 if log else abs(p.step) for log, (_, p) in zip(logs, free, strict=True)])
        keys = tuple(k for k, _ in free)
        measured = self.record.values
        known = [(i, p) for i, (_, p) in enumerate(free) if math.isfinite(p.spread)]
        # Holding a value costs its deviation from prior knowledge.
        held = sum(((p.null - fixed[p.name]) / p.spread) ** 2 for p in self.known if p.name in fixed)

        def at(x: Array) -> dict[str, float]:
            return fixed | dict(
                zip(keys, np.where(logs, np.exp(np.where(logs, x, 0.0)), x).tolist(), strict=True)
            )

        def prior(x: Array) -> Array:
            return np.array([(p.null - x[i]) / p.spread for i, p in known])

        f = self.predict(at(x))
        r = np.concatenate([self.project(measured - f), prior(x)])
        chi2, damping = float(r @ r), 1e-4
        jacobian = np.zeros((len(r), len(x)))
        for _ in range(ITERATIONS):
            if not len(x):
                break
            shifted = np.empty((len(f), len(x)), order="F")
            for i in range(len(x)):
                h = step[i] if x[i] + step[i] <= high[i] else -step[i]
                shifted[:, i] = 0.0
                # Beside values without a prediction the other side may have one.
                for side in (h, -h):
                    moved = x.copy()
                    moved[i] += side
                    if (f_moved := self.possible(at(moved))) is not None:
                        shifted[:, i] = (f_moved - f) / side
                        break
            jacobian = np.zeros((len(r), len(x)), order="F")
            jacobian[: len(f)] = self.project(shifted)
            for row, (i, p) in enumerate(known):
                jacobian[len(f) + row, i] = 1.0 / p.spread
            gram, gradient = jacobian.T @ jacobian, jacobian.T @ r
            end = max(GAIN, RELATIVE * (chi2 - len(f)))
            if math.isfinite(reached):
                promised = float(gradient @ _step(gram, gradient, 1e-9, x, low, high))
                expected, excess = chi2 + held - promised, reached - len(f)
                sure = promised < SETTLED * chi2 or expected < reached + SAME * excess
                if sure and expected > reached - max(GAIN, ALIKE * excess):
                    break
            gained, accepted = 0.0, False
            for _ in range(8):
                new = np.clip(x + _step(gram, gradient, damping, x, low, high), low, high)
                f_new, chi2_new = self.possible(at(new)), math.inf
                if f_new is not None:
                    r_new = np.concatenate([self.project(measured - f_new), prior(new)])
                    chi2_new = float(r_new @ r_new)
                if f_new is not None and chi2_new <= chi2:
                    gained, accepted = chi2 - chi2_new, True
                    x, f, r, chi2 = new, f_new, r_new, chi2_new
                    damping = max(damping / 10.0, 1e-9)
                    break
                damping = max(damping * 10.0, 1e-6)
            if not accepted or gained < end:
                break
        return self._finished(tuple(effects), at(x), chi2 + held, r[: len(f)], f, keys, jacobian, measured)

    def _finished(
        self,
        effects: tuple[Effect, ...],
        values: dict[str, float],
        chi2: float,
        residual: Array,
        f: Array,
        keys: tuple[str, ...],
        jacobian: Array,
        measured: Array,
    ) -> Fit:
        values |= self.zeros(measured - f)
        # Columns of unit length: the rank must not depend on units.
        length = np.linalg.norm(jacobian, axis=0)
        length[length == 0.0] = 1.0
        unit = jacobian / length
        covariance = np.zeros((0, 0))
        if len(keys):
            covariance = np.linalg.pinv(unit.T @ unit, rcond=1e-12, hermitian=True) / np.outer(length, length)
        n = len(f)
        return Fit(effects, values, chi2, residual, keys, jacobian[:n], covariance, jacobian[n:])

    def best(self, effects: Sequence[Effect], starts: Sequence[Mapping[str, float]]) -> Fit:
        """The fit of least chi squared among those from each of the starts (see `fit`), one or more.

        Of infinite chi squared where no start has a prediction; `Composite.refused` has the reason.
        """
        best, why = None, ""
        for start in starts:
            try:
                fit = self.fit(effects, start, reached=best.chi2 if best else math.inf)
            except MuError as error:
                why = error.what
                continue
            if best is None or fit.chi2 < best.chi2:
                best = fit
        if best is not None:
            return best
        self.simulator.refused[" with ".join(e.title for e in effects)] = why
        return _impossible(effects, starts[0], len(self.record))


def _impossible(effects: Sequence[Effect], values: Mapping[str, float], n: int) -> Fit:
    """A fit of n values by a model that has no prediction."""
    keys = tuple(key for e in effects for key in e.keys)
    k, residual = len(keys), np.full(n, math.inf)
    nothing = np.zeros((n, k)), np.full((k, k), math.inf), np.zeros((0, k))
    return Fit(tuple(effects), dict(values), math.inf, residual, keys, *nothing)


def _step(gram: Array, gradient: Array, damping: float, x: Array, low: Array, high: Array) -> Array:
    """Damped Gauss-Newton step; coordinates at a bound that it would leave stay fixed."""
    free = ~(((x <= low) & (gradient < 0)) | ((x >= high) & (gradient > 0)))
    free &= np.diag(gram) > 0
    step = np.zeros_like(x)
    if free.any():
        inner = gram[np.ix_(free, free)]
        scale = np.sqrt(np.diag(inner))
        scaled = inner / np.outer(scale, scale) + damping * np.eye(len(scale))
        step[free] = np.linalg.solve(scaled, gradient[free] / scale) / scale
    return step


def interval(fitter: Fitter, fit: Fit, key: str, rise: float = 3.84) -> tuple[float, float]:
    """Confidence interval (low, high) of a fitted value, in its parameter's unit, by profile likelihood.

    At the ends chi squared, with all else fitted again, has risen by `rise` (3.84: 95 %). The ends are the
    parameter's bounds if these are nearer or the value has no finite standard deviation.
    """
    p = next(
        (p for e in fit.effects for name, p in zip(e.keys, e.parameters, strict=True) if name == key),
        None,
    ) or next(p for p in fitter.curved if p.name == key)
    log = logarithmic(p)
    centre = math.log(fit.values[key]) if log else fit.values[key]
    scale = fit.sd(key) / (fit.values[key] if log else 1.0)
    if not (math.isfinite(scale) and scale > 0.0):
        return p.low, p.high
    found = []
    for sign, bound in ((-1.0, p.low), (1.0, p.high)):
        limit = math.log(bound) if log else bound
        inner, outer, value = 0.0, math.inf, math.sqrt(rise)
        for _ in range(7):
            at = centre + sign * value * scale
            if (limit - at) * sign <= 0.0:
                at, value = limit, abs(limit - centre) / scale
            fixed = {key: math.exp(at) if log else at}
            try:
                risen = fitter.fit(fit.effects, fit.values, fixed).chi2 - fit.chi2
            except MuError:
                # Without a prediction it cannot be the value.
                risen = math.inf
            if abs(risen - rise) < 0.2 or (risen < rise and at == limit):
                break
            inner, outer = (value, outer) if risen < rise else (inner, value)
            grown = value * min(math.sqrt(rise / max(risen, 0.1)), 3.0)
            value = grown if inner < grown < outer else 0.5 * (inner + min(outer, 4.0 * inner + value))
        else:
            at = centre + sign * value * scale
        found.append(bound if at == limit else math.exp(at) if log else at)
    return found[0], found[1]


def interval_by_curvature(fit: Fit, key: str) -> tuple[float, float]:
    """The 95 % interval (low, high) of a fitted value by the curvature of chi squared, in its unit."""
    return fit.values[key] - 1.96 * fit.sd(key), fit.values[key] + 1.96 * fit.sd(key)
