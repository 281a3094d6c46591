"""The actuator's profile: parabola arcs for bladders and necks, and the cavity inside the wall.

One period of length U = 2 (a + b): a bladder arc of half-length a about its apex (radius R), a neck arc of
half-length b about its minimum (radius r). Equal slopes at their joint give its radius (R b + r a)/(a + b).
The cavity is the offset of that curve by the wall along its normal, cut flat by the two end caps; the wall
may differ from chamber to chamber (`wall_factors`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from .dimensions import Dimensions
from .shapes import offset_along

OFFSET_TOLERANCE = 5e-4
"""Largest distance in mm between the cubic arcs of the cavity and the exact offset curve."""


def outer_radius(d: Dimensions, z: ArrayLike) -> Array:
    """Radius in mm (any shape) of the actuator's outer profile at heights z in mm (any shape).

    Parabola arcs: R at a bladder's apex, r at a neck, equal slopes at their joint.

    >>> from mu_addon.design import load_preset
    >>> outer_radius(load_preset("mu-1.0x").dimensions, [0.0, 6.25]).tolist()
    [6.25, 12.5]
    """
    return _outer(d, np.asarray(z, dtype=float))[0]


def outer_slope(d: Dimensions, z: ArrayLike) -> Array:
    """Slope d(radius)/dz of the outer profile (any shape), without unit, at heights z in mm (any shape)."""
    return _outer(d, np.asarray(z, dtype=float))[1]


def cavity_radius(d: Dimensions, z: ArrayLike) -> Array:
    """Radius in mm (any shape) of the cavity at heights z in mm (any shape), the end caps not yet cut.

    The cavity is the outer profile offset inward by the wall along its normal.

    >>> from mu_addon.design import load_preset
    >>> cavity_radius(load_preset("mu-1.0x").dimensions, 6.25).round(6).tolist()
    11.6
    """
    return under_profile(d, foot(d, z))[..., 0]


def under_profile(d: Dimensions, s: Array, share: ArrayLike = 1.0) -> Array:
    """Points (..., 2), (radius, z) in mm, a share of the wall below the outer profile, along its normal.

    s (any shape): heights on the profile in mm; share (of its shape, or a number): 0 on the profile, 1 on the
    cavity.
    """
    radius, slope, _ = _outer(d, s)
    depth = np.asarray(share) * d.wall_at(s)[0] / np.hypot(1.0, slope)
    return np.stack([radius - depth, s + depth * slope], axis=-1)


def foot(d: Dimensions, z: ArrayLike) -> Array:
    """Heights (any shape) in mm on the outer profile whose normals reach the cavity at heights z in mm.

    By bisection: the cavity rises along the profile where the wall fits.
    """
    z = np.asarray(z, dtype=float)
    low, high = z - d.thickest_wall, z + d.thickest_wall
    for _ in range(60):
        middle = (low + high) / 2.0
        beyond = under_profile(d, middle)[..., 1] > z
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.asarray((low + high) / 2.0)


def outer_arcs(d: Dimensions) -> list[Array]:
    """Outer profile as exact quadratic Bezier arcs from z = 0 up: poles (3, 2), radius and z in mm."""
    poles = []
    for low, high in _spans(d, _splits(d)):
        radius, slope, _ = _outer(d, np.array([low, high]))
        middle = radius[0] + slope[0] * (high - low) / 2.0
        poles.append(np.array([[radius[0], low], [middle, (low + high) / 2.0], [radius[1], high]]))
    return poles


def inner_arcs(d: Dimensions) -> list[Array]:
    """Inner profile as cubic Bezier arcs, one for each outer arc: poles (4, 2), radius and z in mm.

    Each approximates the outer arc's offset by the wall: ends and end tangents are those of the exact offset,
    and it passes through the offset of the middle. Arcs are halved, inner and outer, until they are within
    OFFSET_TOLERANCE of the exact offset.
    """
    return _offset_arcs(d, _splits(d))


def cavity_arcs(d: Dimensions) -> list[Array]:
    """The inner arcs between the end caps: poles (4, 2), radius and z in mm, from the base on.

    The first and the last arc are cut exactly at the caps.
    """
    low, high = d.base_cap, d.height - d.tip_cap
    near = 1e-6 * d.cell  # a cap that meets an arc's end leaves no sliver of that arc
    kept = [arc for arc in inner_arcs(d) if arc[3, 1] > low + near and arc[0, 1] < high - near]
    kept[0] = _piece(kept[0], _parameter_at(kept[0], low), 1.0)
    kept[-1] = _piece(kept[-1], 0.0, _parameter_at(kept[-1], high))
    kept[0][0, 1], kept[-1][3, 1] = low, high
    return kept


def outer_polygon(d: Dimensions, per_arc: int, offset: Array | None = None) -> Array:
    """Half section of the actuator without its cavity: counter-clockwise points (n, 2), radius and z, in mm.

    per_arc: pieces of every quarter chamber; offset (3,): outward move of the surface along x, y and z in mm.
    """
    s = _samples(d, 0.0, d.height, per_arc)
    curve = np.stack([outer_radius(d, s), s], axis=1)
    if offset is None:
        return _closed(curve)
    return _closed(_between(curve + _moves(d, s, offset), -offset[2], d.height + offset[2]))


def cavity_polygon(d: Dimensions, per_arc: int, offset: Array | None = None) -> Array:
    """Half section of the cavity between the end caps: counter-clockwise points (n, 2), radius and z, in mm.

    per_arc: pieces of every quarter chamber; offset (3,): move of the solid's surface along x, y and z in mm,
    out of the wall and so into the cavity.
    """
    low, high = d.base_cap, d.height - d.tip_cap
    if offset is None:
        ends = foot(d, np.array([low, high]))
        radius, z, _ = _inner(d, _samples(d, ends[0], ends[1], per_arc))
        z[[0, -1]] = low, high
        return _closed(np.stack([radius, z], axis=1))
    room = 3.0 * np.abs(offset).max()
    ends = foot(d, np.array([low - room, high + room]))
    s = _samples(d, ends[0], ends[1], per_arc)
    radius, z, _ = _inner(d, s)
    curve = np.stack([radius, z], axis=1) - _moves(d, s, offset)
    return _closed(_between(curve, low + offset[2], high - offset[2]))


def revolved_volume(polygon: Array) -> float:
    """Volume in mm3 of a half section (n, 2) of (radius, z) in mm, counter-clockwise, turned once around z.

    >>> round(revolved_volume(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]])) / np.pi, 9)
    2.0
    """
    (r, z), (q, y) = polygon.T, np.roll(polygon, -1, axis=0).T
    return float(np.pi / 3.0 * np.sum((y - z) * (r * r + r * q + q * q)))


def cavity_volume(d: Dimensions) -> float:
    """Volume in mm3 of the cavity between the end caps, by Gauss quadrature of the exact offset, to 1e-10.

    >>> from mu_addon.design import load_preset
    >>> round(cavity_volume(load_preset("mu-1.0x").dimensions))
    16183
    """
    ends = foot(d, np.array([d.base_cap, d.height - d.tip_cap]))
    knots = np.unique(np.clip(_knots(d), ends[0], ends[1]))
    x, weight = np.polynomial.legendre.leggauss(32)
    half = np.diff(knots)[:, None] / 2.0
    s = knots[:-1, None] + half * (1.0 + x)
    radius, _, stretch = _inner(d, s)
    return float(np.sum(half * weight * np.pi * radius**2 * stretch))


def outer_volume(d: Dimensions) -> float:
    """Volume in mm3 inside the outer profile between z = 0 and d.height, in closed form."""
    rise = d.joint_radius - d.r
    neck = d.b * (d.r**2 + 2.0 / 3.0 * d.r * rise + rise**2 / 5.0)
    fall = d.joint_radius - d.R
    bladder = d.a * (d.R**2 + 2.0 / 3.0 * d.R * fall + fall**2 / 5.0)
    return float(2.0 * d.count * np.pi * (neck + bladder))


def membrane_volume(d: Dimensions) -> float:
    """Volume in mm3 between outer profile and cavity with both end caps, the inlet's bore not subtracted."""
    return outer_volume(d) - cavity_volume(d)


