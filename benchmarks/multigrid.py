"""Iterative rivals of the factorisation: conjugate gradients with two kinds of multigrid."""

from __future__ import annotations

import time

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from mu_addon.fem.iterative import TwoLevel

KINDS = ("two levels", "smoothed aggregation")


def rigid_motions(nodes):
    """The six rigid motions (3n, 6) of nodes (n, 3): what an aggregate must represent."""
    x, y, z = nodes.T
    motions = np.zeros((len(nodes), 3, 6))
    motions[:, [0, 1, 2], [0, 1, 2]] = 1
    motions[:, 1, 3], motions[:, 2, 3] = -z, y
    motions[:, 0, 4], motions[:, 2, 4] = z, -x
    motions[:, 0, 5], motions[:, 1, 5] = -y, x
    return motions.reshape(-1, 6)


def smoothed_aggregation(model, matrix):
    """PyAMG's smoothed aggregation on the rigid motions, as a preconditioner."""
    import pyamg

    motions = rigid_motions(model.mesh.nodes)[model.free]
    levels = pyamg.smoothed_aggregation_solver(matrix, B=motions, symmetry="symmetric", max_coarse=500)
    return levels.aspreconditioner()


def measure(kind, model, values, b, tolerance=1e-8):
    """Seconds to analyse, prepare and solve once to a relative residual; iterations (None: too many)."""
    start = time.perf_counter()
    if kind == "two levels":
        pattern = model.pattern
        solver = TwoLevel(pattern.indptr, pattern.indices, model.mesh, model.free, tolerance=tolerance)
        analysed = time.perf_counter()
        solver.factor(values)
        ready = time.perf_counter()
        solver.solve(b)
        return analysed - start, ready - analysed, time.perf_counter() - ready, solver.iterations
    matrix = sparse.csr_matrix(model.matrix(values))
    analysed = time.perf_counter()
    preconditioner = smoothed_aggregation(model, matrix)
    ready = time.perf_counter()
    count = []
    _, failed = linalg.cg(
        matrix, b, rtol=tolerance, maxiter=1000, M=preconditioner, callback=lambda _: count.append(1)
    )
    return analysed - start, ready - analysed, time.perf_counter() - ready, None if failed else len(count)
