"""The lattice envelope as nodes and struts, cells of one kind side by side."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .dimensions import Dimensions
from .lattices import LatticeKind


@attrs.frozen(eq=False)
class Graph:
    """Nodes (N, 3) in mm and struts (E, 2) between them, without thickness.

    grid (N, 3) and cells (C, 3), the cells' lower corners, are whole numbers of kind.divisions a cell. Nodes
    inside a cell come first, cell by cell, then those on the cells' faces and corners.
    """

    kind: LatticeKind
    cells: NDArray[np.int64]
    grid: NDArray[np.int64]
    struts: NDArray[np.int64]
    cell: float

    @property
    def nodes(self) -> NDArray[np.float64]:
        """Nodes (N, 3) in mm."""
        return self.grid * (self.cell / self.kind.divisions)

    @property
    def is_centre(self) -> NDArray[np.bool_]:
        """Whether a node (N,) is the centre of a cell."""
        return self._at(self.kind.divisions // 2)

    @property
    def is_corner(self) -> NDArray[np.bool_]:
        """Whether a node (N,) is a corner of a cell."""
        return self._at(0)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether a node (N,) lies inside a cell."""
        return np.asarray(((self.grid - self.cells[0]) % self.kind.divisions != 0).all(axis=1))

    @property
    def on_face(self) -> NDArray[np.bool_]:
        """Whether a strut (E,) lies in a face of a cell."""
        first, second = (self.grid[self.struts[:, k]] for k in (0, 1))
        level = (first - self.cells[0]) % self.kind.divisions == 0
        return np.asarray(((first == second) & level).any(axis=1))

    def _at(self, place: int) -> NDArray[np.bool_]:
        return np.asarray(((self.grid - self.cells[0]) % self.kind.divisions == place).all(axis=1))

    @property
    def cycles(self) -> int:
        """Independent cycles E - V + 1 of the connected graph: the genus of its thickened surface."""
        return len(self.struts) - len(self.nodes) + 1


@attrs.frozen(eq=False)
class Lattice(Graph):
    """The same with struts of these radii, in mm."""

    junction_radius: float
    midspan_radius: float

    def radius(self, t: ArrayLike) -> NDArray[np.float64]:
        """Strut radius (mm) at fractions t of its length, as the kind has it."""
        return self.kind.radius(np.asarray(t, dtype=float), self.junction_radius, self.midspan_radius)


def lattice_of(d: Dimensions) -> Lattice:
    """Lattice of all cells of the envelope, their centres at (iU, jU, (k + 1/2)U)."""
    return thickened(graph_of(d), d.junction_diameter / 2.0, d.midspan_diameter / 2.0)


def graph_of(d: Dimensions) -> Graph:
    """Nodes and struts of all cells of the envelope."""
    half_x = d.cells_x // 2
    i, j, k = (
        np.arange(-half_x, half_x + 1),
        np.arange(-d.cells_y_minus, d.cells_y_plus + 1),
        np.arange(d.count),
    )
    whole, half = d.kind.divisions, d.kind.divisions // 2
    return joined(d.kind, grid_points(whole * i - half, whole * j - half, whole * k), d.cell)


def filled(
    kind: LatticeKind,
    cells: NDArray[np.int64],
    cell: float,
    junction_radius: float,
    midspan_radius: float,
) -> Lattice:
    """Lattice of cells, as `joined`, with struts of these radii in mm."""
    return thickened(joined(kind, cells, cell), junction_radius, midspan_radius)


def thickened(graph: Graph, junction_radius: float, midspan_radius: float) -> Lattice:
    """The graph with struts of these radii, in mm."""
    own = {f.name: getattr(graph, f.name) for f in attrs.fields(Graph)}
    return Lattice(**own, junction_radius=junction_radius, midspan_radius=midspan_radius)


def joined(kind: LatticeKind, cells: NDArray[np.int64], cell: float) -> Graph:
    """Cells of `cell` mm, their lower corners (C, 3) in whole numbers of kind.divisions a cell.

    Nodes and struts that cells share are there once.
    """
    n, m = len(cells), len(kind.nodes)
    inside, own = kind.inside, int(np.count_nonzero(kind.inside))
    # Whole numbers, so nodes shared by cells are found exactly.
    every = cells[:, None, :] + kind.grid
    shared, index = np.unique(every[:, ~inside].reshape(-1, 3)[:, ::-1], axis=0, return_inverse=True)
    number = np.empty((n, m), np.int64)
    number[:, inside] = np.arange(n * own).reshape(n, own)
    number[:, ~inside] = n * own + index.reshape(n, m - own)
    struts = number[:, kind.struts].reshape(-1, 2)
    _, first = np.unique(np.sort(struts, axis=1), axis=0, return_index=True)
    return Graph(
        kind=kind,
        cells=cells,
        grid=np.concatenate([every[:, inside].reshape(-1, 3), shared[:, ::-1]]),
        struts=struts[np.sort(first)],
        cell=cell,
    )


def grid_points(x: NDArray[np.int64], y: NDArray[np.int64], z: NDArray[np.int64]) -> NDArray[np.int64]:
    """Points (n, 3) of a grid, x running fastest and z slowest."""
    zz, yy, xx = np.meshgrid(z, y, x, indexing="ij")
    return np.stack([xx.ravel(), yy.ravel(), zz.ravel()], axis=1)
