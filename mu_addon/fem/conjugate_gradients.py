"""Preconditioned conjugate gradients for many systems at once on a Warp device."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import warp as wp
from scipy import sparse

from ..arrays import Array
from ..errors import ConvergenceError
from . import krylov_kernels as kernels
from .factor import IndefiniteError

# Systems that one thread carries through the matrix together.
WIDTHS = (1, 4, 16)

# Iterations between two checks of the residuals, each of which waits for the device.
LOOK = 10

MAX_ITERATIONS = 20000

# The approximate inverse: entries a row of its factor, and how many are chosen at a time. Of the unit's
# tangent at 8700 unknowns 32 by 4 took 383 iterations, 16 by 4 took 706, blocks of the diagonal 3620.
ROW_SIZE = 32
STEP_SIZE = 4


@attrs.frozen(eq=False)
class Rows:
    """A sparse matrix (n, n) by rows (CSR) on a device: offsets (n + 1,), columns and values (nnz,)."""

    offsets: wp.array
    columns: wp.array
    values: wp.array

    def multiply(self, x: wp.array, y: wp.array) -> None:
        """y = A x for k vectors on the device, x and y (k, n); y is overwritten."""
        k, n = x.shape
        width = next((w for w in WIDTHS if k <= w), WIDTHS[-1])
        inputs = [self.offsets, self.columns, self.values, x, y]
        wp.launch(kernels.product_kernel(width), (-(-k // width), n), inputs, device=x.device)


@attrs.frozen(eq=False)
class Solution:
    """Result of `conjugate_gradients` for k systems.

    x (k, n): on the device; solved (k,) bool: residual within the tolerance; definite (k,) bool: no direction
    of negative curvature was found; iterations: their number, the same for all.
    """

    x: wp.array
    solved: Array
    definite: Array
    iterations: int


def conjugate_gradients(multiply: Any, precondition: Any, b: wp.array, tolerance: float) -> Solution:
    """Solve A x = b for k symmetric systems at once, b (k, n) on a device.

    multiply(p, y) and precondition(r, z) write y = A p and z = M r, M positive definite. Ends when every
    residual is below `tolerance` of its right-hand side, or after MAX_ITERATIONS. (Hestenes and Stiefel, J.
    Res. Natl. Bur. Stand. 49 (1952) 409.)

    Warp's solver does not return the curvature, which reveals an indefinite matrix.
    """
    device, k = b.device, b.shape[0]
    x, r = wp.zeros_like(b), wp.clone(b)
    z, Ap = wp.zeros_like(b), wp.zeros_like(b)
    squared, descent, before, curvature = (
        wp.zeros((k, 1), dtype=wp.float64, device=device) for _ in range(4)
    )
    lost = wp.zeros(k, dtype=int, device=device)
    length = wp.zeros(k, dtype=wp.float64, device=device)
    precondition(r, z)
    p = wp.clone(z)
    wp.utils.array_inner(r, z, out=descent, axis=1)
    wp.utils.array_inner(r, r, out=squared, axis=1)
    least = tolerance**2 * squared.numpy()
    goal = wp.array(least, dtype=wp.float64, device=device)
    iteration = 0
    while True:
        if iteration % LOOK == 0:
            definite = lost.numpy() == 0
            solved = (squared.numpy() <= least)[:, 0] & definite
            if (solved | ~definite).all() or iteration >= MAX_ITERATIONS:
                return Solution(x, solved, definite, iteration)
        multiply(p, Ap)
        wp.utils.array_inner(p, Ap, out=curvature, axis=1)
        wp.launch(kernels.step_length, k, [squared, goal, descent, curvature, lost, length], device=device)
        wp.launch(kernels.advance, b.shape, [length, p, Ap, x, r], device=device)
        precondition(r, z)
        before, descent = descent, before
        wp.utils.array_inner(r, z, out=descent, axis=1)
        wp.utils.array_inner(r, r, out=squared, axis=1)
        wp.launch(kernels.turn, b.shape, [length, descent, before, z, p], device=device)
        iteration += 1


class ConjugateGradients:
    """Solves with a symmetric positive definite matrix of one pattern, as `factor.Cholesky` does.

    The preconditioner is a factorised sparse approximate inverse, by Warp (Kolotilina and Yeremin, SIAM J.
    Matrix Anal. Appl. 14 (1993) 45). indptr (n + 1,), indices (nnz,): the lower triangle by columns; order
    (n,): of the unknowns on the device. tolerance: residual over right-hand side of every solution.
    """

    # A residual below this share of a random right-hand side proves the matrix definite but for about
    # one in 10^4 (at 10^6 unknowns), see `_prove_definite`.
    proof = 1e-7

    def __init__(
        self, indptr: Array, indices: Array, order: Array, device: str = "cuda", tolerance: float = 1e-10
    ) -> None:
        self.device, self.tolerance = device, tolerance
        self.size = n = len(indptr) - 1
        self.iterations = 0
        self._order = order
        # Numbers instead of values, from 1: sums of sparse matrices drop zeros.
        number = np.arange(1, len(indices) + 1)
        lower = sparse.csc_matrix((number, indices, indptr), shape=(n, n))
        full = sparse.csr_matrix(lower + sparse.tril(lower, -1).T)[order][:, order].tocsr()
        full.sort_indices()
        self._number = self._put(full.data - 1, int)
        count = len(full.data)
        self._rows = Rows(
            self._put(full.indptr, int),
            self._put(full.indices, int),
            wp.zeros(count, dtype=wp.float64, device=device),
        )
        self._inverse: Any = None

    def _put(self, a: Array, dtype: Any) -> wp.array:
        kind = np.int32 if dtype is int else np.float64
        return wp.array(np.ascontiguousarray(a, kind), dtype=dtype, device=self.device)

    def factor(self, values: Array) -> ConjugateGradients:
        """Take the values (nnz,) of the lower triangle by columns, and make the preconditioner.

        Raises IndefiniteError where the matrix is not proved positive definite.
        """
        inputs = [self._number, self._put(values, wp.float64), self._rows.values]
        wp.launch(kernels.pick, len(self._number), inputs, device=self.device)
        self._approximate()
        self._prove_definite()
        return self

    def _approximate(self) -> None:
        from warp.optim.linear import FSAI
        from warp.sparse import bsr_zeros

        # What stops it is a block of the diagonal that is not positive definite.
        try:
            if self._inverse is not None:
                self._inverse.update()
                return
            n, rows = self.size, self._rows
            matrix = bsr_zeros(n, n, wp.float64, device=self.device)
            matrix.offsets, matrix.columns, matrix.values = rows.offsets, rows.columns, rows.values
            matrix.notify_nnz_changed(len(self._number))
            inverse = FSAI(matrix, max_row_size=ROW_SIZE, max_step_size=STEP_SIZE, reuse_pattern=True)
        except ValueError as error:
            raise IndefiniteError(str(error)) from None
        if inverse.truncated_rows:
            raise IndefiniteError(f"{inverse.truncated_rows} blocks are not positive definite")
        self._inverse = inverse

    def _prove_definite(self) -> None:
        """Solve with a random right-hand side; raises IndefiniteError where that fails.

        The residual's part along a mode v of the preconditioned matrix, of negative eigenvalue l, is that of
        b times the product of 1 - l / h over the Ritz values h. While all curvatures are positive so are all
        h, and that part cannot shrink. A residual that shrank nevertheless had no such part: in n unknowns a
        random unit b has a component below e along a given unit v with probability e sqrt(2 n / pi).
        """
        b = np.random.default_rng(0).standard_normal((1, self.size))
        tried = self._run(self._put(b, wp.float64), self.proof)
        if not tried.definite.all():
            raise IndefiniteError("the curvature along a direction is not positive")
        if not tried.solved.all():
            raise IndefiniteError(
                f"close to singular: {tried.iterations} iterations did not prove it definite"
            )

    def solve(self, b: Array) -> Array:
        """Solve for one (n,) or several (n, k) right-hand sides; the result has the same shape.

        Raises ConvergenceError where one is not solved within the tolerance.
        """
        found = self._run(self._put(b.T.reshape(-1, self.size)[:, self._order], wp.float64), self.tolerance)
        self.iterations = found.iterations
        if not found.solved.all():
            raise ConvergenceError(f"conjugate gradients stopped after {self.iterations} iterations")
        x = np.empty(b.T.reshape(-1, self.size).shape)
        x[:, self._order] = found.x.numpy()
        return x.reshape(b.T.shape).T

    def _run(self, b: wp.array, tolerance: float) -> Solution:
        factors = [Rows(a.offsets, a.columns, a.values) for a in (self._inverse.G, self._inverse.GT)]
        work = wp.empty_like(b)

        def precondition(r: wp.array, z: wp.array) -> None:
            factors[0].multiply(r, work)
            factors[1].multiply(work, z)

        # Warp's inner products run on whatever device is current.
        with wp.ScopedDevice(self.device):
            return conjugate_gradients(self._rows.multiply, precondition, b, tolerance)
