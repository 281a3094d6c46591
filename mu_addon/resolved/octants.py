"""Struts that are not all alike, octant by octant: graded ones, and those that a waveguide meets."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import attrs
import numpy as np

from ..design.dimensions import Dimensions
from ..design.lattice import Lattice, lattice_of
from ..design.waveguide import Bar, strut_radii
from ..errors import InputError
from ..meshing.mesh import Array
from .strut import Radius, is_half_diagonal, radius_of, thickened

_STATIONS = np.linspace(0.0, 1.0, 33)


def is_thickening(d: Dimensions, bar: Bar) -> bool:
    """Whether a waveguide thickens any of the struts that it meets."""
    return bool(_raised(lattice_of(d), bar).any())


def thickened_nodes(d: Dimensions, bar: Bar, nodes: Array) -> Array:
    """Nodes (n, 3) in mm of a lattice's struts where the struts that a waveguide meets are as thick as drawn.

    The struts are half diagonals of their cells, each alone in its octant (`strut_mesh`). Nodes between
    octants take the mean of their places in those whose struts are thickened.
    """
    lattice, plain = lattice_of(d), radius_of(d)

    def laws(strut: int) -> tuple[Radius, Radius]:
        one, met = _from_corner(lattice, strut), bar.met[strut : strut + 1]
        if not lattice.is_corner[lattice.struts[strut, 0]]:
            met = met[:, ::-1]
        own = plain if lattice.factors is None else _radius(one)
        return own, lambda t: strut_radii(one, met, bar.half, t)[0]

    return _swept_again(lattice, np.flatnonzero(_raised(lattice, bar)).tolist(), laws, nodes)


def graded_nodes(d: Dimensions, nodes: Array) -> Array:
    """Nodes (n, 3) in mm of a lattice's struts that are alike everywhere where graded struts have them.

    As `thickened_nodes`. Struts that meet have one radius at their node and nearly so beside it, so the mean
    of places between octants is within rounding of either but for steep gradings. Raises InputError for
    struts that fill their cell.
    """
    lattice, plain = lattice_of(d), radius_of(d)
    assert lattice.factors is not None
    widest = 2.0 * float(lattice.radii(_STATIONS).max())
    if widest > 0.4 * d.cell:
        raise InputError(
            f"graded struts of {widest:.4g} mm fill their cell of {d.cell:g} mm",
            "[grading]",
            f"choose factors that give at most {0.4 * d.cell:g} mm",
        )

    def laws(strut: int) -> tuple[Radius, Radius]:
        return plain, _radius(_from_corner(lattice, strut))

    return _swept_again(lattice, range(len(lattice.struts)), laws, nodes)


def resized_nodes(d: Dimensions, other: Dimensions, nodes: Array) -> Array:
    """Nodes (n, 3) in mm of a lattice's struts where those of other diameters or grading have them.

    As `thickened_nodes`; both of one cell and envelope. Raises InputError for struts that are no half
    diagonals.
    """
    first, second = lattice_of(d), lattice_of(other)
    apart = np.abs(first.radii(_STATIONS) - second.radii(_STATIONS)).max(axis=1)
    changed = np.flatnonzero(apart > 0.0).tolist()
    if not changed:
        return nodes
    if not is_half_diagonal(d):
        raise InputError(
            f"the mesh of struts of lattice {d.kind.name!r} cannot be moved to other diameters",
            "[lattice] kind",
            "choose body-centred or body-centred-straight",
        )

    if first.factors is None and second.factors is None:
        return _all_alike(d, radius_of(other), nodes)

    def laws(strut: int) -> tuple[Radius, Radius]:
        return _radius(_from_corner(first, strut)), _radius(_from_corner(second, strut))

    return _swept_again(first, changed, laws, nodes)


def _all_alike(d: Dimensions, other: Radius, nodes: Array) -> Array:
    """Nodes (n, 3) in mm of struts that are alike everywhere, all octants at once; as `_swept_again`."""
    half = d.cell / 2.0
    shift = np.array([half, half, 0.0])
    corner = d.cell * np.round((nodes - shift) / d.cell) + shift
    sign = np.where(nodes < corner, -1.0, 1.0)
    local = np.minimum((nodes - corner) * sign, half)
    found = corner + sign * thickened(half, local, radius_of(d), other)
    return np.where(np.abs(found - nodes) < 1e-9 * d.cell, nodes, found)


def _swept_again(
    lattice: Lattice,
    struts: Iterable[int],
    laws: Callable[[int], tuple[Radius, Radius]],
    nodes: Array,
) -> Array:
    """Nodes (n, 3) in mm of octants moved from one law of their strut's radius to another, both of `laws`."""
    moved, count = np.zeros_like(nodes), np.zeros(len(nodes))
    for strut in struts:
        inside, corner, sign = _octant(lattice, strut, nodes)
        if not len(inside):
            continue
        local = (nodes[inside] - corner) * sign
        law, other = laws(strut)
        moved[inside] += corner + sign * thickened(lattice.cell / 2.0, local, law, other) - nodes[inside]
        count[inside] += 1.0
    found = nodes + moved / np.maximum(count, 1.0)[:, None]
    # Exactly where it was: what lies in a plane between octants stays there.
    still = np.abs(found - nodes) < 1e-9 * lattice.cell
    return np.where(still, nodes, found)


def _from_corner(lattice: Lattice, strut: int) -> Lattice:
    """A lattice of one strut, from its cell's corner to the centre."""
    ends = lattice.struts[strut : strut + 1]
    return attrs.evolve(lattice, struts=ends if lattice.is_corner[ends[0, 0]] else ends[:, ::-1])


def _radius(one: Lattice) -> Radius:
    return lambda t: one.radii(t)[0]


def in_replaced(d: Dimensions, bar: Bar, points: Array) -> Array:
    """Whether points (n, 3) in mm lie in the octant of a strut whose place the waveguide takes, (n,)."""
    lattice = lattice_of(d)
    found = np.zeros(len(points), bool)
    for strut in np.flatnonzero(bar.replaced).tolist():
        found[_octant(lattice, strut, points)[0]] = True
    return found


def _raised(lattice: Lattice, bar: Bar) -> Array:
    """Whether each strut (E,) is thicker somewhere beside a waveguide than without it."""
    more = strut_radii(lattice, bar.met, bar.half, _STATIONS) - lattice.radii(_STATIONS)
    return np.asarray((more > 1e-9 * lattice.cell).any(axis=1))


def _octant(lattice: Lattice, strut: int, points: Array) -> tuple[Array, Array, Array]:
    """Numbers (k,) of points in a strut's octant, its corner (3,) in mm and signs of its way inward."""
    first, second = lattice.struts[strut]
    corner, centre = (first, second) if lattice.is_corner[first] else (second, first)
    low, high = np.sort(lattice.nodes[[corner, centre]], axis=0)
    slack = 1e-9 * lattice.cell
    inside = np.flatnonzero(((points >= low - slack) & (points <= high + slack)).all(axis=1))
    return inside, lattice.nodes[corner], np.sign(lattice.nodes[centre] - lattice.nodes[corner])
