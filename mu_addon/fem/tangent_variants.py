"""Variants of one tangent, each with a change, solved together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import scipy.linalg

from .conjugate_gradients import Change, Changes, ConjugateGradients
from .factor import IndefiniteError, make_factor
from .model import Model
from .sparsity import Pattern
from .triangular import Triangular

Array = np.ndarray[Any, Any]


class SharedTangent(Protocol):
    """Solver of variants: takes the shared tangent and each variant's change, then solves for all at once."""

    def factor(self, values: Array) -> None:
        """Factorise the shared tangent's values (nnz,) in N/mm; raises IndefiniteError."""

    def take(self, change: Change) -> Any:
        """Prepare a variant's change for `solve`. Raises IndefiniteError."""

    def solve(self, b: Array, taken: Sequence[Any]) -> Sequence[Array | None]:
        """A variant's solution (n,) for each right-hand side of b (k, n), None where it was not found."""


class DirectVariants:
    """Solves by one Cholesky factor.

    The unknowns that any variant changes, `changed`, are eliminated last. Their Schur complement is common to
    all variants, and each adds its change to it.
    """

    def __init__(self, pattern: Pattern, changed: Array, threads: int) -> None:
        kept_last, self._kept = _keeping_last(pattern, changed)
        self._nonzeros = len(kept_last.indices)
        self._factor = make_factor(kept_last.indptr, kept_last.indices, kept_last.order)
        self._threads = threads
        self._count = len(changed)
        # Where an unknown of the body is among the changed ones.
        self._place = np.full(len(pattern.order), -1)
        self._place[changed] = np.arange(len(changed))

    def factor(self, values: Array) -> None:
        """Factorise the shared tangent's values (nnz,). Raises IndefiniteError."""
        spread = np.zeros(self._nonzeros)
        spread[self._kept] = values
        self._factor.factor(spread)
        self._shared = Triangular(self._factor.lower(), self._count, self._threads)
        # The factor's own order of the last unknowns, among the changed ones.
        self._turned = self._place[self._shared.order[self._shared.inner :]]
        remaining = np.empty_like(self._shared.schur)
        remaining[np.ix_(self._turned, self._turned)] = self._shared.schur
        self._flexibility = _inverse(remaining)

    def take(self, change: Change) -> _Correction:
        """Prepare a variant's change for `solve`, by the Woodbury formula; after `factor`."""
        return _Correction(self._flexibility, self._place[change.unknowns], change.matrix.toarray())

    def solve(self, b: Array, taken: Sequence[_Correction]) -> Sequence[Array]:
        """A variant's solution (n,) for each right-hand side of b (k, n), in single precision.

        taken: result of `take` for each of the k variants.
        """
        back = np.argsort(self._turned)

        def solve_trailing(g: Array) -> Array:
            x = g[:, back] @ self._flexibility
            return np.array([c(row) for c, row in zip(taken, x, strict=True)])[:, self._turned]

        return list(self._shared.solve(b, solve_trailing))


class IterativeVariants:
    """Solves by conjugate gradients on a device, all variants in one run."""

    def __init__(self, gradients: ConjugateGradients) -> None:
        self._gradients = gradients
        self._stacked: tuple[list[Change], Changes] | None = None

    def factor(self, values: Array) -> None:
        """Factorise the shared tangent's values (nnz,). Raises IndefiniteError."""
        self._gradients.factor(values)
        self._stacked = None

    def take(self, change: Change) -> Change:
        """Prepare a variant's change for `solve`.

        Raises IndefiniteError where the change leaves a diagonal entry of the matrix 0 or less.
        """
        if (self._gradients.diagonal[change.unknowns] + change.matrix.diagonal() <= 0).any():
            raise IndefiniteError("a variant leaves an unknown without stiffness")
        return change

    def solve(self, b: Array, taken: Sequence[Change]) -> list[Array | None]:
        """A variant's solution (n,) for each right-hand side of b (k, n), None where it was not found."""
        changes = list(taken)
        if self._stacked is None or self._stacked[0] != changes:
            self._stacked = changes, self._gradients.changes(changes)
        x, solved = self._gradients.solve_changed(b, self._stacked[1])
        return [row if good else None for row, good in zip(x, solved, strict=True)]


def make_variants(model: Model, changed: Array) -> SharedTangent:
    """Solver for a body's variants on its device: `IterativeVariants` or `DirectVariants`.

    changed (c,): numbers of the free unknowns that any variant changes.
    """
    # Not asked for where it is not used: a factorisation's analysis takes a while.
    solver = model.factor if model.solver == "conjugate gradients" else None
    if isinstance(solver, ConjugateGradients):
        return IterativeVariants(solver)
    return DirectVariants(model.pattern, changed, model.threads)


def _keeping_last(pattern: Pattern, last: Array) -> tuple[Pattern, Array]:
    """A pattern whose order ends with some unknowns, and the positions of its entries in it.

    A factorisation is free to renumber as long as it makes the same fill, and so may take some of the last
    unknowns earlier. Entries between the unknown before them and all of them forbid it.
    """
    is_last = np.zeros(len(pattern.order), dtype=bool)
    is_last[last] = True
    order = pattern.order
    order = np.concatenate([order[~is_last[order]], order[is_last[order]]])
    before = order[len(order) - len(last) - 1]
    n = len(order)
    keys = np.repeat(np.arange(n), np.diff(pattern.indptr)) * n + pattern.indices
    added = np.minimum(last, before) * n + np.maximum(last, before)
    every = np.union1d(keys, added)
    indptr = np.zeros(n + 1, dtype=np.int64)
    np.cumsum(np.bincount(every // n, minlength=n), out=indptr[1:])
    return Pattern(indptr, every % n, order), np.searchsorted(every, keys)


class _Correction:
    """Solves (S + change) x = g, given y = S^-1 g, by the Woodbury formula on the changed unknowns."""

    def __init__(self, flexibility: Array, places: Array, matrix: Array) -> None:
        self._places, self._matrix = places, matrix
        within = flexibility[np.ix_(self._places, self._places)]
        self._factor = scipy.linalg.lu_factor(
            np.eye(len(self._places)) + within @ self._matrix, check_finite=False
        )
        self._columns = flexibility[:, self._places]

    def __call__(self, y: Array) -> Array:
        inside = scipy.linalg.lu_solve(self._factor, y[self._places], check_finite=False)
        return y - self._columns @ (self._matrix @ inside)


def _inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix (n, n)."""
    factor = scipy.linalg.cho_factor(matrix, lower=True, check_finite=False)
    inverse: Array = scipy.linalg.cho_solve(factor, np.eye(len(matrix)), check_finite=False)
    return inverse
