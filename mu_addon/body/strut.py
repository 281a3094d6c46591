"""One strut of a body-centred lattice, swept from junction to junction: an eighth of its cell.

The half diagonal from a cell's corner to its centre lies in the octant between them. Each of the eight struts
that meet at an end has one octant, and the planes between octants cut them where they merge. A disc swept
along the strut, its ends projected onto the three planes of either corner, is therefore exactly the printed
lattice with its fillets; its mirror images make up the whole lattice.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np

from ..arrays import Array
from ..design.lattice_kinds import LatticeKind
from ..errors import InputError
from ..meshing.mesh import LATTICE, Mesh, edges_of, oriented, second_order

# Radius in mm of a strut at fractions 0 .. 1 of its way from the cell's corner to its centre, of any shape.
Radius = Callable[[Array], Array]

_ALONG = np.ones(3) / math.sqrt(3.0)
# Across the strut: towards an edge between two planes of the octant, so that a sector lies in one plane.
_ACROSS = np.array([[2.0, -1.0, -1.0], [0.0, 1.0, -1.0]]) / np.sqrt([[6.0], [2.0]])
# The strut's radius changes along it: its ends are found by iteration, at slopes below 0.3 to rounding.
_ITERATIONS = 60
_CLOSE = 1e-15


class Struts(Protocol):
    """The part of a unit's `Dimensions` that determines its struts' mesh, in mm."""

    @property
    def cell(self) -> float:
        """Edge of a cell."""

    @property
    def kind(self) -> LatticeKind:
        """Course of the struts, and their radius along them."""

    @property
    def junction_diameter(self) -> float:
        """Diameter at the junctions."""

    @property
    def midspan_diameter(self) -> float:
        """Diameter at mid-span."""


def strut_mesh(d: Struts, rings: int, layers: int) -> Mesh:
    """Quadratic tetrahedra of one octant [0, cell/2]^3 mm of a body-centred lattice, curved as its strut is.

    rings: of elements from the strut's axis to its surface, six to the first; layers: along it. No node is
    clamped. Raises InputError for a lattice of another kind, and for struts as wide as the octant.
    """
    half = d.cell / 2.0
    if not is_half_diagonal(d):
        raise InputError(
            f"struts of lattice {d.kind.name!r} are not the half diagonals of its cell",
            "[lattice] kind",
            "choose body-centred or body-centred-straight",
        )
    if max(d.junction_diameter, d.midspan_diameter) > 0.8 * half:
        raise InputError(
            f"struts of {max(d.junction_diameter, d.midspan_diameter):g} mm fill their cell of {d.cell:g} mm",
            "[lattice] midspan_diameter_mm",
            f"choose at most {0.8 * half:g} mm",
        )
    points, triangles = disc(rings)
    count = len(points)
    levels = np.linspace(0.0, 1.0, layers + 1)
    at = np.column_stack([np.tile(points, (layers + 1, 1)), np.repeat(levels, count)])
    law = radius_of(d)
    nodes = placed(half, law, at)
    # Layers are tilted: a diagonal from what lies farther along to what lies less far leans least. The other
    # ones make E[100] of the lattice up to 70 % too high in place of 10 (docs/engineering/method.md).
    along = np.round(nodes @ _ALONG / half, 9).reshape(layers + 1, count)
    first = np.argsort(np.argsort(-(along[1:] + along[:-1]), axis=1, kind="stable"), axis=1)
    turn = np.argsort(first[:, triangles], axis=2)
    below = np.take_along_axis(np.broadcast_to(triangles, turn.shape), turn, axis=2)
    a, b, c = (below + count * np.arange(layers)[:, None, None]).reshape(-1, 3).T
    # Each prism in three, its sides cut by one order of the corners, so that neighbours agree.
    tets = np.concatenate(
        [
            np.stack([a, b, c, c + count], axis=1),
            np.stack([a, b, b + count, c + count], axis=1),
            np.stack([a, a + count, b + count, c + count], axis=1),
        ]
    )
    tets = oriented(nodes, tets)
    edges, _ = edges_of(tets)
    middles = at[edges].mean(axis=1)
    radius = np.hypot(at[:, 0], at[:, 1])[edges]
    around = (np.abs(radius[:, 0] - radius[:, 1]) < 1e-12) & (radius[:, 0] > 0)
    chord = np.hypot(middles[:, 0], middles[:, 1])
    middles[around, :2] *= (radius[around, 0] / chord[around])[:, None]
    nodes, tets, nothing = second_order(nodes, tets, tets[:0, :3], placed(half, law, middles))
    return Mesh(nodes, tets, np.full(len(tets), LATTICE), nothing, tets[0, :0], tets[0, :0])


def is_half_diagonal(d: Struts) -> bool:
    """Return True if the struts of a unit's lattice are the half diagonals of its cells."""
    return d.kind.is_half_diagonals


