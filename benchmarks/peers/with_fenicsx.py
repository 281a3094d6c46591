"""FEniCSx: the energy in UFL, PETSc's MUMPS, one MPI rank a thread.

MU_FENICSX names the command that starts its Python where that is another one than this, for instance
"mpirun -n 2 python3" of a Debian that has python3-dolfinx-real and python3-petsc4py-real.
"""

from __future__ import annotations

import time

import numpy as np

from .problem import TOLERANCE, Result
from .process import Absent, answer

# Basix orders the mid-edge nodes of a tetrahedron by (2,3), (1,3), (1,2), (0,3), (0,2), (0,1).
_FROM_VTK = np.array([0, 1, 2, 3, 9, 8, 5, 7, 6, 4])

OPTIONS = {
    "snes_type": "newtonls",
    "snes_linesearch_type": "none",
    # Of the imbalance that the pressure's increment makes, which is smaller than the reaction forces.
    "snes_rtol": TOLERANCE,
    "snes_atol": 0.0,
    "snes_stol": 0.0,
    "ksp_type": "preonly",
    "pc_type": "lu",
    "pc_factor_mat_solver_type": "mumps",
}


def solve(problem, folder):
    try:
        import basix.ufl
        import dolfinx
        import ufl
        from dolfinx import fem, mesh
        from dolfinx.fem.petsc import NonlinearProblem
        from mpi4py import MPI
    except ImportError as missing:
        raise Absent(f"{missing}; on Debian sid: apt-get install python3-dolfinx-real") from None
    comm = MPI.COMM_WORLD
    comm.Barrier()
    start = time.perf_counter()
    body, order = problem.mesh, problem.mesh.order
    cells = body.tets if order == 1 else body.tets[:, _FROM_VTK]
    element = basix.ufl.element("Lagrange", "tetrahedron", order, shape=(3,))
    share = [np.array_split(a, comm.size)[comm.rank] for a in (cells.astype(np.int64), body.nodes)]
    domain = mesh.create_mesh(comm, share[0], element, share[1])
    space = fem.functionspace(domain, element)
    moduli = []
    for values in (problem.mu, problem.kappa):
        moduli.append(fem.Function(fem.functionspace(domain, ("DG", 0))))
        moduli[-1].x.array[:] = values[domain.topology.original_cell_index]

    # Geometry and displacement have the same element, so that a cell's nodes pair up.
    given = np.asarray(domain.geometry.input_global_indices)
    nodes_of = np.empty(len(given), int)
    nodes_of[space.dofmap.list] = given[domain.geometry.dofmap]
    fixed = problem.fixed()
    supports = [
        fem.dirichletbc(0.0, (3 * np.flatnonzero(fixed[nodes_of, i]) + i).astype(np.int32), space.sub(i))
        for i in range(3)
    ]

    domain.topology.create_connectivity(2, 3)
    facets = mesh.exterior_facet_indices(domain.topology)
    corners = given[mesh.entities_to_geometry(domain, 2, facets)[:, :3]]
    wanted = set(map(tuple, np.sort(body.cavity_corners, axis=1).tolist()))
    chosen = facets[[tuple(f) in wanted for f in np.sort(corners, axis=1).tolist()]].astype(np.int32)
    tags = mesh.meshtags(domain, 2, np.sort(chosen), np.ones(len(chosen), np.int32))

    mu, kappa = moduli
    u, v = fem.Function(space), ufl.TestFunction(space)
    pressure = fem.Constant(domain, 0.0)
    F = ufl.Identity(3) + ufl.grad(u)
    J = ufl.det(F)
    energy = mu / 2 * (J ** (-2 / 3) * ufl.inner(F, F) - 3) + kappa / 2 * (J - 1) ** 2
    volume = ufl.dx(domain, metadata={"quadrature_degree": order})
    wall = ufl.Measure("ds", domain, subdomain_data=tags, metadata={"quadrature_degree": 2 * order})
    traction = pressure * ufl.inner(J * ufl.inv(F).T * ufl.FacetNormal(domain), v)
    residual = ufl.derivative(energy * volume, u, v) + traction * wall(1)
    nonlinear = NonlinearProblem(
        residual, u, bcs=supports, petsc_options=OPTIONS, petsc_options_prefix="chamber_"
    )
    comm.Barrier()
    ready = time.perf_counter()
    newton = 0
    for value in problem.pressures_MPa:
        pressure.value = value
        nonlinear.solve()
        if nonlinear.solver.getConvergedReason() <= 0:
            raise RuntimeError(f"SNES did not converge at {value * 1e3:g} kPa")
        newton += nonlinear.solver.getIterationNumber()
    comm.Barrier()
    end = time.perf_counter()
    own = space.dofmap.index_map.size_local
    parts = comm.gather((nodes_of[:own], u.x.array.reshape(-1, 3)[:own]), root=0)
    if comm.rank:
        return None
    field = np.empty_like(body.nodes)
    for nodes, values in parts:
        field[nodes] = values
    name = f"FEniCSx {dolfinx.__version__}, MUMPS, ranks: {comm.size}"
    return Result(name, ready - start, end - ready, int((~fixed).sum()), newton, field)


if __name__ == "__main__":
    answer(solve)
