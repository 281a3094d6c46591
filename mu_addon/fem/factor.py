"""Sparse symmetric factorisation by library: CHOLMOD with METIS ordering, or the alternative installed."""

from __future__ import annotations

import os
from functools import cache
from typing import Any

import numpy as np
from scipy import sparse

from ..arrays import Array
from .triangular import Lower


class IndefiniteError(ArithmeticError):
    """The matrix is not positive definite: the state is not a stable equilibrium."""


def nested_dissection(pattern: sparse.csr_matrix) -> Array:
    """Fill-reducing order (n,) of the nodes of a symmetric pattern, by METIS.

    By minimum degree without pymetis, which has no wheel for Windows: a factor of the default unit then took
    0.50 instead of 0.44 s.
    """
    graph = pattern - sparse.diags(pattern.diagonal())
    graph = sparse.csr_matrix(graph)
    graph.eliminate_zeros()
    try:
        import pymetis
    except ImportError:
        return _minimum_degree(graph)
    order, _ = pymetis.nested_dissection(
        adjacency=pymetis.CSRAdjacency(graph.indptr.astype(np.int64), graph.indices.astype(np.int64))
    )
    return np.asarray(order)


def _minimum_degree(graph: sparse.csr_matrix) -> Array:
    """Order (n,) of the nodes of a graph by approximate minimum degree, or as given without cvxopt."""
    try:
        _load_cvxopt()
        from cvxopt import amd, matrix, spmatrix
    except ImportError:
        return np.arange(graph.shape[0])
    lower = sparse.tril(graph).tocoo()
    rows, columns = (matrix(part.astype(np.int64)) for part in (lower.row, lower.col))
    return np.array(amd.order(spmatrix(1.0, rows, columns, graph.shape))).ravel().astype(np.int64)


@cache
def _load_cvxopt() -> None:
    """Load cvxopt, whose OpenBLAS reads these variables on loading. Raises ImportError."""
    # Its threads spin while they wait for each other on the small dense blocks here: two made Model A four
    # times slower than one.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    name, chosen = "OPENBLAS_CORETYPE", "OPENBLAS_CORETYPE" in os.environ
    if not chosen:
        # Its version, 0.3.15, treats processors younger than itself as one of 2004.
        os.environ[name] = _kernels()
    try:
        import cvxopt.cholmod  # noqa: F401
    finally:
        if not chosen:
            # numpy's OpenBLAS, which other processes load, is newer and knows them.
            del os.environ[name]


def _kernels() -> str:
    """OpenBLAS's name of the kernels for this processor; empty to let it choose."""
    # numpy 1.26 has types for less.
    show: Any = np.show_config
    simd = show(mode="dicts")["SIMD Extensions"]
    able = {*simd["baseline"], *simd["found"]}
    if able & {"AVX512_SKX", "X86_V4"}:
        return "SkylakeX"
    return "Haswell" if able & {"AVX2", "X86_V3"} else ""


class Cholesky:
    """Cholesky factor, by CHOLMOD, of symmetric positive definite matrices of one pattern.

    indptr (n + 1,), indices (nnz,): the lower triangle by columns; order (n,): a fill-reducing permutation.
    Raises ImportError where cvxopt is missing.
    """

    def __init__(self, indptr: Array, indices: Array, order: Array) -> None:
        _load_cvxopt()
        from cvxopt import cholmod, matrix, spmatrix

        n = len(indptr) - 1
        columns = np.repeat(np.arange(n), np.diff(indptr))
        cholmod.options["supernodal"] = 2
        self._matrix = spmatrix(1.0, matrix(indices.astype(np.int64)), matrix(columns), (n, n))
        self._order = matrix(order.astype(np.int64))
        self._analyse()
        self.size = n

    def _analyse(self) -> None:
        from cvxopt import cholmod

        # Only the order given, not the best of several; the options are the whole process's.
        cholmod.options["nmethods"] = 1
        try:
            self._factor = cholmod.symbolic(self._matrix, p=self._order)
        finally:
            del cholmod.options["nmethods"]

    def factor(self, values: Array) -> Cholesky:
        """Factorise for the values (nnz,) of the lower triangle by columns, in the pattern's order.

        Returns itself. Raises IndefiniteError where the matrix is not positive definite.
        """
        from cvxopt import cholmod, matrix

        self._matrix.V = matrix(values)
        try:
            cholmod.numeric(self._matrix, self._factor)
        except ArithmeticError as error:
            raise IndefiniteError(str(error)) from None
        return self

    def solve(self, b: Array) -> Array:
        """Solve for one (n,) or several (n, k) right-hand sides; the result has the same shape."""
        from cvxopt import cholmod, matrix

        x = matrix(np.asfortranarray(b if b.ndim == 2 else b[:, None]))
        cholmod.solve(self._factor, x)
        return np.array(x).reshape(b.shape) if b.ndim == 1 else np.array(x)

    def lower(self) -> Lower:
        """The factor L with its order, as `Lower`; `factor` must be called again before `solve`."""
        from cvxopt import cholmod, matrix

        places = matrix(np.arange(self.size, dtype=float))
        cholmod.solve(self._factor, places, sys=7)
        order = np.array(places).ravel().astype(np.int64)
        # Through a memoryview, which keeps the memory that cvxopt's matrices lend.
        columns = cholmod.getfactor(self._factor).CCS
        indptr, indices, values = (np.asarray(memoryview(a)).ravel() for a in columns)
        # Otherwise leftover columns would be factorised singly, without dense blocks.
        self._analyse()
        return Lower(order, indptr, indices.astype(np.int32), values)


class SuperLU:
    """LU of the same matrix by scipy, with the same arguments: several times slower, always installed."""

    def __init__(self, indptr: Array, indices: Array, order: Array) -> None:
        self._indptr, self._indices = indptr, indices
        self._order = order
        self.size = len(indptr) - 1

    def factor(self, values: Array) -> SuperLU:
        """Factorise for the values (nnz,) of the lower triangle by columns, in the pattern's order.

        Returns itself. Raises IndefiniteError where the matrix is singular or a pivot is not positive.
        """
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
        """Solve for one (n,) or several (n, k) right-hand sides; the result has the same shape."""
        x = np.empty_like(b)
        x[self._order] = self._lu.solve(np.ascontiguousarray(b[self._order]))
        return x

    def lower(self) -> Lower:
        """The Cholesky factor L with its order, from the LU of a symmetric matrix: L sqrt(diag U)."""
        order = np.empty(self.size, dtype=np.int64)
        order[self._lu.perm_r] = self._order
        scaled = sparse.csc_matrix(self._lu.L @ sparse.diags(np.sqrt(self._lu.U.diagonal())))
        scaled.sort_indices()
        return Lower(order, scaled.indptr.astype(np.int64), scaled.indices, scaled.data)


def make_factor(indptr: Array, indices: Array, order: Array) -> Cholesky | SuperLU:
    """The fastest factorisation installed: `Cholesky`, or `SuperLU` where cvxopt is missing.

    indptr (n + 1,), indices (nnz,): lower triangle of the (n, n) matrix by columns; order (n,): permutation
    that reduces fill.
    """
    try:
        return Cholesky(indptr, indices, order)
    except ImportError:
        return SuperLU(indptr, indices, order)