def disc(rings: int) -> tuple[Array, Array]:
    """Points (n, 2) of the unit disc, the centre first, and triangles (t, 3): six sectors of equal rings.

    >>> points, triangles = disc(2)
    >>> len(points), len(triangles)
    (19, 24)
    """
    points, triangles = [np.zeros((1, 2))], []
    inner, first = np.zeros(1, int), 1
    for ring in range(1, rings + 1):
        angle = 2.0 * np.pi * np.arange(6 * ring) / (6 * ring)
        points.append(ring / rings * np.column_stack([np.cos(angle), np.sin(angle)]))
        outer = first + np.arange(6 * ring)
        first += 6 * ring
        step = np.arange(6 * ring)
        sector, place = step // ring, step % ring
        own = (sector * (ring - 1) + place) % len(inner)
        triangles.append(np.column_stack([inner[own], outer, np.roll(outer, -1)]))
        more = place < ring - 1
        following = np.roll(inner, -1)[own[more]]
        triangles.append(np.column_stack([inner[own[more]], np.roll(outer, -1)[more], following]))
        inner = outer
    return np.vstack(points), np.vstack(triangles)


def radius_of(d: Struts) -> Radius:
    """Radius of a unit's struts as a function of the position along them."""
    return lambda t: d.kind.radius(t, d.junction_diameter / 2.0, d.midspan_diameter / 2.0)


def thickened(half: float, points: Array, law: Radius, other: Radius) -> Array:
    """Points (n, 3) in mm of an octant's mesh, moved to those of a strut of another radius.

    half: edge of the octant [0, half]^3 in mm; law: the radius that the mesh was made with. Nodes keep their
    position along the strut and, in radii, across it; those on the octant's planes stay on them.
    """
    return placed(half, other, places_of(half, law, points))


def places_of(half: float, law: Radius, points: Array) -> Array:
    """Coordinates (n, 3), as for `placed`, of points (n, 3) in mm of an octant; law: the strut's radius."""
    along = points @ _ALONG
    across = ((points - along[:, None] * _ALONG) @ _ACROSS.T) / law(_fraction(half, along))[:, None]
    low, high = ends(half, law, across)
    return np.column_stack([across, (along - low) / (high - low)])


def placed(half: float, law: Radius, at: Array, near: tuple[Array, Array] | None = None) -> Array:
    """Points (n, 3) in mm of coordinates (n, 3): two across the strut in radii, and 0 .. 1 from end to end.

    law: of the radius at n fractions of the way; near: `ends` of a strut near to it.
    """
    low, high = ends(half, law, at[:, :2], near)
    along = low + at[:, 2] * (high - low)
    found = along[:, None] * _ALONG + law(_fraction(half, along))[:, None] * (at[:, :2] @ _ACROSS)
    for plane in (0.0, half):
        found[np.abs(found - plane) < 1e-9 * half] = plane
    return found


def ends(
    half: float, law: Radius, across: Array, near: tuple[Array, Array] | None = None
) -> tuple[Array, Array]:
    """Both ends (n,) in mm of lines along the strut in its octant; across (n, 2): off its axis, in radii.

    near: those of a similar strut, as a start that needs few steps.
    """
    length = half * math.sqrt(3.0)
    off = across @ _ACROSS
    least, most = off.min(axis=1), off.max(axis=1)
    low, high = near or (np.zeros(len(across)), np.full(len(across), length))
    for _ in range(_ITERATIONS):
        before = low, high
        low = -math.sqrt(3.0) * law(_fraction(half, low)) * least
        high = length - math.sqrt(3.0) * law(_fraction(half, high)) * most
        moved = max(np.abs(a - b).max(initial=0.0) for a, b in zip(before, (low, high), strict=True))
        if moved < _CLOSE * length:
            break
    return low, high


def _fraction(half: float, along: Array) -> Array:
    """Fractions (n,) of the way from corner to centre."""
    return np.clip(along / (half * math.sqrt(3.0)), 0.0, 1.0)
