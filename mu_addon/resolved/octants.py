"""What a waveguide does to the struts it meets, octant by octant: it thickens them or takes their place."""

from __future__ import annotations

import numpy as np

from ..design.dimensions import Dimensions
from ..design.lattice import Lattice, lattice_of
from ..design.waveguide import Bar, strut_radii
from ..meshing.mesh import Array
from .strut import radius_of, thickened

_STATIONS = np.linspace(0.0, 1.0, 33)


def is_thickening(d: Dimensions, bar: Bar) -> bool:
    """Whether a waveguide thickens any of the struts that it meets."""
    return bool(_raised(lattice_of(d), bar).any())


def thickened_nodes(d: Dimensions, bar: Bar, nodes: Array) -> Array:
    """Nodes (n, 3) in mm of a lattice's struts where the struts that a waveguide meets are as thick as drawn.

    The struts are half diagonals of their cells, each alone in its octant (`strut_mesh`). Nodes between
    octants take the mean of their places in those whose struts are thickened.
    """
    lattice, law = lattice_of(d), radius_of(d)
    moved, count = np.zeros_like(nodes), np.zeros(len(nodes))
    for strut in np.flatnonzero(_raised(lattice, bar)).tolist():
        met = bar.met[strut : strut + 1]
        if not lattice.is_corner[lattice.struts[strut, 0]]:
            met = met[:, ::-1]
        inside, corner, sign = _octant(lattice, strut, nodes)
        local = (nodes[inside] - corner) * sign

        def radius(t: Array, met: Array = met) -> Array:
            return strut_radii(lattice, met, bar.half, t)[0]

        moved[inside] += corner + sign * thickened(d.cell / 2.0, local, law, radius) - nodes[inside]
        count[inside] += 1.0
    found = nodes + moved / np.maximum(count, 1.0)[:, None]
    # Exactly where it was: what lies in a plane between octants stays there.
    still = np.abs(found - nodes) < 1e-9 * d.cell
    return np.where(still, nodes, found)


def in_replaced(d: Dimensions, bar: Bar, points: Array) -> Array:
    """Whether points (n, 3) in mm lie in the octant of a strut whose place the waveguide takes, (n,)."""
    lattice = lattice_of(d)
    found = np.zeros(len(points), bool)
    for strut in np.flatnonzero(bar.replaced).tolist():
        found[_octant(lattice, strut, points)[0]] = True
    return found


def _raised(lattice: Lattice, bar: Bar) -> Array:
    """Whether each strut (E,) is thicker somewhere beside a waveguide than without it."""
    more = strut_radii(lattice, bar.met, bar.half, _STATIONS) - lattice.radius(_STATIONS)
    return np.asarray((more > 1e-9 * lattice.cell).any(axis=1))


def _octant(lattice: Lattice, strut: int, points: Array) -> tuple[Array, Array, Array]:
    """Numbers (k,) of points in a strut's octant, its corner (3,) in mm and signs of its way inward."""
    first, second = lattice.struts[strut]
    corner, centre = (first, second) if lattice.is_corner[first] else (second, first)
    low, high = np.sort(lattice.nodes[[corner, centre]], axis=0)
    slack = 1e-9 * lattice.cell
    inside = np.flatnonzero(((points >= low - slack) & (points <= high + slack)).all(axis=1))
    return inside, lattice.nodes[corner], np.sign(lattice.nodes[centre] - lattice.nodes[corner])