def _outer(d: Dimensions, s: Array) -> tuple[Array, Array, Array]:
    """Radius, slope and second derivative of the outer profile at heights s."""
    u = np.mod(s, d.cell) - d.cell / 2.0
    from_apex = np.abs(u)
    from_neck = d.cell / 2.0 - from_apex
    drop = (d.R - d.r) / (d.a + d.b)
    bladder = from_apex <= d.a
    radius = np.where(bladder, d.R - drop / d.a * from_apex**2, d.r + drop / d.b * from_neck**2)
    slope = -np.sign(u) * 2.0 * drop * np.where(bladder, from_apex / d.a, from_neck / d.b)
    bend = 2.0 * drop * np.where(bladder, -1.0 / d.a, 1.0 / d.b)
    return radius, slope, bend


def _inner(d: Dimensions, s: Array) -> tuple[Array, Array, Array]:
    """Offset point (radius, z) of the outer point at height s, and dz/ds."""
    _, slope, bend = _outer(d, s)
    wall, change = d.wall_at(s)
    length = np.hypot(1.0, slope)
    # 1 - wall * curvature, plus a term for a wall that changes along the profile.
    stretch = 1.0 + wall * bend / length**3 + change * slope / length
    point = under_profile(d, s)
    return point[..., 0], point[..., 1], stretch


def _inner_tangent(d: Dimensions, s: Array) -> Array:
    """Directions (n, 2) of the cavity's profile, (dr, dz) for dz = 1, at the offsets of heights s (n,)."""
    _, slope, bend = _outer(d, s)
    wall, change = d.wall_at(s)
    length = np.sqrt(1.0 + slope**2)
    along = 1.0 + wall * bend / length**3
    # A wall that does not change leaves the cavity parallel to the profile.
    leans = (slope * along - change / length) / (along + change * slope / length) if change.any() else slope
    return np.stack([leans, np.ones_like(leans)], axis=1)


