"""A polynomial that stands in for many solves, and how much of a figure's variance each input makes."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

Array = np.ndarray[Any, Any]

# A term is taken as long as it lowers the error of points left out by this share.
_WORTH = 0.02
# Points on which variances are estimated; a power of two, as Sobol sequences like it.
_POINTS = 4096


@attrs.frozen(eq=False)
class Surrogate:
    """Sum of products of Legendre polynomials of places in [0, 1), of degree 2 at most.

    powers (t, d): degree of each input in each term; weights (t,). Q2: share of the variance of points left
    out, one at a time, that it predicts.
    """

    powers: Array
    weights: Array
    Q2: float

    def __call__(self, places: Array) -> Array:
        """Values (n,) at places (n, d)."""
        return np.asarray(_terms(places, self.powers) @ self.weights)


@attrs.frozen(eq=False)
class Shares:
    """Shares (d,) of a figure's variance: by an input alone, and with all that it does together with others.

    Saltelli et al. 2010, Comput. Phys. Commun. 181, as in scipy.stats.sobol_indices.
    """

    first: Array
    total: Array


def fit(places: Array, values: Array) -> Surrogate:
    """The surrogate of values (n,) at places (n, d), term by term as they help points left out.

    The error of a point left out is its residual over 1 - leverage (PRESS, Allen 1974); Blatman and Sudret
    2010, J. Comput. Phys. 230, choose terms of a polynomial chaos so.
    """
    n, d = places.shape
    offered = _powers(d)
    columns = _terms(places, offered)
    variance = float(((values - values.mean()) ** 2).sum())
    if variance == 0.0:
        return Surrogate(offered[:1], np.array([values[0]]), 1.0)
    taken = [0]
    error = _press(columns[:, taken], values)
    while len(taken) < n // 2:
        rest = [i for i in range(len(offered)) if i not in taken]
        if not rest:
            break
        errors = [_press(columns[:, [*taken, i]], values) for i in rest]
        best = int(np.argmin(errors))
        if errors[best] > (1 - _WORTH) * error:
            break
        taken.append(rest[best])
        error = errors[best]
    weights, *_ = np.linalg.lstsq(columns[:, taken], values, rcond=None)
    return Surrogate(offered[taken], weights, 1.0 - error / variance)


def shares(function: Callable[[Array], Array], count: int, seed: int = 1) -> Shares:
    """Sobol's first and total indices of a function of places (n, count), uniform in [0, 1)."""
    from scipy.stats import sobol_indices, uniform

    found = sobol_indices(
        func=lambda x: function(x.T)[None],
        n=_POINTS,
        dists=[uniform() for _ in range(count)],
        rng=np.random.default_rng(seed),
    )
    first, total = (np.clip(np.ravel(v), 0.0, 1.0) for v in (found.first_order, found.total_order))
    return Shares(first, total)


def _powers(d: int) -> Array:
    """Exponents (t, d) of all products of degree 2 at most, the constant first."""
    found = [np.zeros(d, int)]
    for degree in (1, 2):
        for inputs in itertools.combinations_with_replacement(range(d), degree):
            found.append(np.bincount(inputs, minlength=d))
    return np.array(found)


def _terms(places: Array, powers: Array) -> Array:
    """Values (n, t) of the terms, orthonormal over the cube."""
    x = 2 * np.asarray(places, float) - 1
    legendre = np.stack([np.ones_like(x), np.sqrt(3) * x, np.sqrt(5) * (1.5 * x**2 - 0.5)])
    inputs = np.arange(x.shape[1])
    return np.stack([legendre[p, :, inputs].prod(axis=0) for p in powers], axis=1)


def _press(columns: Array, values: Array) -> float:
    """Sum of squares of the errors of points left out, of a least-squares fit."""
    q, _ = np.linalg.qr(columns)
    leverage = (q**2).sum(axis=1)
    residual: Array = values - q @ (q.T @ values)
    return float(((residual / np.maximum(1 - leverage, 1e-6)) ** 2).sum())
