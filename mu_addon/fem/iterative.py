"""Conjugate gradients on quadratic elements, preconditioned by a direct solve on linear ones."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from scipy import sparse

from ..errors import ConvergenceError, InputError
from ..meshing.mesh import Mesh, edges_of
from .factor import Cholesky, IndefiniteError, SuperLU, make_factor, nested_dissection

Array = np.ndarray[Any, Any]


def interpolation(mesh: Mesh, free: Array) -> tuple[sparse.csr_matrix, Array]:
    """Linear interpolation (f, c) from the c free corner unknowns of a quadratic mesh to its f free unknowns.

    A corner keeps its value, a mid-edge node gets the mean of its edge's ends. free (f,): numbers of the free
    components among the 3n of all nodes. Also returned: each corner unknown's corner (c,).
    """
    n = len(mesh.nodes)
    corner = np.unique(mesh.corners)
    number = np.full(n, -1)
    number[corner] = np.arange(len(corner))
    edges, of_tet = edges_of(mesh.tets)
    middle = np.empty(len(edges), int)
    middle[of_tet] = mesh.tets[:, 4:]
    rows = np.concatenate([corner, middle, middle])
    columns = number[np.concatenate([corner, edges[:, 0], edges[:, 1]])]
    shares = np.repeat([1.0, 0.5], [len(corner), 2 * len(middle)])
    is_free = np.zeros(3 * n, bool)
    is_free[free] = True
    free_corner = is_free.reshape(-1, 3)[corner].ravel()
    by_node = sparse.csr_matrix((shares, (rows, columns)), shape=(n, len(corner)))
    whole = sparse.csr_matrix(sparse.kron(by_node, sparse.eye(3)))
    return whole[is_free][:, free_corner], np.repeat(np.arange(len(corner)), 3)[free_corner]


class _Symmetric:
    """A symmetric matrix of one pattern, given by its lower triangle, multiplied by several threads."""

    def __init__(self, indptr: Array, indices: Array, threads: int) -> None:
        n = len(indptr) - 1
        columns = np.repeat(np.arange(n, dtype=np.int32), np.diff(indptr))
        below = np.flatnonzero(indices != columns)
        rows = np.concatenate([indices, columns[below]])
        columns = np.concatenate([columns, indices[below].astype(np.int32)])
        order = np.argsort(rows.astype(np.int64) * n + columns)
        source = np.concatenate([np.arange(len(indices)), below])
        self._source = source[order].astype(np.int32 if len(indices) < 2**31 else np.int64)
        start = np.zeros(n + 1, dtype=np.int32 if len(order) < 2**31 else np.int64)
        np.cumsum(np.bincount(rows, minlength=n), out=start[1:])
        self.whole = sparse.csr_matrix((np.empty(len(order)), columns[order], start), shape=(n, n))
        self._diagonal = np.flatnonzero(np.repeat(np.arange(n), np.diff(start)) == self.whole.indices)
        # Rows of about as many entries; scipy releases the interpreter while it multiplies.
        cuts = np.searchsorted(start, np.linspace(0, len(order), threads + 1)[1:-1])
        self._slices = [slice(a, b) for a, b in itertools.pairwise([0, *cuts, n])]
        self._parts = [self._rows(s) for s in self._slices]
        self._pool = ThreadPoolExecutor(threads)

    def _rows(self, rows: slice) -> sparse.csr_matrix:
        """Some rows, as a view: it changes with the whole."""
        start = self.whole.indptr[rows.start : rows.stop + 1]
        inside = slice(start[0], start[-1])
        data = self.whole.data[inside]
        arrays = data, self.whole.indices[inside], start - start[0]
        part = sparse.csr_matrix(arrays, shape=(len(start) - 1, self.whole.shape[1]))
        # scipy copies what is a small part of another array.
        part.data = data
        return part

    def fill(self, values: Array) -> None:
        """Set the lower triangle's values (nnz,)."""
        np.take(values, self._source, out=self.whole.data)

    @property
    def diagonal(self) -> Array:
        return np.asarray(self.whole.data[self._diagonal])

    def __matmul__(self, x: Array) -> Array:
        y = np.empty_like(x)

        def multiply(rows: slice, part: sparse.csr_matrix) -> None:
            y[rows] = part @ x

        list(self._pool.map(multiply, self._slices, self._parts))
        return y


