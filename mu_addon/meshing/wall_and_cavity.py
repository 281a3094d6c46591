"""The membrane, its two caps and the cavity in them, as a revolved structured grid.

A wall of 0.6 mm along arcs that rise by up to 0.9 mm has no room for straight diagonals. One map from the
profile therefore places its elements and all mid-edge nodes, curved exactly where it is second order.
"""

from __future__ import annotations

import math
from itertools import pairwise

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.profile import foot, outer_radius, outer_slope, under_profile
from ..errors import InputError, MeshingError
from .mesh import boundary_faces, edges_of, oriented

# A cube split in five, in the two mirror images that alternate so that diagonals of neighbours meet;
# a corner is numbered 4 i + 2 j + k.
_FIVE_EVEN = np.array([[0, 6, 5, 3], [4, 0, 6, 5], [2, 0, 6, 3], [1, 0, 5, 3], [7, 6, 5, 3]])
_FIVE_ODD = np.array([[4, 2, 1, 7], [0, 4, 2, 1], [6, 4, 2, 7], [5, 4, 1, 7], [3, 2, 1, 7]])

# Angle in radians by which the profile may bend away from the lattice within one element.
_LARGEST_TURN = math.radians(40)


@attrs.frozen(eq=False)
class Meridian:
    """The half plane (radius, z) of a unit's membrane: every point of the solid from two coordinates.

    p is the height in mm of the point on the outer profile where a wall normal starts. q runs from 0 on the
    profile to 1 on the cavity and, inside the caps, to 2 on the axis. `cuts` are the two heights p whose
    normals end at the cavity's rims.
    """

    d: Dimensions
    cuts: tuple[float, float]

    @classmethod
    def of(cls, d: Dimensions) -> Meridian:
        """The meridian of a unit's dimensions; raises InputError where the caps leave no cavity."""
        top = d.height
        low, high = foot(d, [d.base_cap, top - d.tip_cap]).tolist()
        if not 0 < low < high < top:
            raise InputError(
                "the end caps leave no cavity",
                f"base cap {d.base_cap:g} mm and tip cap {d.tip_cap:g} mm of {top:g} mm",
                "make the caps thinner than a chamber and thicker than the wall is steep there",
            )
        return cls(d, (low, high))

    def point(self, p: Array, q: Array) -> Array:
        """Points (n, 2) of the solid, (radius, z) in mm, at coordinates p in mm and q, (n,) each."""
        d = self.d
        found = under_profile(d, p, np.minimum(q, 1.0))
        for end, cut, cap in ((0.0, self.cuts[0], d.base_cap), (d.height, self.cuts[1], -d.tip_cap)):
            in_cap = p <= cut if cap > 0 else p >= cut
            share = (p[in_cap] - end) / (cut - end)
            depth = q[in_cap, None]
            profile = np.column_stack([outer_radius(d, p[in_cap]), p[in_cap]])
            # The core's flank follows the profile, from the cavity's rim to about half a cap inside the
            # end's edge: a straight one would cross a neck's profile under a thick cap.
            edge = outer_radius(d, np.array([end, cut]))
            rim = under_profile(d, np.array([cut]))[0, 0]
            wall = float(d.wall_at(end)[0])
            widths = min(max(wall, 0.5 * abs(cap)), 0.5 * edge[0]), edge[1] - rim
            width = widths[0] + share * (widths[1] - widths[0])
            flank = np.column_stack([profile[:, 0] - width, end + share * cap])
            axis = flank * [0.0, 1.0]
            ring = profile + np.minimum(depth, 1.0) * (flank - profile)
            found[in_cap] = np.where(depth > 1.0, flank + (depth - 1.0) * (axis - flank), ring)
        return found


def stations(meridian: Meridian, edge_mm: float) -> Array:
    """Heights p (n,) in mm on the profile that divide every arc, cut at the caps, into lengths near edge_mm.

    Ascending from 0 to the unit's height. An arc is divided further where one part would bend away from the
    lattice by more than 40 degrees.
    """
    d, (low, high) = meridian.d, meridian.cuts
    joints = np.array([0.0, d.b, d.cell / 2, d.cell - d.b])
    ends = (np.arange(d.count)[:, None] * d.cell + joints).ravel()[1:]
    # An arc end closer to a cut than this would leave a sliver; the arcs join smoothly, so it may go.
    gap = 0.25 * min(edge_mm, d.a, d.b)
    ends = ends[(np.abs(ends - low) > gap) & (np.abs(ends - high) > gap)]
    breaks = np.sort(np.concatenate([[0.0, low, high, d.height], ends]))
    pieces = []
    for start, end in pairwise(breaks):
        z = np.linspace(start, end, 17)
        length = np.hypot(np.diff(z), np.diff(outer_radius(d, z))).sum()
        # The lattice around a bladder has straight edges: one element an arc would cut through them.
        turned = float(np.arctan(outer_slope(d, start)) - np.arctan(outer_slope(d, end)))
        parts = max(division(length, edge_mm), math.ceil(turned / _LARGEST_TURN))
        pieces.append(np.linspace(start, end, parts + 1)[:-1])
    return np.append(np.concatenate(pieces), d.height)


def division(length: float, edge: float) -> int:
    """Number of equal parts, at least 1, that divide a length into parts nearest to `edge`, in its unit."""
    return max(1, int(length / edge + 0.5))


@attrs.frozen(eq=False)
class Membrane:
    """Linear tetrahedra of the membrane and the middles that make them quadratic.

    nodes (n, 3) in mm, tets (m, 4); cavity (f, 3): triangles of the cavity, normals out of the
    solid; middles (e, 3) in mm: on the true surface, of each of `edges_of(tets)`.
    """

    nodes: Array
    tets: Array
    cavity: Array
    middles: Array


