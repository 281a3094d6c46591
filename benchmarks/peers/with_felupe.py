"""felupe: one SolidBody a group, MKL Pardiso; the pressure on triangles is an item of our own.

felupe has boundary regions for quadrilaterals and hexahedra only, so the follower pressure is written
here against its protocol of items, in vectorised numpy. Two linear solvers: the one its manual shows
(`pypardiso.spsolve`, an unsymmetric factorisation), and Pardiso's Cholesky.
"""

from __future__ import annotations

import time

import numpy as np
from scipy import sparse

from mu_addon.fem.elements import triangle_shapes

from .problem import TOLERANCE, Result
from .process import Absent, answer

# The Levi-Civita symbol.
_E = np.zeros((3, 3, 3))
_E[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = 1
_E[[0, 2, 1], [2, 1, 0], [1, 0, 2]] = -1


class Pressure:
    """A follower pressure on triangles, as an item that felupe's Newton method assembles."""

    def __init__(self, field, mesh):
        from felupe.mechanics._helpers import Assemble, Results

        self.field = field
        self.faces = mesh.cavity
        self.order = mesh.order
        self.nodes = mesh.nodes
        self.value = 0.0
        self.results = Results()
        self.assemble = Assemble(vector=self._vector, matrix=self._matrix, multiplier=None)
        dofs = (3 * self.faces[:, :, None] + np.arange(3)).reshape(len(self.faces), -1)
        self._dofs = dofs.ravel()
        self._rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
        self._columns = np.tile(dofs, dofs.shape[1]).ravel()
        self._size = 3 * len(self.nodes)

    def _tangents(self):
        """Shape functions, derivatives, weights, and both tangents of every face, (q, f, 3) each."""
        N, dN, w = triangle_shapes(self.order)
        x = (self.nodes + self.field[0].values)[self.faces]
        s, t = (np.einsum("qa,fai->qfi", dN[:, :, d], x) for d in (0, 1))
        return N, dN, w, s, t

    def _vector(self, field=None, parallel=False, **_):
        if field is not None:
            self.field = field
        N, _, w, s, t = self._tangents()
        values = self.value * np.einsum("q,qa,qfi->fai", w, N, np.cross(s, t))
        force = np.bincount(self._dofs, values.ravel(), minlength=self._size)
        return sparse.csr_matrix(force[:, None])

    def _matrix(self, field=None, parallel=False, **_):
        if field is not None:
            self.field = field
        N, dN, w, s, t = self._tangents()
        # d(s x t)_i / dx_bj = dN_b0 e_ijk t_k - dN_b1 e_ijk s_k
        by_s = np.einsum("q,qa,qb,qfk->fabk", w, N, dN[:, :, 0], t, optimize=True)
        by_t = np.einsum("q,qa,qb,qfk->fabk", w, N, dN[:, :, 1], s, optimize=True)
        values = self.value * np.einsum("ijk,fabk->faibj", _E, by_s - by_t)
        matrix = sparse.coo_matrix((values.ravel(), (self._rows, self._columns)), shape=(self._size,) * 2)
        return matrix.tocsr()


class Symmetric:
    """MKL Pardiso's Cholesky: half the storage and work. The pattern is analysed again where it changed."""

    def __init__(self):
        from pypardiso import PyPardisoSolver

        self.solver = PyPardisoSolver(mtype=2)
        self.pattern = (np.empty(0), np.empty(0))

    def __call__(self, matrix, b):
        upper = sparse.triu(matrix, format="csr")
        upper.sort_indices()
        pattern = (upper.indptr, upper.indices)
        same = all(map(np.array_equal, pattern, self.pattern))
        self.pattern = pattern
        # MKL's phases: 12 analyses and factorises, 22 factorises, 33 solves.
        self.solver.set_phase(22 if same else 12)
        self.solver._call_pardiso(upper, np.zeros((len(b), 1)))
        self.solver.set_phase(33)
        return self.solver._call_pardiso(upper, np.asarray(b, float).reshape(-1, 1)).ravel()


def solve(problem, folder, symmetric=False):
    try:
        import felupe
        import pypardiso
    except ImportError as missing:
        raise Absent(f"{missing}; pip install -e '.[benchmarks]'") from None
    start = time.perf_counter()
    mesh = problem.mesh
    region_of = felupe.RegionTetra if mesh.order == 1 else felupe.RegionQuadraticTetra
    kind = "tetra" if mesh.order == 1 else "tetra10"
    whole = felupe.Mesh(mesh.nodes, mesh.tets.astype(np.int64), cell_type=kind)
    field = felupe.FieldContainer([felupe.Field(region_of(whole), dim=3)])
    solids = []
    for mu, kappa, elements in problem.groups():
        part = felupe.Mesh(mesh.nodes, mesh.tets[elements].astype(np.int64), cell_type=kind)
        part.points_without_cells = np.array([], dtype=int)
        part_field = felupe.FieldContainer([felupe.Field(region_of(part), dim=3)])
        solids.append(felupe.SolidBody(felupe.NeoHooke(mu=mu, bulk=kappa), part_field))
    pressure = Pressure(field, mesh)
    dof0, dof1 = (np.flatnonzero(held) for held in (problem.fixed().ravel(), ~problem.fixed().ravel()))
    linear = Symmetric() if symmetric else pypardiso.spsolve
    ready = time.perf_counter()
    newton = 0
    for value in problem.pressures_MPa:
        pressure.value = value
        found = felupe.newtonraphson(
            x0=field,
            items=[*solids, pressure],
            dof0=dof0,
            dof1=dof1,
            ext0=np.zeros(len(dof0)),
            solver=linear,
            tol=TOLERANCE,
            verbose=False,
        )
        field = found.x
        newton += found.iterations
    end = time.perf_counter()
    name = f"felupe {felupe.__version__}, " + ("Pardiso Cholesky" if symmetric else "pypardiso.spsolve")
    return Result(name, ready - start, end - ready, len(dof1), newton, field[0].values.copy())


if __name__ == "__main__":
    answer(solve)
