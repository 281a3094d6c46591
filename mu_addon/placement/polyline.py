"""A bent waveguide in the lattice: cylinders along a polyline, mitred where they meet."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from ..errors import InputError
from .inclusion import LEAST_SHARE, Inclusion, cylinder_overlap

Array = np.ndarray[Any, Any]

# Below this bend, in radians, two legs count as one; above the other a mitre runs out into a long spike.
_STRAIGHT = 1e-6
_SHARPEST = np.radians(135.0)


def legs(points: Array) -> Array:
    """The points (k, 3) of a polyline (n, 3) in mm where it bends, and its two ends."""
    points = np.asarray(points, float)
    way = np.diff(points, axis=0)
    way = way / np.linalg.norm(way, axis=1)[:, None]
    bent = np.linalg.norm(np.diff(way, axis=0), axis=1) > _STRAIGHT
    return points[np.concatenate([[True], bent, [True]])]


def polyline_overlap(corners: Array, points: Array, radius: float) -> Array:
    """Volume (m,) in mm3 of straight tetrahedra (m, 4, 3) inside a tube about a polyline (n, 3), all in mm.

    Neighbouring cylinders are cut by the plane that bisects their bend: they neither overlap nor leave a gap,
    and the tube's volume is pi r^2 times the polyline's length. Its two ends are flat. Raises InputError for
    a bend above 135 degrees or a leg shorter than its mitres.
    """
    at = legs(points)
    way = np.diff(at, axis=0)
    length = np.linalg.norm(way, axis=1)
    way = way / length[:, None]
    bend = np.arccos(np.clip((way[1:] * way[:-1]).sum(axis=1), -1, 1))
    spike = radius * np.tan(np.minimum(bend, _SHARPEST) / 2)
    before, after = np.append(0.0, spike), np.append(spike, 0.0)
    if (bend > _SHARPEST).any() or (before + after > length).any():
        raise InputError(
            f"a path of radius {radius:g} mm bends too sharply for its legs of {length.min():.4g} mm or more",
            "a waveguide's path",
            "bend it by less, or choose longer legs",
        )
    overlap = np.zeros(len(corners))
    for i, (start, end) in enumerate(pairwise(at)):
        low, high = start - before[i] * way[i], end + after[i] * way[i]
        near = np.flatnonzero(_near(corners, low, high, radius))
        pieces, owner = corners[near], near
        if i > 0:
            pieces, owner = _kept(pieces, owner, start, way[i - 1] + way[i])
        if i < len(way) - 1:
            pieces, owner = _kept(pieces, owner, end, -way[i] - way[i + 1])
        np.add.at(overlap, owner, cylinder_overlap(pieces, low, high, radius))
    return overlap


def polyline_inclusion(corners: Array, lattice: Array, points: Array, radius: float) -> Inclusion:
    """Inclusion of a path (n, 3) in mm in the lattice elements of a mesh.

    corners (m, 4, 3) and radius in mm; lattice (m,) bool; least shares are no contact, as in
    `straight_inclusion`. Raises InputError as `polyline_overlap`.
    """
    a, b, c, d = np.moveaxis(corners, 1, 0)
    volume = np.abs(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)) / 6
    share = np.zeros(len(corners))
    inside = np.flatnonzero(lattice)
    share[inside] = polyline_overlap(corners[inside], points, radius) / volume[inside]
    share[share < LEAST_SHARE] = 0.0
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return Inclusion(np.minimum(share, 1.0), radius, length)


def _near(corners: Array, low: Array, high: Array, radius: float) -> Array:
    """Mask (m,) of tetrahedra (m, 4, 3) whose boxes touch a cylinder's."""
    below, above = np.minimum(low, high) - radius, np.maximum(low, high) + radius
    return np.asarray(((corners.max(axis=1) > below) & (corners.min(axis=1) < above)).all(axis=1))


def _kept(tets: Array, owner: Array, point: Array, normal: Array) -> tuple[Array, Array]:
    """Parts of tetrahedra (m, 4, 3) on a plane's positive side, as tetrahedra; numbers of their originals."""
    height = (tets - point) @ normal
    order = np.argsort(-height, axis=1)
    v = np.take_along_axis(tets, order[:, :, None], axis=1)
    h = np.take_along_axis(height, order, axis=1)
    count = (h > 0).sum(axis=1)

    def cut(rows: Array, i: int, j: int) -> Array:
        t = h[rows, i] / (h[rows, i] - h[rows, j])
        return v[rows, i] + t[:, None] * (v[rows, j] - v[rows, i])

    whole, one, two, three = (np.flatnonzero(count == c) for c in (4, 1, 2, 3))
    parts = [(whole, [v[whole, i] for i in range(4)])]
    parts.append((one, [v[one, 0], cut(one, 0, 1), cut(one, 0, 2), cut(one, 0, 3)]))
    prisms = (
        (two, [v[two, 0], cut(two, 0, 2), cut(two, 0, 3), v[two, 1], cut(two, 1, 2), cut(two, 1, 3)]),
        (three, [v[three, 0], v[three, 1], v[three, 2], *(cut(three, i, 3) for i in range(3))]),
    )
    for rows, prism in prisms:
        parts += [(rows, prism[i : i + 4]) for i in range(3)]
    return np.vstack([np.stack(p, axis=1) for _, p in parts]), np.concatenate([owner[r] for r, _ in parts])
