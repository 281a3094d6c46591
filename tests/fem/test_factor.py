"""Orders and factors: what each installed library gives, and what takes its place where one is missing."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy import sparse

from mu_addon.fem.factor import Cholesky, SuperLU, make_factor, nested_dissection


def grid(side: int) -> sparse.csr_matrix:
    """Laplacian of a cube of side^3 points, plus the unit matrix."""
    line = sparse.diags([-np.ones(side - 1), 2 * np.ones(side), -np.ones(side - 1)], [-1, 0, 1])
    one = sparse.identity(side)
    kron = sparse.kron
    total = kron(kron(line, one), one) + kron(kron(one, line), one) + kron(kron(one, one), line)
    return sparse.csr_matrix(total + sparse.identity(side**3))


def fill(matrix: sparse.csr_matrix, order: np.ndarray) -> int:
    lower = sparse.tril(matrix).tocsc()
    factor = Cholesky(lower.indptr, lower.indices, order).factor(lower.data).lower()
    return len(factor.values)


@pytest.mark.parametrize("missing", [(), ("pymetis",), ("pymetis", "cvxopt")])
def test_a_system_is_solved_whatever_is_installed(
    missing: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in missing:
        monkeypatch.setitem(sys.modules, name, None)
    matrix = grid(7)
    order = nested_dissection(matrix)
    assert sorted(order) == list(range(7**3))
    lower = sparse.tril(matrix).tocsc()
    lower.sort_indices()
    factor = make_factor(lower.indptr, lower.indices, order)
    assert isinstance(factor, SuperLU if "cvxopt" in missing else Cholesky)
    x = np.random.default_rng(0).normal(size=(7**3, 2))
    np.testing.assert_allclose(factor.factor(lower.data).solve(matrix @ x), x, atol=1e-12)


def test_without_metis_minimum_degree_still_saves_fill(monkeypatch: pytest.MonkeyPatch) -> None:
    matrix = grid(12)
    best = fill(matrix, nested_dissection(matrix))
    as_given = fill(matrix, np.arange(12**3))
    monkeypatch.setitem(sys.modules, "pymetis", None)
    assert best < fill(matrix, nested_dissection(matrix)) < 0.75 * as_given
