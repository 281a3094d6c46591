"""Bar and seats of a waveguide as separate meshes of boxes, and distances of points from them."""

from __future__ import annotations

import itertools
from functools import partial

import numpy as np

from ..arrays import Array
from ..design.block import Block
from ..design.waveguide import Bar, Seat
from ..meshing.mesh import LATTICE, Mesh, edges_of, oriented, second_order
from .lattice import Depth, filled_outside

# A box as six tetrahedra around its diagonal (Kuhn): faces of neighbours are cut alike. A corner is numbered
# 4 i + 2 j + k.
_SIX = np.array([[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]])


def box_grid(points: Array, solid: Array) -> Mesh:
    """Straight quadratic tetrahedra of a grid's boxes, which may be oblique.

    points (a, b, c, 3): the grid in mm; solid (a - 1, b - 1, c - 1): mask of the boxes. No node is clamped.
    """
    number = np.arange(points[..., 0].size).reshape(points.shape[:3])
    points = points.reshape(-1, 3)
    i, j, k = np.nonzero(solid)
    corners = np.stack([number[i + a, j + b, k + c] for a in (0, 1) for b in (0, 1) for c in (0, 1)], axis=1)
    used, tets = np.unique(corners[:, _SIX].reshape(-1, 4), return_inverse=True)
    nodes, tets = points[used], np.reshape(tets, (-1, 4))
    tets = oriented(nodes, tets)
    edges, _ = edges_of(tets)
    nodes, tets, nothing = second_order(nodes, tets, tets[:0, :3], nodes[edges].mean(axis=1))
    return Mesh(nodes, tets, np.full(len(tets), LATTICE), nothing, tets[0, :0], tets[0, :0])


def cut_levels(low: float, high: float, longest: float, inner: Array) -> Array:
    """Ascending places from low to high, all of `inner` between them, no farther apart than `longest`.

    Places closer to each other than a tenth of `longest` count as one.

    >>> cut_levels(0.0, 2.0, 1.0, np.array([0.5])).tolist()
    [0.0, 0.5, 1.25, 2.0]
    """
    near = 0.1 * longest
    kept = [low]
    for place in np.sort(inner[(inner > low + near) & (inner < high - near)]).tolist():
        if place - kept[-1] > near:
            kept.append(place)
    kept.append(high)
    parts = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / longest - 1e-9))) + 1)[:-1]
        for a, b in itertools.pairwise(kept)
    ]
    return np.append(np.concatenate(parts), high)


# Longest element of a bar and of a seat, as a share of the bar's section.
_LONGEST = 0.9
_EXACT = 1e-9


def is_own_mirror_image(bar: Bar) -> bool:
    """Return True if a waveguide with wells and seats is symmetric about the plane x = 0."""
    sides = [*np.cross(bar.directions, bar.normals), *(seat.body.axes[2] for seat in bar.seats)]
    return bool(
        (np.abs(bar.points[:, 0]) < _EXACT).all() and all(abs(side[0]) > 1.0 - _EXACT for side in sides)
    )


def bar_mesh(bar: Bar, half: bool, kept: list[Depth]) -> Mesh:
    """Quadratic tetrahedra of a bar less its wells; legs meet in the planes of its mitres.

    half: keep only the part at x >= 0 of a symmetric bar. kept: where it counts, as in `filled_outside`.
    """
    h, longest = bar.half, _LONGEST * 2.0 * bar.half
    leg_of = [int(_outside_legs(bar, well.centre[None])[0].argmin()) for well in bar.wells]
    floors = [
        (well.centre - bar.points[leg]) @ bar.normals[leg] - well.half[1]
        for well, leg in zip(bar.wells, leg_of, strict=True)
    ]
    up = cut_levels(-h, h, longest, np.unique(np.round(floors, 9)))
    aside = np.array([-h, 0.0, h])
    if half:
        aside = aside[1:] if np.cross(bar.directions[0], bar.normals[0])[0] > 0 else aside[:2]
    solid: list[bool] = []
    sections = [_section(bar, 0, 0.0, up, aside, bar.planes[0])]
    for leg, length in enumerate(np.linalg.norm(np.diff(bar.points, axis=0), axis=1)):
        wells = [well for well, number in zip(bar.wells, leg_of, strict=True) if number == leg]
        middles = np.array([(well.centre - bar.points[leg]) @ bar.directions[leg] for well in wells])
        for well, at in sorted(zip(wells, middles, strict=True), key=lambda pair: float(pair[1])):
            for place, is_well in ((at - well.half[0], False), (at + well.half[0], True)):
                goal = _section(bar, leg, place, up, aside, bar.directions[leg])
                _extend(sections, solid, goal, longest, is_well)
        goal = _section(bar, leg, length, up, aside, bar.planes[leg + 1])
        _extend(sections, solid, goal, longest, False)
    floor = min(floors, default=h)
    open_top = np.broadcast_to((up[1:] + up[:-1])[:, None] / 2.0 > floor, (len(up) - 1, len(aside) - 1))
    points = np.array(sections)
    points[np.abs(points[..., 0]) < _EXACT, 0] = 0.0
    return filled_outside(box_grid(points, np.array([~(open_top & is_well) for is_well in solid])), kept)


