"""A Gaussian process through values and slopes, to predict between computed designs.

A slope is an observation like a value, so that one simulation with its gradient is worth one more simulation
for every freedom. Squared exponential covariance with a length for each coordinate, by the largest marginal
likelihood over a few. Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, ch. 5
and sec. 9.4.
"""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array

LENGTHS = (0.25, 0.5, 1.0, 2.0, 4.0)
NOISE = 1e-4
"""Standard error of a value and of a slope, as a share of their spread: mesh noise, and a regularisation."""


@attrs.frozen(eq=False)
class Surrogate:
    """A quantity over designs in the unit cube; `mean` predicts it."""

    x: Array
    lengths: Array
    centre: float
    size: float
    _which: Array
    _weights: Array

    @classmethod
    def of(cls, x: Array, y: Array, slopes: Array) -> Surrogate:
        """Surrogate of values y (n,) and slopes (n, d) at x (n, d); nan slopes are unknown."""
        centre = float(y.mean())
        known = slopes[np.isfinite(slopes)]
        steepest = np.sqrt(np.mean(known**2)) if len(known) else 0.0
        size = float(max(y.std(), steepest, 1e-12 * (1 + abs(centre))))
        observed = np.concatenate([((y - centre) / size)[:, None], slopes / size], axis=1).ravel()
        which = np.flatnonzero(np.isfinite(observed))
        observed = observed[which]
        d = x.shape[1]
        best: tuple[float, Array, Array] | None = None
        lengths = np.ones(d)
        candidates = [np.full(d, length) for length in LENGTHS]
        for round_ in range(1 + d):
            for trial in candidates:
                found = _fitted(x, trial, which, observed)
                if found is not None and (best is None or found[0] > best[0]):
                    best = (found[0], trial, found[1])
            if best is None:
                raise ArithmeticError("no covariance of the designs can be factorised")
            lengths = best[1]
            if round_ < d:
                candidates = [np.where(np.arange(d) == round_, f * lengths, lengths) for f in (0.5, 2.0)]
        assert best is not None
        return cls(x, best[1], centre, size, which, best[2])

    def mean(self, at: Array) -> Array:
        """Expected values (m,) at designs (m, d)."""
        return self.centre + self.size * (self._between(at) @ self._weights)

    def _between(self, at: Array) -> Array:
        """Covariances (m, o) of values at designs with the observations."""
        step = at[:, None, :] - self.x[None, :, :]
        near = step / self.lengths**2
        k = np.exp(-0.5 * (step * near).sum(axis=2))
        return np.concatenate([k[..., None], k[..., None] * near], axis=2).reshape(len(at), -1)[
            :, self._which
        ]


def _fitted(x: Array, lengths: Array, which: Array, observed: Array) -> tuple[float, Array] | None:
    """Log likelihood and weights for some lengths, None where they are not definite."""
    from scipy.linalg import cho_solve

    matrix = _covariance(x, lengths)[np.ix_(which, which)]
    matrix[np.diag_indices_from(matrix)] *= 1.0 + NOISE**2
    matrix[np.diag_indices_from(matrix)] += NOISE**2
    try:
        factor = np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError:
        return None
    weights = cho_solve((factor, True), observed)
    n = len(observed)
    variance = max(float(observed @ weights) / n, 1e-300)
    return -0.5 * n * np.log(variance) - float(np.log(np.diag(factor)).sum()), weights


def _covariance(x: Array, lengths: Array) -> Array:
    """Covariance (n (d + 1), n (d + 1)) of values and slopes at x (n, d), design by design."""
    n, d = x.shape
    step = x[:, None, :] - x[None, :, :]
    near = step / lengths**2
    k = np.exp(-0.5 * (step * near).sum(axis=2))
    found = np.empty((n, d + 1, n, d + 1))
    found[:, 0, :, 0] = k
    found[:, 0, :, 1:] = k[..., None] * near
    found[:, 1:, :, 0] = -(k[..., None] * near).transpose(0, 2, 1)
    both = np.diag(1 / lengths**2)[None, None] - near[..., :, None] * near[..., None, :]
    found[:, 1:, :, 1:] = (k[..., None, None] * both).transpose(0, 2, 1, 3)
    return found.reshape(n * (d + 1), n * (d + 1))


def fit_all(x: Array, values: Array, slopes: Array) -> Sequence[Surrogate]:
    """A surrogate for each of q quantities: values (n, q), slopes (n, q, d)."""
    return [Surrogate.of(x, values[:, i], slopes[:, i]) for i in range(values.shape[1])]
