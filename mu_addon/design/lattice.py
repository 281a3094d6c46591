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
        """Whether each node is the centre of a cell, (N,)."""
        return self._at(self.kind.divisions // 2)

    @property
    def is_corner(self) -> NDArray[np.bool_]:
        """Whether each node is a corner of a cell, (N,)."""
        return self._at(0)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each node lies in the interior of a cell, (N,)."""
        return np.asarray(((self.grid - self.cells[0]) % self.kind.divisions != 0).all(axis=1))

    @property
    def on_face(self) -> NDArray[np.bool_]:
        """Whether each strut lies in a face of a cell, (E,)."""
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
    """A graph whose struts have thickness: radius in mm at their junctions and at mid-span."""

    junction_radius: float
    midspan_radius: float

    def radius(self, t: ArrayLike) -> NDArray[np.float64]:
        """Strut radii in mm (any shape) at fractions t, 0 .. 1, (any shape) of the strut's length."""
        return self.kind.radius(np.asarray(t, dtype=float), self.junction_radius, self.midspan_radius)


def lattice_of(d: Dimensions) -> Lattice:
    """Lattice of all cells of the unit's envelope; cell centres lie at (iU, jU, (k + 1/2)U) in mm."""
    return thickened(graph_of(d), d.junction_diameter / 2.0, d.midspan_diameter / 2.0)


def graph_of(d: Dimensions) -> Graph:
    """Nodes and struts of all cells of the unit's envelope, without thickness; cells as in `lattice_of`."""
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
    """Lattice of cells whose lower corners are cells (C, 3), with struts of these radii in mm.

    cells: in whole numbers of kind.divisions a cell, as in `joined`; cell: edge of a cell in mm.
    """
    return thickened(joined(kind, cells, cell), junction_radius, midspan_radius)


def thickened(graph: Graph, junction_radius: float, midspan_radius: float) -> Lattice:
    """The graph with struts of these radii in mm, at junctions and at mid-span."""
    own = {f.name: getattr(graph, f.name) for f in attrs.fields(Graph)}
    return Lattice(**own, junction_radius=junction_radius, midspan_radius=midspan_radius)


def joined(kind: LatticeKind, cells: NDArray[np.int64], cell: float) -> Graph:
    """Graph of equal cells side by side; nodes and struts that cells share appear once.

    cells (C, 3): lower corners in whole numbers of kind.divisions a cell; cell: edge of a cell in mm.
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
    """Points (n, 3) of the grid of coordinates x (a,), y (b,) and z (c,), n = a b c; x varies fastest."""
    zz, yy, xx = np.meshgrid(z, y, x, indexing="ij")
    return np.stack([xx.ravel(), yy.ravel(), zz.ravel()], axis=1)