def membrane_mesh(meridian: Meridian, p: Array, sectors: int, layers: int, rings: int) -> Membrane:
    """Linear tetrahedra of the membrane at x >= 0: the grid of stations p (n,) in mm revolved from +y to -y.

    sectors: elements around; layers: through the wall; rings: from wall to axis in the caps.
    """
    low, high = meridian.cuts
    q = np.concatenate([np.linspace(0, 1, layers + 1), 1 + np.arange(1, rings + 1) / rings])
    angle = np.linspace(0, math.pi, sectors + 1)
    at_cap = (p <= low) | (p >= high)
    ids = np.full((len(p), sectors + 1, len(q)), -1)
    exists = np.broadcast_to(((q <= 1)[None, :] | at_cap[:, None])[:, None, :], ids.shape).copy()
    exists[:, 1:, -1] = False
    ids[exists] = np.arange(np.count_nonzero(exists))
    ids[:, 1:, -1] = ids[:, :1, -1]
    i, j, k = np.nonzero(exists)
    coordinates = np.column_stack([p[i], angle[j], q[k]])
    nodes = _revolved(meridian, coordinates)

    capped = (p[1:] <= low) | (p[:-1] >= high)
    tets = oriented(nodes, _five_each(ids, capped[:, None] | (q[1:] <= 1)[None, :]))

    edges, _ = edges_of(tets)
    ends = coordinates[edges]
    # On the axis the angle means nothing: an edge that starts there runs in the plane of its other end.
    axial = ends[..., 2] == 2.0
    ends[..., 1] = np.where(axial & ~axial[:, ::-1], ends[:, ::-1, 1], ends[..., 1])
    middles = _revolved(meridian, ends.mean(axis=1))

    faces, _ = boundary_faces(tets)
    depth, height = coordinates[:, 2], coordinates[:, 0]
    on_cavity = (depth == 1.0) & ~((height < low) | (height > high))
    on_cavity |= (depth > 1.0) & ((height == low) | (height == high))
    return Membrane(nodes, tets, faces[np.all(on_cavity[faces], axis=1)], middles)


def _five_each(ids: Array, solid: Array) -> Array:
    """Tetrahedra (m, 4), five for each hexahedron with solid[i, k]; on the axis, three for each prism."""
    ni, nj, nk = (n - 1 for n in ids.shape)
    i, j, k = np.indices((ni, nj, nk)).reshape(3, -1)
    corner = np.stack([ids[i + a, j + b, k + c] for a in (0, 1) for b in (0, 1) for c in (0, 1)], axis=1)
    filled, even = solid[i, k], (i + j + k) % 2 == 0
    tets = np.vstack(
        [
            corner[filled & even][:, _FIVE_EVEN].reshape(-1, 4),
            corner[filled & ~even][:, _FIVE_ODD].reshape(-1, 4),
        ]
    )
    ordered = np.sort(tets, axis=1)
    return tets[np.all(np.diff(ordered, axis=1) > 0, axis=1)]


def _revolved(meridian: Meridian, coordinates: Array) -> Array:
    """Points (n, 3) in mm from (p, angle, q), exactly on the mirror plane at both ends of the turn."""
    p, angle, q = coordinates.T
    radius, z = meridian.point(p, q).T
    x, y = radius * np.sin(angle), radius * np.cos(angle)
    x[(angle == 0) | (angle == np.pi)] = 0.0
    return np.column_stack([x, y, z])


class WallGrid:
    """Grid of a unit's wall and caps at x >= 0, repeated node by node for units near to it."""

    def __init__(self, d: Dimensions, meridian_mm: float, hoop_mm: float, layers: int) -> None:
        """d: as printed; meridian_mm, hoop_mm: of elements along the meridian and around; layers: of them."""
        self.meridian = Meridian.of(d)
        self._heights = stations(self.meridian, meridian_mm)
        # Alternating diagonals mirror each other about y = 0 only if both quarters have as many sectors.
        self._counts = 2 * division(d.R * math.pi / 2, hoop_mm), layers, division(d.r, hoop_mm)
        self.membrane = membrane_mesh(self.meridian, self._heights, *self._counts)

    def of(self, b: Dimensions) -> Membrane:
        """Membrane of other dimensions of the same cell and envelope; raises MeshingError."""
        a = self.meridian.d
        if a.count != b.count or not np.allclose(a.bounds, b.bounds, rtol=0, atol=1e-9 * a.cell):
            raise unmovable("its envelope differs")
        second = Meridian.of(b)
        breaks = [_breaks(m) for m in (self.meridian, second)]
        order = np.argsort(breaks[0])
        from_, to = (x[order] for x in breaks)
        if not (np.diff(to) > 0).all():
            raise unmovable("its profile differs")
        made = membrane_mesh(second, np.interp(self._heights, from_, to), *self._counts)
        if not np.array_equal(self.membrane.tets, made.tets):
            raise unmovable("its membrane folds")
        return made


def _breaks(meridian: Meridian) -> Array:
    """Heights on the profile where a part ends: cuts, arcs, ends."""
    d = meridian.d
    joints = np.arange(d.count)[:, None] * d.cell + np.array([0.0, d.b, d.cell / 2, d.cell - d.b])
    return np.concatenate([joints.ravel(), [d.height], meridian.cuts])


def unmovable(why: str) -> MeshingError:
    """Error of a mesh that cannot be moved to another unit."""
    return MeshingError(
        f"the mesh of a unit cannot be moved: {why}", "unit", "make a new mesh of the other unit"
    )
