"""Struts that differ between octants: graded ones, and those that touch a waveguide."""

from __future__ import annotations

from typing import NamedTuple

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice import Lattice, graded, lattice_of
from ..design.waveguide import Bar, strut_radii
from ..errors import InputError
from .graph_axes import Axes
from .strut import Radius, ends, is_half_diagonal, placed, places_of, radius_of, thickened

_STATIONS = np.linspace(0.0, 1.0, 33)
# In halves of a cell, within which a node lies in a plane between octants.
_SLACK = 1e-9


def is_thickening(d: Dimensions, bar: Bar) -> bool:
    """Return True if a waveguide thickens any strut that touches it."""
    return bool(_raised(lattice_of(d), bar).any())


def thickened_nodes(d: Dimensions, bar: Bar, nodes: Array) -> Array:
    """Nodes (n, 3) in mm of a lattice's struts, with those that touch a waveguide thickened as drawn.

    The struts are half diagonals of their cells, each alone in its octant (`strut_mesh`). Nodes between
    octants take the mean of their positions in the thickened ones.
    """
    lattice, plain = lattice_of(d), radius_of(d)
    moved, count = np.zeros_like(nodes), np.zeros(len(nodes))
    for strut in np.flatnonzero(_raised(lattice, bar)).tolist():
        inside, corner, sign = _octant(lattice, strut, nodes)
        if not len(inside):
            continue
        one, met = _from_corner(lattice, strut), bar.met[strut : strut + 1]
        if not lattice.is_corner[lattice.struts[strut, 0]]:
            met = met[:, ::-1]
        law = plain if lattice.factors is None else _radius(one)
        local = (nodes[inside] - corner) * sign
        after = thickened(lattice.cell / 2.0, local, law, _thicker(one, met, bar.half))
        moved[inside] += corner + sign * after - nodes[inside]
        count[inside] += 1.0
    found = nodes + moved / np.maximum(count, 1.0)[:, None]
    # Exactly where it was: what lies in a plane between octants stays there.
    still = np.abs(found - nodes) < 1e-9 * lattice.cell
    return np.where(still, nodes, found)


def graded_nodes(d: Dimensions, nodes: Array) -> Array:
    """Nodes (n, 3) in mm of uniform struts moved to those of graded ones.

    As `SweptNodes` moves them. Raises InputError for struts that fill their cell.
    """
    lattice = lattice_of(d)
    assert lattice.factors is not None
    widest = 2.0 * float(lattice.radii(_STATIONS).max())
    if widest > 0.4 * d.cell:
        raise InputError(
            f"graded struts of {widest:.4g} mm fill their cell of {d.cell:g} mm",
            "[grading]",
            f"choose factors that give at most {0.4 * d.cell:g} mm",
        )
    return SweptNodes(attrs.evolve(lattice, factors=None), nodes).of(lattice)


class Places(NamedTuple):
    """Nodes (p,), their struts (p,), and their coordinates in these (`strut.placed`)."""

    node: Array
    strut: Array
    at: Array


class SweptNodes:
    """Nodes (n, 3) in mm of the struts of a lattice of half diagonals, to be swept again with other radii.

    Each node keeps its position along its octant's strut and, in radii, across it. Nodes between octants get
    the mean of their positions in them. Struts that meet have one radius at their node and nearly the same
    near it, so the positions agree to rounding except for steep gradings.
    """

    def __init__(self, lattice: Lattice, nodes: Array) -> None:
        self._lattice, self._nodes = lattice, nodes
        self._half = half = lattice.cell / 2.0
        starts = lattice.is_corner[lattice.struts[:, 0]][:, None]
        self._struts = np.where(starts, lattice.struts, lattice.struts[:, ::-1])
        self._node, self._strut = _octants_of(lattice, nodes)
        corner, centre = (lattice.nodes[self._struts[self._strut, end]] for end in (0, 1))
        self._corner, self._sign = corner, np.sign(centre - corner)
        self._count = np.bincount(self._node, minlength=len(nodes))
        law = self._law(lattice, np.arange(len(self._node)))
        self._places = places_of(half, law, (nodes[self._node] - corner) * self._sign)
        self._ends = ends(half, law, self._places[:, :2])

    @property
    def places(self) -> Places:
        """Coordinates of each node in its strut."""
        return Places(self._node, self._strut, self._places)

    def strut_of(self, points: Array) -> Array:
        """Strut (p,) in whose octant each of some points (p, 3) in mm lies; no point may lie between two."""
        found = np.full(len(points), -1)
        point, strut = _octants_of(self._lattice, points)
        found[point] = strut
        return found

    def of(self, other: Lattice) -> Array:
        """The nodes (n, 3) in mm of struts of other radii or factors, in as many cells; those given where
        none of their struts changes."""
        own = self._lattice
        rows = np.flatnonzero(self._changed(other)[self._strut])
        if not len(rows):
            return self._nodes
        at, near = self._places[rows], (self._ends[0][rows], self._ends[1][rows])
        before = self._nodes[self._node[rows]]
        after = placed(self._half, self._law(other, rows), at, near)
        moved = self._corner[rows] + self._sign[rows] * after - before
        total = [np.bincount(self._node[rows], column, len(self._nodes)) for column in moved.T]
        mean = np.column_stack(total) / np.maximum(self._count, 1)[:, None]
        # Exactly where it was: what lies in a plane between octants stays there.
        mean[np.abs(mean) < 1e-9 * own.cell] = 0.0
        return np.asarray(self._nodes + mean)

    def _changed(self, other: Lattice) -> Array:
        """Mask (E,) of struts with other radii."""
        own = self._lattice
        sizes = [(x.junction_radius, x.midspan_radius, x.growth) for x in (own, other)]
        if sizes[0] != sizes[1]:
            return np.ones(len(own.struts), bool)
        return np.asarray((own.node_factors != other.node_factors)[own.struts].any(axis=1))

    def _law(self, lattice: Lattice, rows: Array) -> Radius:
        """Radius of the strut of each row, from its cell's corner to the centre."""
        if lattice.factors is None:
            return lattice.radius
        first, last = (lattice.factors[self._struts[self._strut[rows], end]] for end in (0, 1))
        return lambda t: np.asarray(graded(lattice.radius(t), t, first, last, lattice.growth))


