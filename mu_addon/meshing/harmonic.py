"""Harmonic displacements: nodes follow those whose displacement is prescribed."""

from __future__ import annotations

import numpy as np

from .mesh import Array


class Harmonic:
    """Harmonic displacements of the same elements between the same prescribed nodes, factorised once.

    nodes: their number; cells (m, k): nodes of the elements; local (m, k, k): stiffness of each; prescribed
    (nodes, 3) bool.
    """

    def __init__(self, nodes: int, cells: Array, local: Array, prescribed: Array) -> None:
        from scipy.sparse import csr_matrix
        from scipy.sparse.linalg import splu

        k = cells.shape[1]
        rows, columns = np.repeat(cells, k, axis=1).ravel(), np.tile(cells, (1, k)).ravel()
        matrix = csr_matrix((local.ravel(), (rows, columns)), shape=(nodes, nodes))
        in_use = np.zeros(nodes, bool)
        in_use[cells] = True
        self._prescribed = prescribed
        self._axes = []
        for axis in range(3):
            free = np.flatnonzero(in_use & ~prescribed[:, axis])
            self._axes.append((free, matrix[free], splu(matrix[free][:, free].tocsc())))

    def between(self, moved: Array) -> Array:
        """Displacements (nodes, 3) in mm: `moved` (nodes, 3) where prescribed, harmonic elsewhere.

        Nodes of no cell that are not prescribed stay at 0.
        """
        result = np.where(self._prescribed, moved, 0.0)
        for axis, (free, rows, factor) in enumerate(self._axes):
            result[free, axis] = factor.solve(-(rows @ result[:, axis]))
        return result


def harmonic(nodes: int, cells: Array, local: Array, moved: Array, prescribed: Array) -> Array:
    """Displacements (nodes, 3) in mm: `moved` where `prescribed`, harmonic elsewhere; see `Harmonic`."""
    return Harmonic(nodes, cells, local, prescribed).between(moved)
