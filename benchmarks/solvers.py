"""Sparse symmetric solvers on the tangent of the real unit: one table, from one run.

    python benchmarks/solvers.py [--refine 1.0] [--repeats 3]

Needs `pip install -e '.[benchmarks]'` for MKL Pardiso; a solver that is not installed is left out.
Every row solves the same system to the same right-hand side, and shows the relative residual it left.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from scipy import sparse

from mu_addon.design.parameters import load_preset
from mu_addon.fem.factor import Cholesky, SuperLU
from mu_addon.fem.model import Model
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings


def system(refine):
    """The unit's tangent at 1 kPa, as its model and the values of its lower triangle."""
    unit = load_preset("mu-1.0x")
    mesh = mesh_unit(unit, MeshSettings(refine=refine))
    model = Model(mesh)
    parameters = model.parameters(materials_of(unit, mesh))
    return model, model.tangent(np.zeros_like(mesh.nodes), 1e-3, parameters)


class Pardiso:
    """MKL Pardiso for symmetric positive definite matrices (mtype 2)."""

    def __init__(self, indptr, indices, order):
        from pypardiso import PyPardisoSolver

        self.solver = PyPardisoSolver(mtype=2)
        self.indptr, self.indices = indptr, indices

    def factor(self, values):
        n = len(self.indptr) - 1
        # The lower triangle by columns is the upper triangle by rows.
        self.matrix = sparse.csr_matrix((values, self.indices, self.indptr), shape=(n, n))
        self.solver.factorize(self.matrix)
        return self

    def solve(self, b):
        return self.solver.solve(self.matrix, b)


class CholmodAMD(Cholesky):
    """CHOLMOD with the ordering it brings in the cvxopt wheel (AMD)."""

    def __init__(self, indptr, indices, order):
        from cvxopt import cholmod

        super().__init__(indptr, indices, order)
        self._factor = cholmod.symbolic(self._matrix)


SOLVERS = {
    "CHOLMOD (cvxopt), METIS order (pymetis)": Cholesky,
    "CHOLMOD (cvxopt), AMD order": CholmodAMD,
    "MKL Pardiso (pypardiso), mtype 2": Pardiso,
    "SuperLU (scipy), METIS order, symmetric mode": SuperLU,
}


def seconds(call, repeats):
    """Median wall time of some calls, and the last answer."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        answer = call()
        times.append(time.perf_counter() - start)
    return statistics.median(times), answer


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--refine", type=float, default=1.0)
    options.add_argument("--repeats", type=int, default=3)
    given = options.parse_args()
    model, values = system(given.refine)
    pattern, matrix = model.pattern, model.matrix(values)
    n = len(model.free)
    b = np.random.default_rng(0).standard_normal(n)
    print(f"{n} unknowns, {len(values)} entries in the lower triangle; median of {given.repeats}\n")
    print("| solver | analyse s | factor s | solve s | residual |\n| --- | --- | --- | --- | --- |")
    for name, kind in SOLVERS.items():
        try:
            analyse, solver = seconds(lambda: kind(pattern.indptr, pattern.indices, pattern.order), 1)  # noqa: B023
            factor, _ = seconds(lambda: solver.factor(values), given.repeats)  # noqa: B023
            solve, x = seconds(lambda: solver.solve(b), given.repeats)  # noqa: B023
        except ImportError:
            print(f"| {name} | not installed | | | |")
            continue
        residual = np.linalg.norm(matrix @ x - b) / np.linalg.norm(b)
        print(f"| {name} | {analyse:.2f} | {factor:.2f} | {solve:.3f} | {residual:.0e} |", flush=True)


if __name__ == "__main__":
    main()
