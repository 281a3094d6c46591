"""The waveguide as a stiff cylinder in the lattice: the elements it touches and the share of each."""

from __future__ import annotations

import itertools
from typing import Any

import attrs
import numpy as np

Array = np.ndarray[Any, Any]

# Between two vertex heights the slice area is smooth but where an edge meets the circle: many short
# Gauss rules lose less at such a kink than one long one.
_PIECES = 16
_GAUSS = np.polynomial.legendre.leggauss(6)
LEAST_SHARE = 1e-9
"""Share of an element below which a path does not touch it."""


def _disc_polygon_area(polygon: Array, radius: float) -> Array:
    """Area (s,) common to a disc about the origin and convex polygons (s, v, 2), counter-clockwise or not.

    The sum over edges of the signed area of the disc with the triangle (origin, a, b): a triangle
    where the edge is inside the disc, a sector where it is outside.
    """
    a = polygon
    b = np.roll(polygon, -1, axis=1)
    d = b - a
    dd = np.maximum((d**2).sum(axis=2), 1e-300)
    ad = (a * d).sum(axis=2)
    discriminant = ad**2 - dd * ((a**2).sum(axis=2) - radius**2)
    root = np.sqrt(np.maximum(discriminant, 0.0))
    t0 = np.where(discriminant > 0, np.clip((-ad - root) / dd, 0, 1), 0.0)
    t1 = np.where(discriminant > 0, np.clip((-ad + root) / dd, 0, 1), 0.0)
    p = a + t0[..., None] * d
    q = a + t1[..., None] * d

    def cross(u: Array, v: Array) -> Array:
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    def angle(u: Array, v: Array) -> Array:
        return np.arctan2(cross(u, v), (u * v).sum(axis=-1))

    area = 0.5 * (radius**2 * (angle(a, p) + angle(q, b)) + cross(p, q))
    return np.abs(area.sum(axis=1))


def _slices(tets: Array, z: Array) -> Array:
    """Plane sections of tetrahedra (m, 4, 3) at heights z (m,): quadrilaterals (m, 4, 2).

    With the vertices sorted by height, a plane cuts either three or four edges; three repeat a point.
    """
    order = np.argsort(tets[:, :, 2], axis=1)
    v = np.take_along_axis(tets, order[:, :, None], axis=1)
    h = v[:, :, 2]

    def cut(i: int, j: int) -> Array:
        span = h[:, j] - h[:, i]
        t = np.where(span > 0, (z - h[:, i]) / np.where(span > 0, span, 1.0), 0.0)
        return v[:, i, :2] + np.clip(t, 0, 1)[:, None] * (v[:, j, :2] - v[:, i, :2])

    low, high = z < h[:, 1], z >= h[:, 2]
    c01, c02, c03, c12, c13, c23 = cut(0, 1), cut(0, 2), cut(0, 3), cut(1, 2), cut(1, 3), cut(2, 3)
    first = np.where(low[:, None], c01, np.where(high[:, None], c03, c02))
    second = np.where(low[:, None], c02, np.where(high[:, None], c13, c03))
    third = np.where(low[:, None], c03, np.where(high[:, None], c23, c13))
    fourth = np.where(low[:, None], c03, np.where(high[:, None], c23, c12))
    return np.stack([first, second, third, fourth], axis=1)


def cylinder_overlap(corners: Array, start: Array, end: Array, radius: float) -> Array:
    """Volume (m,) in mm3 of straight tetrahedra (m, 4, 3) inside a flat-ended cylinder, all in mm.

    start, end (3,): the ends of its axis. Exact slice areas (disc with polygon), Gauss quadrature along the
    axis between the vertices' heights; the elements of a mesh add up to the cylinder within about 1e-6.
    """
    start, end = np.asarray(start, float), np.asarray(end, float)
    length = float(np.linalg.norm(end - start))
    axis = (end - start) / length
    helper = np.eye(3)[np.argmin(np.abs(axis))]
    e1 = np.cross(axis, helper)
    e1 /= np.linalg.norm(e1)
    frame = np.stack([e1, np.cross(axis, e1), axis], axis=1)
    local = (corners - start) @ frame
    overlap = np.zeros(len(corners))
    reach = (
        (local[:, :, 2].max(axis=1) > 0)
        & (local[:, :, 2].min(axis=1) < length)
        & (local[:, :, 0].min(axis=1) < radius)
        & (local[:, :, 0].max(axis=1) > -radius)
        & (local[:, :, 1].min(axis=1) < radius)
        & (local[:, :, 1].max(axis=1) > -radius)
    )
    near = np.nonzero(reach)[0]
    tets = local[near]
    heights = np.clip(np.sort(tets[:, :, 2], axis=1), 0.0, length)
    starts = np.arange(_PIECES)[:, None]
    at = ((starts + (1 + _GAUSS[0]) / 2) / _PIECES).ravel()
    weights = np.tile(_GAUSS[1] / 2 / _PIECES, _PIECES)
    total = np.zeros(len(near))
    for lower, upper in itertools.pairwise(heights.T):
        z = lower + at[:, None] * (upper - lower)
        every = np.broadcast_to(tets, (len(at), *tets.shape)).reshape(-1, 4, 3)
        area = _disc_polygon_area(_slices(every, z.ravel()), radius).reshape(z.shape)
        total += (upper - lower) * (weights @ area)
    overlap[near] = total
    return overlap


@attrs.frozen(eq=False)
class Inclusion:
    """Region of interest of a path: share (m,) of each element's volume inside the waveguide's cylinder.

    radius_mm and length_mm: of the cylinder.
    """

    share: Array
    radius_mm: float
    length_mm: float

    @property
    def touched(self) -> Array:
        """Mask (m,) of elements that the cylinder touches: the paper's region of interest."""
        return self.share > 0

    @property
    def cylinder_volume_mm3(self) -> float:
        """Volume in mm3 of the cylinder itself, pi r^2 times its length."""
        return float(np.pi * self.radius_mm**2 * self.length_mm)


def straight_inclusion(corners: Array, lattice: Array, start: Array, end: Array, radius: float) -> Inclusion:
    """Inclusion of one straight path in the lattice elements of a mesh.

    corners (m, 4, 3), start and end (3,) and radius in mm; lattice (m,) bool, elsewhere the share stays 0;
    shares below `LEAST_SHARE` are rounding at a face that the cylinder touches and count as 0.
    """
    a, b, c, d = np.moveaxis(corners, 1, 0)
    volume = np.abs(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)) / 6
    share = np.where(lattice, cylinder_overlap(corners, start, end, radius) / volume, 0.0)
    share[share < LEAST_SHARE] = 0.0
    length = float(np.linalg.norm(np.asarray(end, float) - np.asarray(start, float)))
    return Inclusion(np.minimum(share, 1.0), radius, length)
