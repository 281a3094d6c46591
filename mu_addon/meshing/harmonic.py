"""Nodes that follow others: displacements that are harmonic between those prescribed."""

from __future__ import annotations

import numpy as np

from .mesh import Array


def harmonic(nodes: int, cells: Array, local: Array, moved: Array, prescribed: Array) -> Array:
    """Displacements (nodes, 3) in mm: `moved` where `prescribed`, harmonic elsewhere.

    nodes: their number; cells (m, k): nodes of the elements; local (m, k, k): stiffness of each; moved
    (nodes, 3) in mm; prescribed (nodes, 3) bool. Nodes of no cell that are not prescribed stay at 0.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import splu

    k = cells.shape[1]
    rows, columns = np.repeat(cells, k, axis=1).ravel(), np.tile(cells, (1, k)).ravel()
    matrix = csr_matrix((local.ravel(), (rows, columns)), shape=(nodes, nodes))
    result = np.where(prescribed, moved, 0.0)
    in_use = np.zeros(nodes, bool)
    in_use[cells] = True
    for axis in range(3):
        free = np.flatnonzero(in_use & ~prescribed[:, axis])
        load = -(matrix[free] @ result[:, axis])
        result[free, axis] = splu(matrix[free][:, free].tocsc()).solve(load)
    return result
