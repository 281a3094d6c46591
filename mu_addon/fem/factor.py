"""Sparse symmetric factorisation by library: CHOLMOD with METIS ordering, or SuperLU without it."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from scipy import sparse

Array = np.ndarray[Any, Any]


class IndefiniteError(ArithmeticError):
    """The matrix is not positive definite: the state is not a stable equilibrium."""


def nested_dissection(pattern: sparse.csr_matrix) -> Array:
    """Fill-reducing order (n,) of the nodes of a symmetric pattern, by METIS."""
    import pymetis

    graph = pattern - sparse.diags(pattern.diagonal())
    graph = sparse.csr_matrix(graph)
    graph.eliminate_zeros()
    order, _ = pymetis.nested_dissection(
        adjacency=pymetis.CSRAdjacency(graph.indptr.astype(np.int64), graph.indices.astype(np.int64))
    )
    return np.asarray(order)


class Cholesky:
    """Cholesky factor of a symmetric positive definite matrix whose lower triangle keeps one pattern."""

    def __init__(self, indptr: Array, indices: Array, order: Array) -> None:
        # Read when cvxopt loads its own OpenBLAS. Its threads spin while they wait for each other on
        # the small dense blocks here: two made Model A four times slower than one.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        from cvxopt import cholmod, matrix, spmatrix

        n = len(indptr) - 1
        columns = np.repeat(np.arange(n), np.diff(indptr))
        cholmod.options["supernodal"] = 2
        self._matrix = spmatrix(1.0, matrix(indices.astype(np.int64)), matrix(columns), (n, n))
        self._factor = cholmod.symbolic(self._matrix, p=matrix(order.astype(np.int64)))
        self.size = n

    def factor(self, values: Array) -> Cholesky:
        """Factorise for the values (nnz,) of the lower triangle by columns. Raises IndefiniteError."""
        from cvxopt import cholmod, matrix

        self._matrix.V = matrix(values)
        try:
            cholmod.numeric(self._matrix, self._factor)
        except ArithmeticError as error:
            raise IndefiniteError(str(error)) from None
        return self

    def solve(self, b: Array) -> Array:
        """Solve for one (n,) or several (n, k) right-hand sides."""
        from cvxopt import cholmod, matrix

        x = matrix(np.asfortranarray(b if b.ndim == 2 else b[:, None]))
        cholmod.solve(self._factor, x)
        return np.array(x).reshape(b.shape) if b.ndim == 1 else np.array(x)


class SuperLU:
    """LU of the same matrix by scipy: several times slower, always installed."""

    def __init__(self, indptr: Array, indices: Array, order: Array) -> None:
        self._indptr, self._indices = indptr, indices
        self._order = order
        self.size = len(indptr) - 1

    def factor(self, values: Array) -> SuperLU:
        """Factorise for the values (nnz,) of the lower triangle by columns. Raises IndefiniteError."""
        from scipy.sparse.linalg import splu

        lower = sparse.csc_matrix((values, self._indices, self._indptr), shape=(self.size, self.size))
        full = lower + sparse.tril(lower, -1).T
        permuted = sparse.csc_matrix(full)[self._order][:, self._order]
        options = {"SymmetricMode": True}
        try:
            self._lu = splu(permuted.tocsc(), permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options)
        except RuntimeError as error:
            raise IndefiniteError(str(error)) from None
        if (self._lu.U.diagonal() <= 0).any():
            raise IndefiniteError("a pivot is not positive")
        return self

    def solve(self, b: Array) -> Array:
        """Solve for one (n,) or several (n, k) right-hand sides."""
        x = np.empty_like(b)
        x[self._order] = self._lu.solve(np.ascontiguousarray(b[self._order]))
        return x


def make_factor(indptr: Array, indices: Array, order: Array) -> Cholesky | SuperLU:
    """The best factorisation installed here."""
    try:
        return Cholesky(indptr, indices, order)
    except ImportError:
        return SuperLU(indptr, indices, order)
