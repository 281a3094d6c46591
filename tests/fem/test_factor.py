"""Orders and factors: what each installed library gives, and what takes its place where one is missing."""

from __future__ import annotations

import ctypes
import importlib.util
import sys
from pathlib import Path
from typing import Any

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


def test_the_factors_use_what_the_processor_can_do() -> None:
    """The OpenBLAS of cvxopt does not know processors of after 2021, and takes them for one of 2004."""
    show: Any = np.show_config
    known = show(mode="dicts")["SIMD Extensions"]
    if not {"AVX2", "X86_V3"} & {*known["found"], *known["baseline"]}:
        pytest.skip("no AVX2")
    # Imported, it would have chosen.
    found = importlib.util.find_spec("cvxopt")
    assert found is not None
    assert found.origin is not None
    libraries = list((Path(found.origin).parents[1] / "cvxopt.libs").glob("libopenblas*"))
    if not libraries:
        pytest.skip("this cvxopt brings no OpenBLAS of its own")
    Cholesky(np.array([0, 1]), np.array([0]), np.array([0]))
    library = ctypes.CDLL(str(libraries[0]))
    library.openblas_get_corename.restype = ctypes.c_char_p
    assert library.openblas_get_corename() in (b"SkylakeX", b"Haswell")