def _knots(d: Dimensions) -> Array:
    """Heights where arcs meet: neck, joint, apex, joint of each chamber, and the last neck."""
    chamber = np.array([0.0, d.b, d.cell / 2.0, d.cell - d.b])
    return np.append((np.arange(d.count)[:, None] * d.cell + chamber).ravel(), d.height)


def _samples(d: Dimensions, low: float, high: float, per_arc: int) -> Array:
    """Heights from low to high that include the knots and cut every quarter chamber `per_arc` times."""
    knots = _knots(d)
    inner = (knots[:-1, None] + np.diff(knots)[:, None] * np.arange(per_arc) / per_arc).ravel()
    near = 1e-3 * d.cell / per_arc  # no sliver beside an end
    return np.concatenate([[low], inner[(inner > low + near) & (inner < high - near)], [high]])


def _moves(d: Dimensions, s: Array, offset: Array) -> Array:
    """Move (n, 2) along (radius, z) of the outer profile at heights s for an offset (3,)."""
    slope = outer_slope(d, s)
    normals = np.stack([np.ones_like(s), np.zeros_like(s), -slope], axis=1) / np.hypot(1.0, slope)[:, None]
    return offset_along(normals, offset)[:, [0, 2]]


def _between(curve: Array, low: float, high: float) -> Array:
    """The part of a curve (n, 2) of rising z between two heights, upright beyond its ends."""
    inside = curve[(curve[:, 1] > low) & (curve[:, 1] < high)]
    ends = np.interp([low, high], curve[:, 1], curve[:, 0])
    return np.concatenate([[[ends[0], low]], inside, [[ends[1], high]]])


def _closed(curve: Array) -> Array:
    """Polygon between the z axis and a curve (n, 2) of rising z."""
    return np.concatenate([[[0.0, curve[0, 1]]], curve, [[0.0, curve[-1, 1]]]])


def _spans(d: Dimensions, splits: int) -> list[tuple[float, float]]:
    """Heights (low, high) of the arcs, every quarter of a chamber halved into `splits` equal parts."""
    knots = _knots(d)
    parts = knots[:-1, None] + np.diff(knots)[:, None] * np.arange(splits) / splits
    ends = np.append(parts.ravel(), d.height)
    return list(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))


def _offset_arcs(d: Dimensions, splits: int) -> list[Array]:
    arcs = []
    for low, high in _spans(d, splits):
        s = np.array([low, (low + high) / 2.0, high])
        radius, z, _ = _inner(d, s)
        start, middle, end = np.stack([radius, z], axis=1)
        tangents = _inner_tangent(d, s[[0, 2]])
        # B(1/2) = (start + end)/2 + 3/8 (p t0 - q t1): two equations for the two pole lengths p and q.
        p, q = np.linalg.solve(
            0.375 * np.stack([tangents[0], -tangents[1]], axis=1), middle - (start + end) / 2.0
        )
        arcs.append(np.array([start, start + p * tangents[0], end - q * tangents[1], end]))
    return arcs


def _splits(d: Dimensions) -> int:
    """Fewest equal parts of a quarter chamber, a power of two, whose cubic offsets rise and keep close."""
    t = np.linspace(0.0, 1.0, 17)[1:-1]
    splits = 1
    while splits < 64:
        arcs = _offset_arcs(d, splits)
        # Of chambers that are alike the other quarters are mirror images.
        first = np.array(arcs if d.wall_factors else arcs[: 2 * splits])
        points = _bezier(first, t)
        s = foot(d, points[..., 1])
        off = np.abs(points[..., 0] - _inner(d, s)[0]) / np.sqrt(1.0 + _outer(d, s)[1] ** 2)
        rising = (np.diff(first[..., 1], axis=1) >= 0.0).all()  # else the arc folds, near the thickest wall
        if off.max() < OFFSET_TOLERANCE and rising:
            break
        splits *= 2
    return splits


def _bezier(poles: Array, t: Array) -> Array:
    """Points (..., len(t), 2) at parameters t of cubic arcs (..., 4, 2)."""
    basis = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
    return np.asarray(basis @ poles)


def _parameter_at(arc: Array, z: float) -> float:
    """Parameter where the cubic arc, whose z increases, reaches z."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (low, middle) if _bezier(arc, np.array([middle]))[0, 1] > z else (middle, high)
    return (low + high) / 2.0


def _piece(arc: Array, first: float, last: float) -> Array:
    """Poles of the arc's part between two parameters, by blossoming."""

    def blossom(u: float, v: float, w: float) -> Array:
        points = arc
        for t in (u, v, w):
            points = (1.0 - t) * points[:-1] + t * points[1:]
        return np.asarray(points[0])

    a, b = first, last
    return np.array([blossom(a, a, a), blossom(a, a, b), blossom(a, b, b), blossom(b, b, b)])
