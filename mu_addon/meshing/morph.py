"""The mesh of a slightly different unit by moving nodes, so that the two compare without meshing noise."""

from __future__ import annotations

import attrs
import numpy as np

from ..design.dimensions import Dimensions
from ..design.parameters import Unit
from .mesh import LATTICE, MEMBRANE, TET_EDGES, Array, Mesh, edge_keys, edges_of
from .quality import check_positive
from .settings import MeshSettings
from .wall_grid import Membrane, WallGrid, unmovable


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


class Morph:
    """Moves the half mesh that gmsh made of a unit under some settings to other units.

    Work that depends on the mesh alone is done once, so that many similar units cost little.
    """

    def __init__(self, mesh: Mesh, drawn: Unit, settings: MeshSettings) -> None:
        """Raises MeshingError where the mesh is not that of the unit by gmsh under the settings."""
        a = drawn.printed
        self.mesh, self.drawn = mesh, drawn
        self._grid = WallGrid.under(settings, a)
        self._before = self._grid.membrane
        count = len(self._before.nodes)
        close = 1e-6 * a.cell
        if len(mesh.nodes) < count or np.abs(mesh.nodes[:count] - self._before.nodes).max() > close:
            raise unmovable("its mesh is not by gmsh, or has other settings")
        known = np.zeros(len(mesh.nodes), bool)
        known[:count] = True
        if mesh.order == 2:
            self._middle_nodes = _middles(mesh, self._before)
            known[self._middle_nodes] = True
        prescribed = known[:, None] | np.any(
            [mesh.nodes == planes for planes in (0.0, *np.transpose(np.array(a.bounds)))], axis=0
        )
        self._between = _laplace(mesh.nodes, mesh.corners[mesh.region == LATTICE], prescribed)
        corner = np.zeros(len(mesh.nodes), bool)
        corner[mesh.corners] = True
        self._rest = np.flatnonzero(~known & ~corner)
        self._rest_ends = _ends(mesh)[self._rest] if mesh.order == 2 else np.empty((0, 2), int)

    def to(self, other: Unit, checked: bool = True) -> Mesh:
        """The mesh moved to the unit `other`, of as many chambers and cells.

        A change of cell or scale first scales the whole mesh. The membrane moves to its exact position; nodes
        between it and the envelope follow harmonically. checked: test elements for inversion; not needed for
        a tiny move. Raises MeshingError where that cannot be done.
        """
        mesh, a, b = self.mesh, self.drawn.printed, other.printed
        if a == b:
            return mesh
        factor = b.cell / a.cell
        if factor == 1.0 and struts_alone_differ(a, b):
            return mesh
        after = self._grid.of(b if factor == 1.0 else shrunk(b, a.cell))
        count = len(self._before.nodes)
        moved = np.zeros_like(mesh.nodes)
        moved[:count] = after.nodes - self._before.nodes
        if mesh.order == 2:
            moved[self._middle_nodes] = after.middles - self._before.middles
        moved = self._between.between(moved)
        if mesh.order == 2:
            moved[self._rest] = moved[self._rest_ends].mean(axis=1)
        found = attrs.evolve(mesh, nodes=factor * (mesh.nodes + moved))
        if checked:
            check_positive(found)
        return found


def morphed(mesh: Mesh, drawn: Unit, other: Unit, settings: MeshSettings) -> Mesh:
    """The half mesh that gmsh made of `drawn` under `settings`, moved to the unit `other`.

    See `Morph.to`. Raises MeshingError where that cannot be done.
    """
    if drawn.printed == other.printed:
        return mesh
    return Morph(mesh, drawn, settings).to(other)


def struts_alone_differ(a: Dimensions, b: Dimensions) -> bool:
    """Return True if dimensions differ only in the struts, so that wall and homogenised mesh agree."""
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


def _ends(mesh: Mesh) -> Array:
    """Corners (n, 2) on either side of every mid-edge node."""
    ends = np.zeros((len(mesh.nodes), 2), int)
    ends[mesh.tets[:, 4:].ravel()] = mesh.tets[:, TET_EDGES].reshape(-1, 2)
    return ends


def _middles(mesh: Mesh, membrane: Membrane) -> Array:
    """Node (e,) of the mesh at the middle of each edge of the membrane's grid."""
    wall = mesh.tets[mesh.region == MEMBRANE]
    edges, of_tet = edges_of(wall)
    node = np.empty(len(edges), int)
    node[of_tet.ravel()] = wall[:, 4:].ravel()
    count = len(mesh.nodes)
    rows = np.searchsorted(edge_keys(edges, count), edge_keys(edges_of(membrane.tets)[0], count))
    return node[rows]


def _laplace(nodes: Array, tets: Array, prescribed: Array) -> Harmonic:
    """Displacements harmonic in linear tets (m, 4) between those `prescribed`; small elements are stiff."""
    x = nodes[tets]
    inverse = np.linalg.inv(x[:, 1:] - x[:, :1]).transpose(0, 2, 1)
    slopes = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    local = np.einsum("mad,mbd->mab", slopes, slopes)
    return Harmonic(len(nodes), tets, local, prescribed)