def _octants_of(lattice: Lattice, nodes: Array) -> tuple[Array, Array]:
    """Numbers (k,) of nodes and (k,) of the struts in whose octant they lie: in several for those between."""
    half = lattice.cell / 2.0
    at_ends = lattice.nodes[lattice.struts] / half
    least = at_ends.min(axis=(0, 1))
    place = np.rint(at_ends.min(axis=1) - least).astype(int)
    shape = place.max(axis=0) + 1
    strut_at = np.full(shape, -1)
    strut_at[tuple(place.T)] = np.arange(len(place))
    at = nodes / half - least
    low, high = (np.floor(at + slack).astype(int) for slack in (-_SLACK, _SLACK))
    found: list[tuple[Array, Array]] = []
    for side in np.ndindex(2, 2, 2):
        # Where a node lies in no plane between octants both are one, and count once.
        own = np.where(side, high, low)
        other = (np.array(side) == 0) | (high != low)
        rows = np.flatnonzero((other & (own >= 0) & (own < shape)).all(axis=1))
        struts = strut_at[tuple(own[rows].T)]
        found.append((rows[struts >= 0], struts[struts >= 0]))
    node, strut = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return node, strut


def _from_corner(lattice: Lattice, strut: int) -> Lattice:
    """A lattice of one strut, from its cell's corner to the centre."""
    ends = lattice.struts[strut : strut + 1]
    return attrs.evolve(lattice, struts=ends if lattice.is_corner[ends[0, 0]] else ends[:, ::-1])


def _radius(one: Lattice) -> Radius:
    return lambda t: one.radii(t)[0]


def _thicker(one: Lattice, met: Array, half: float) -> Radius:
    """Radius of the single strut of a lattice, touching a waveguide (`strut_radii`)."""
    return lambda t: strut_radii(one, met, half, t)[0]


def in_replaced(d: Dimensions, bar: Bar, points: Array) -> Array:
    """Return a mask (n,) of points (n, 3) in mm in the octant of a strut that the waveguide replaces.

    Of other kinds than half diagonals: of points that such a strut is nearest to.
    """
    lattice = lattice_of(d)
    found = np.zeros(len(points), bool)
    if not is_half_diagonal(d):
        at = lattice.nodes[lattice.struts[bar.replaced]].reshape(-1, 3)
        if len(at):
            reach = float(lattice.radii(_STATIONS).max())
            around = (points > at.min(axis=0) - reach) & (points < at.max(axis=0) + reach)
            rows = np.flatnonzero(around.all(axis=1))
            found[rows] = bar.replaced[Axes(lattice).nearest(points[rows])]
        return found
    for strut in np.flatnonzero(bar.replaced).tolist():
        found[_octant(lattice, strut, points)[0]] = True
    return found


def _raised(lattice: Lattice, bar: Bar) -> Array:
    """Return a mask (E,) of struts that a waveguide thickens somewhere."""
    more = strut_radii(lattice, bar.met, bar.half, _STATIONS) - lattice.radii(_STATIONS)
    return np.asarray((more > 1e-9 * lattice.cell).any(axis=1))


def _octant(lattice: Lattice, strut: int, points: Array) -> tuple[Array, Array, Array]:
    """Numbers (k,) of points in a strut's octant, its corner (3,) in mm and signs of the direction inward."""
    first, second = lattice.struts[strut]
    corner, centre = (first, second) if lattice.is_corner[first] else (second, first)
    low, high = np.sort(lattice.nodes[[corner, centre]], axis=0)
    slack = 1e-9 * lattice.cell
    inside = np.flatnonzero(((points >= low - slack) & (points <= high + slack)).all(axis=1))
    return inside, lattice.nodes[corner], np.sign(lattice.nodes[centre] - lattice.nodes[corner])