class TwoLevel:
    """Solver for tangents of a quadratic mesh, in place of a factorisation.

    Preconditioner: Chebyshev smoothing before and after an exact solve in the space of linear elements on the
    same corners, an eighth of the unknowns (p-multigrid). Raises InputError for a mesh of order 1. tolerance:
    relative residual of each solution.
    """

    # Of the smoothed part of the spectrum, the ends as shares of the largest eigenvalue, and the degree:
    # measured on the unit and the chamber of `benchmarks`.
    band = (0.1, 1.1)
    degree = 3
    max_iterations = 1000

    def __init__(
        self,
        indptr: Array,
        indices: Array,
        mesh: Mesh,
        free: Array,
        threads: int = 2,
        tolerance: float = 1e-8,
    ) -> None:
        if mesh.order != 2:
            raise InputError(
                "the iterative solver needs quadratic elements", "a mesh of order 1", "factorise instead"
            )
        self.size = len(indptr) - 1
        self.tolerance = tolerance
        self.iterations = 0
        self._fine = _Symmetric(indptr, indices, threads)
        self._down, self._corner = interpolation(mesh, free)
        self._up = sparse.csr_matrix(self._down.T)
        self._coarse: Cholesky | SuperLU | None = None
        self._coarse_pattern: tuple[Array, Array] = (np.empty(0), np.empty(0))
        self._random = np.random.default_rng(0).standard_normal(self.size)
        self._vector = self._random

    def factor(self, values: Array) -> TwoLevel:
        """Prepare for the values (nnz,) of the lower triangle by columns.

        Raises IndefiniteError where the coarse matrix is indefinite, or a solution for a random but smooth
        right-hand side meets a direction of negative curvature; only a factorisation is sure to find one.
        """
        self._fine.fill(values)
        diagonal = self._fine.diagonal
        if (diagonal <= 0).any():
            raise IndefiniteError("a diagonal entry is not positive")
        self._inverse_diagonal = 1 / diagonal
        coarse = sparse.csc_matrix(sparse.tril(self._up @ self._fine.whole @ self._down, format="csc"))
        coarse.sort_indices()
        self._factor_coarse(coarse)
        self._largest = self._largest_eigenvalue()
        # Rich in soft modes, where a negative eigenvalue would be.
        self._conjugate_gradients(self._coarse_solve(self._random), 1e-3)
        return self

    def _factor_coarse(self, coarse: sparse.csc_matrix) -> None:
        pattern = coarse.indptr, coarse.indices
        if self._coarse is None or not all(map(np.array_equal, pattern, self._coarse_pattern)):
            entries = coarse.tocoo()
            ends = self._corner[entries.row], self._corner[entries.col]
            graph = sparse.csr_matrix((np.ones(entries.nnz), ends))
            place = np.argsort(nested_dissection(graph + graph.T))
            order = np.argsort(place[self._corner], kind="stable")
            self._coarse = make_factor(coarse.indptr.astype(np.int64), coarse.indices, order)
            self._coarse_pattern = pattern
        self._coarse.factor(coarse.data)

    def _largest_eigenvalue(self) -> float:
        """Largest eigenvalue of the matrix scaled by its diagonal, by power iterations."""
        for _ in range(12):
            self._vector = self._inverse_diagonal * (self._fine @ self._vector)
            largest = float(np.linalg.norm(self._vector))
            self._vector /= largest
        return largest

    def _smooth(self, residual: Array) -> tuple[Array, Array]:
        """Chebyshev's polynomial of the scaled matrix: a correction, and the residual it leaves.

        Source: Saad, Iterative Methods for Sparse Linear Systems, 2nd ed., algorithm 12.1.
        """
        low, high = (end * self._largest for end in self.band)
        middle, half = (high + low) / 2, (high - low) / 2
        ratio = half / middle
        step = self._inverse_diagonal * residual / middle
        correction = step.copy()
        residual = residual - self._fine @ step
        for _ in range(self.degree - 1):
            following = 1 / (2 * middle / half - ratio)
            step = following * (ratio * step + 2 / half * self._inverse_diagonal * residual)
            ratio = following
            correction += step
            residual -= self._fine @ step
        return correction, residual

    def _coarse_solve(self, residual: Array) -> Array:
        assert self._coarse is not None
        return np.asarray(self._down @ self._coarse.solve(self._up @ residual))

    def _precondition(self, residual: Array) -> Array:
        x, left = self._smooth(residual)
        coarse = self._coarse_solve(left)
        last, _ = self._smooth(left - self._fine @ coarse)
        return x + coarse + last

    def _conjugate_gradients(self, b: Array, tolerance: float) -> Array:
        x, r = np.zeros_like(b), b.copy()
        enough = tolerance * np.linalg.norm(b)
        direction, slope = np.zeros_like(b), 1.0
        for iteration in range(self.max_iterations):
            self.iterations = iteration
            if np.linalg.norm(r) <= enough:
                return x
            z = self._precondition(r)
            last, slope = slope, float(r @ z)
            direction = z + slope / last * direction
            product = self._fine @ direction
            curvature = float(direction @ product)
            if curvature <= 0 or slope <= 0:
                raise IndefiniteError("a direction has negative curvature")
            x += slope / curvature * direction
            r -= slope / curvature * product
        raise ConvergenceError(f"conjugate gradients stopped after {self.max_iterations} iterations")

    def solve(self, b: Array) -> Array:
        """Solve for one (n,) or several (n, k) right-hand sides; the result has the same shape.

        Raises IndefiniteError where a direction has negative curvature, and ConvergenceError after
        `max_iterations`.
        """
        if b.ndim == 1:
            return self._conjugate_gradients(b, self.tolerance)
        return np.stack([self._conjugate_gradients(c, self.tolerance) for c in b.T], axis=1)
