"""What moving a mesh to a slightly different unit needs: harmonic displacements, and dimensions compared."""

from __future__ import annotations

import attrs
import numpy as np

from ..design.dimensions import Dimensions
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


def struts_alone_differ(a: Dimensions, b: Dimensions) -> bool:
    """Return True if dimensions differ only in the struts, so that the walls agree."""
    struts = ("grading", "junction_diameter", "midspan_diameter")
    return attrs.evolve(b, **{name: getattr(a, name) for name in struts}) == a


def shrunk(d: Dimensions, cell: float) -> Dimensions:
    """Dimensions with every length of membrane, struts and envelope scaled to another cell in mm."""
    by = cell / d.cell
    wall = ("R", "r", "a", "b", "wall", "wall_growth", "base_cap", "tip_cap")
    lengths = (*wall, "junction_diameter", "midspan_diameter", "strut_growth")
    grading = None if d.grading is None else attrs.evolve(d.grading, cell=cell)
    scaled = {name: by * getattr(d, name) for name in lengths}
    return attrs.evolve(d, cell=cell, grading=grading, **scaled)
