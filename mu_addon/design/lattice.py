"""The lattice envelope as nodes and struts, cells of one kind side by side."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from .dimensions import Dimensions
from .lattice_kinds import LatticeKind


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
        """True for each node that is the centre of a cell, (N,)."""
        return self._at(self.kind.divisions // 2)

    @property
    def is_corner(self) -> NDArray[np.bool_]:
        """True for each node that is a corner of a cell, (N,)."""
        return self._at(0)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """True for each node that lies in the interior of a cell, (N,)."""
        return np.asarray(((self.grid - self.cells[0]) % self.kind.divisions != 0).all(axis=1))

    @property
    def on_face(self) -> NDArray[np.bool_]:
        """True for each strut that lies in a face of a cell, (E,)."""
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
    """A graph whose struts have thickness: radius in mm at their junctions and at mid-span.

    factors (N,): of a grading at the nodes, or None for uniform struts; growth: part of the radii in mm added
    by printing, which no factor multiplies.
    """

    junction_radius: float
    midspan_radius: float
    factors: NDArray[np.float64] | None = None
    growth: float = 0.0

    def radius(self, t: ArrayLike) -> NDArray[np.float64]:
        """Radii in mm (any shape) of a strut of factor 1 at fractions t, 0 .. 1, (any shape) of its length.

        Those of every strut where there is no grading; see `radii` otherwise.
        """
        return self.kind.radius(np.asarray(t, dtype=float), self.junction_radius, self.midspan_radius)

    def radii(self, t: ArrayLike, rows: NDArray[Any] | slice = slice(None)) -> NDArray[np.float64]:
        """Radii (e, n) in mm of the struts `rows`, by default of all, at fractions t, (n,) or (e, n).

        In a graded lattice the factor changes between a strut's nodes as sin^2(pi t/2), with zero slope at
        both, so that struts that meet have one radius.
        """
        t = np.asarray(t, dtype=float)
        struts = self.struts[rows]
        law = np.broadcast_to(self.radius(t), (len(struts), t.shape[-1]))
        if self.factors is None:
            return np.array(law)
        return graded(law, t, self.factors[struts[:, :1]], self.factors[struts[:, 1:]], self.growth)

    @property
    def node_factors(self) -> NDArray[np.float64]:
        """Factors (N,) of the grading at the nodes; 1 without a grading."""
        return np.ones(len(self.grid)) if self.factors is None else self.factors

    @property
    def node_radii(self) -> NDArray[np.float64]:
        """Radii (N,) in mm of the struts at their nodes."""
        return (float(self.radius(0.0)) - self.growth) * self.node_factors + self.growth


def graded(law: ArrayLike, t: ArrayLike, first: ArrayLike, last: ArrayLike, growth: float) -> Any:
    """Radii in mm of a strut of factors `first` and `last` at its ends, of its radii `law` at factor 1.

    t: fractions, 0 .. 1, of its length; growth: the part of the radii in mm that no factor multiplies. Arrays
    broadcast.
    """
    share = np.sin(0.5 * np.pi * np.asarray(t, float)) ** 2
    factor = first + (np.asarray(last, float) - first) * share
    return (np.asarray(law, float) - growth) * factor + growth


def lattice_of(d: Dimensions) -> Lattice:
    """Lattice of all cells of the unit's envelope; cell centres lie at (iU, jU, (k + 1/2)U) in mm."""
    return with_struts(graph_of(d), d)


def with_struts(graph: Graph, d: Dimensions, is_graded: bool = True) -> Lattice:
    """The graph with the struts of these dimensions, graded or, without `is_graded`, uniform."""
    factors = d.grading.at(graph.nodes) if is_graded and d.grading is not None else None
    radii = d.junction_diameter / 2.0, d.midspan_diameter / 2.0
    return attrs.evolve(thickened(graph, *radii), factors=factors, growth=d.strut_growth / 2.0)


def graph_of(d: Dimensions) -> Graph:
    """Nodes and struts of all cells of the unit's envelope, without thickness; cells as in `lattice_of`."""
    return _graph(d.kind, d.cells_x // 2, d.cells_y_minus, d.cells_y_plus, d.count, d.cell)


@lru_cache(maxsize=8)
def _graph(kind: LatticeKind, half_x: int, y_minus: int, y_plus: int, count: int, cell: float) -> Graph:
    """Return the graph, cached, since the rules of similar units ask for the same."""
    i, j, k = np.arange(-half_x, half_x + 1), np.arange(-y_minus, y_plus + 1), np.arange(count)
    whole, half = kind.divisions, kind.divisions // 2
    found = joined(kind, grid_points(whole * i - half, whole * j - half, whole * k), cell)
    for array in (found.cells, found.grid, found.struts):
        array.flags.writeable = False
    return found


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