def _section(bar: Bar, leg: int, place: float, up: Array, aside: Array, plane: Array) -> Array:
    """Points (a, b, 3) in mm of a leg's section in a plane of given normal, `place` mm from its start.

    up (a,) and aside (b,): positions across the leg in mm, along its normal and its binormal.
    """
    way, normal = bar.directions[leg], bar.normals[leg]
    across = up[:, None, None] * normal + aside[None, :, None] * np.cross(way, normal)
    slide = (across @ plane) / (way @ plane)
    return np.asarray(bar.points[leg] + place * way + across - slide[..., None] * way)


def _extend(sections: list[Array], solid: list[bool], goal: Array, longest: float, is_well: bool) -> None:
    """Add sections up to a goal, no farther apart than `longest` mm; each layer is a well or solid."""
    start = sections[-1]
    steps = max(1, int(np.ceil(np.linalg.norm(goal - start, axis=-1).mean() / longest - 1e-9)))
    for step in range(1, steps + 1):
        sections.append(start + step / steps * (goal - start))
        solid.append(is_well)


def seat_mesh(bar: Bar, seat: Seat, half: bool, kept: list[Depth]) -> Mesh:
    """Quadratic tetrahedra of a seat outside the bar, its pocket and its notch; the rest as in `bar_mesh`."""
    kept = [
        *kept,
        lambda points: -outside_seat(seat, points),
        partial(outside_bar, bar),
        *(partial(_outside_block, block) for block in (seat.pocket, seat.notch)),
    ]
    axes = seat.body.axes
    hull = np.concatenate([seat.foot.corners, seat.body.corners]) @ axes.T
    inner = np.concatenate([b.corners for b in (seat.foot, seat.body, seat.pocket, seat.notch)]) @ axes.T
    low, high = hull.min(axis=0), hull.max(axis=0)
    if half:
        (low if axes[2, 0] > 0 else high)[2] = 0.0
    levels = [
        cut_levels(float(low[k]), float(high[k]), _LONGEST * 2.0 * bar.half, np.unique(inner[:, k].round(9)))
        for k in range(3)
    ]
    points = np.stack(np.meshgrid(*levels, indexing="ij"), axis=-1) @ axes
    points[np.abs(points[..., 0]) < _EXACT, 0] = 0.0
    return filled_outside(box_grid(points, np.ones([len(level) - 1 for level in levels], bool)), kept)


def outside_bar(bar: Bar, points: Array) -> Array:
    """Distance (n,) in mm of points (n, 3) in mm from a bar, its wells filled, negative inside it."""
    return np.asarray(_outside_legs(bar, points).min(axis=1))


def _outside_legs(bar: Bar, points: Array) -> Array:
    """Distance (n, legs) in mm of points (n, 3) in mm from each leg, cut by the planes of its mitres."""
    planes = bar.planes / np.linalg.norm(bar.planes, axis=1)[:, None]
    found = []
    for leg, (way, normal) in enumerate(zip(bar.directions, bar.normals, strict=True)):
        off = points - bar.points[leg]
        across = np.maximum(np.abs(off @ normal), np.abs(off @ np.cross(way, normal))) - bar.half
        before, after = -off @ planes[leg], (points - bar.points[leg + 1]) @ planes[leg + 1]
        found.append(np.maximum(across, np.maximum(before, after)))
    return np.stack(found, axis=1)


def outside_seat(seat: Seat, points: Array) -> Array:
    """Distance (n,) in mm of points (n, 3) in mm from a seat's hull, its pocket filled, negative inside."""
    from scipy.spatial import ConvexHull

    planes = ConvexHull(np.concatenate([seat.foot.corners, seat.body.corners])).equations
    return np.asarray((points @ planes[:, :3].T + planes[:, 3]).max(axis=1))


def _outside_block(block: Block, points: Array) -> Array:
    """Distance (n,) in mm of points (n, 3) in mm from a box, negative inside it."""
    return np.asarray((np.abs((points - block.centre) @ block.axes.T) - block.half).max(axis=1))
