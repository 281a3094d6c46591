"""Solving with tangents that are no longer definite, and counting their negative eigenvalues."""

from __future__ import annotations

from typing import Any

import numpy as np

from .factor import LDL, IndefiniteError
from .model import Model
from .sparsity import Pattern

Array = np.ndarray[Any, Any]

# Springs set for one lost mode, enough to hold a smooth one all over the body, and for how many modes.
_SPRINGS = 12
_MODES = 8


class Inertia:
    """Solves with a symmetric tangent K of a model, and counts its negative eigenvalues.

    While K is definite this is its Cholesky factor. Beyond that, springs r on the unknowns E that move most
    in the lost modes make K + E r E^T definite, so that Cholesky serves again. Removing the springs is a
    small system, S = 1/r - E^T (K + E r E^T)^-1 E (Sherman, Morrison and Woodbury), and S has exactly as many
    negative eigenvalues as K (Haynsworth, Linear Algebra Appl. 1 (1968) 73, on the matrix of both blocks).
    Where no such springs are known, an L D L^T finds the lost modes.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.negative = 0
        self.factorisations = 0
        self._engine: Any = model.factor
        self._held = np.empty(0, int)
        self._release: tuple[Array, Array] | None = None
        self._suspect: Array | None = None
        self._places = model.mesh.nodes[model.free // 3]
        self._ldl_of: tuple[Pattern, LDL] | None = None

    @property
    def _diagonal(self) -> Array:
        """Positions (n,) of the diagonal's entries: a column of the lower triangle begins with its own."""
        return self.model.pattern.indptr[:-1]

    @property
    def _ldl(self) -> LDL:
        pattern = self.model.pattern
        if self._ldl_of is None or self._ldl_of[0] is not pattern:
            self._ldl_of = pattern, LDL(pattern.indptr, pattern.indices, pattern.order)
        return self._ldl_of[1]

    def suspect(self, mode: Array) -> None:
        """Name a displacement (free unknowns,) that may become unstable next.

        The next `factor` tries springs on the unknowns that move most in it before it falls back on an L D
        L^T.
        """
        self._suspect = mode

    def factor(self, values: Array, thorough: bool = True) -> Inertia:
        """Factorise a tangent's values (nnz,), in N/mm, as `Model.tangent` gives them, and count `negative`.

        thorough: whether an L D L^T may be made where all else fails. Raises IndefiniteError where it is
        needed and not allowed, and ArithmeticError where the tangent is singular.
        """
        if self.negative == 0 and self._factor_definite(values):
            return self
        if len(self._held) and self._factor_sprung(values, self._held):
            return self
        if self._suspect is not None:
            held = np.union1d(self._held, self._most_moved([self._suspect]))
            self._suspect = None
            if self._factor_sprung(values, held):
                return self
        if not thorough:
            raise IndefiniteError("the tangent is far from definite")
        self.factorisations += 1
        self._ldl.factor(values)
        self._engine, self._release, self.negative = self._ldl, None, self._ldl.negative
        if 0 < self.negative <= _MODES:
            stiffness, modes = self.modes(2 * self.negative + 2, tolerance=1e-2)
            self._held = self._most_moved(list(modes.T[stiffness < 0]))
        return self

    def _factor_definite(self, values: Array) -> bool:
        self.factorisations += 1
        try:
            self.model.factor.factor(values)
        except IndefiniteError:
            return False
        self._engine, self._release, self.negative = self.model.factor, None, 0
        return True

    def _factor_sprung(self, values: Array, held: Array) -> bool:
        diagonal = self._diagonal[held]
        spring = np.abs(values[diagonal])
        stiffened = values.copy()
        stiffened[diagonal] += spring
        if not self._factor_definite(stiffened):
            return False
        unit = np.zeros((len(self._diagonal), len(held)))
        unit[held, np.arange(len(held))] = 1.0
        moved = self._engine.solve(unit)
        small = np.diag(1 / spring) - moved[held]
        self._held, self._release = held, (moved, small)
        self.negative = int((np.linalg.eigvalsh((small + small.T) / 2) < 0).sum())
        return True

    def _most_moved(self, modes: list[Array]) -> Array:
        """Unknowns that move most in some modes (free unknowns, each), and lie apart from each other."""
        chosen: list[int] = []
        for mode in modes:
            score = np.abs(mode)
            apart = np.full(len(mode), np.inf)
            for _ in range(_SPRINGS):
                chosen.append(int(score.argmax()))
                away = np.linalg.norm(self._places - self._places[chosen[-1]], axis=1)
                apart = np.minimum(apart, away)
                score = np.abs(mode) * apart
        return np.unique(np.array(chosen, int))

    def solve(self, b: Array) -> Array:
        """Solve for one (n,) or several (n, k) right-hand sides with the last tangent; the same shape."""
        x = self._engine.solve(b)
        if self._release is not None:
            moved, small = self._release
            x = x + moved @ np.linalg.solve(small, x[self._held])
        return np.asarray(x)

    def modes(self, count: int, tolerance: float = 1e-8) -> tuple[Array, Array]:
        """The eigenvalues (k,) nearest zero of the last tangent, in N/mm, and their unit vectors (n, k).

        tolerance: relative accuracy of the eigenvalues. Raises ArithmeticError where they are not found.
        """
        from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

        size = len(self._diagonal)
        inverse = LinearOperator((size, size), matvec=self.solve, dtype=float)
        # A fixed start: the answer must not depend on a random one. It has a share of every mode.
        start = np.random.default_rng(0).standard_normal(size)
        try:
            flexibility, vectors = eigsh(inverse, min(count, size - 1), which="LM", v0=start, tol=tolerance)
        except ArpackNoConvergence as error:
            raise ArithmeticError(f"the softest modes were not found: {error}") from None
        return 1 / flexibility, vectors
