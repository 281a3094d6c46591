"""Closed triangulated surfaces of a unit's envelope, membrane and cavity, for a mesher of surfaces."""

from __future__ import annotations

import math

import numpy as np

from ..design.dimensions import Dimensions
from ..design.profile import cavity_radius, outer_radius
from .mesh import LATTICE, MEMBRANE, Array
from .surface import VOID, Surface


def unit_surfaces(d: Dimensions, turn: float, edge_mm: float) -> tuple[Surface, Surface, Surface]:
    """Envelope, profile and cavity of the part of a unit with 0 <= angle <= turn, as nested surfaces.

    turn in radians from +y towards +x; edge_mm: about how long the triangles' sides are. Their regions are
    LATTICE, MEMBRANE and VOID.
    """
    (_, x1), (y0, y1), _ = d.bounds
    low_x, low_y = -x1 if turn > math.pi else 0.0, y0 if turn >= math.pi else 0.0
    sectors = max(2, round(turn * d.R / edge_mm))
    levels = max(8, round(4 * d.cell / edge_mm)) * d.count
    z = np.linspace(0.0, d.height, levels + 1)
    inner = np.linspace(d.base_cap, d.height - d.tip_cap, levels + 1)
    return (
        Surface(*_box((low_x, low_y, 0.0), (x1, y1, d.height)), LATTICE),
        Surface(*_lathe(outer_radius(d, z), z, turn, sectors), MEMBRANE),
        Surface(*_lathe(cavity_radius(d, inner), inner, turn, sectors), VOID),
    )


def region_at(d: Dimensions, points: Array) -> Array:
    """Region (n,) of points (n, 3) in mm: VOID, MEMBRANE or LATTICE, from the exact profile."""
    radius, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
    between = (z > d.base_cap) & (z < d.height - d.tip_cap)
    hollow = between & (radius < cavity_radius(d, z))
    return np.select([hollow, radius < outer_radius(d, z)], [VOID, MEMBRANE], LATTICE)


def _lathe(radius: Array, z: Array, turn: float, sectors: int) -> tuple[Array, Array]:
    """Body of revolution over 0..turn with flat ends and flat sides: vertices (n, 3), triangles (f, 3).

    Over a whole turn it has no sides.
    """
    # Polygons inscribed in the circle would lose volume: their corners go outside it by as much.
    step = turn / sectors
    radius = radius * math.sqrt(step / math.sin(step))
    whole = turn == 2.0 * math.pi
    angle = np.linspace(0.0, turn, sectors + 1)
    x, y = np.sin(angle), np.cos(angle)
    x[np.abs(x) < 1e-12] = 0.0
    y[np.abs(y) < 1e-12] = 0.0
    rim = np.stack([np.outer(radius, x), np.outer(radius, y), np.repeat(z[:, None], sectors + 1, 1)], axis=2)
    axis = np.column_stack([np.zeros((len(z), 2)), z])
    if whole:
        rim = rim[:, :-1]
    vertices = np.concatenate([rim, axis[:, None]], axis=1).reshape(-1, 3)
    ids = np.arange(len(vertices)).reshape(len(z), -1)
    # One ring per height: around the rim and, where it is no whole turn, back over the axis.
    ring = ids[:, :-1] if whole else ids
    a, b = ring[:-1], np.roll(ring[:-1], -1, axis=1)
    c, e = ring[1:], np.roll(ring[1:], -1, axis=1)
    sides = np.concatenate([np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, e], -1).reshape(-1, 3)])
    around = np.append(np.arange(sectors), 0) if whole else np.arange(sectors + 1)
    first, second = around[:-1], around[1:]
    fan = np.stack([np.full(sectors, ids[0, -1]), ids[0, first], ids[0, second]], axis=1)
    lid = np.stack([np.full(sectors, ids[-1, -1]), ids[-1, second], ids[-1, first]], axis=1)
    used = np.unique(sides) if whole else ids.ravel()
    used = np.unique(np.concatenate([used, fan.ravel(), lid.ravel()]))
    faces = np.searchsorted(used, np.concatenate([sides, fan, lid]))
    return vertices[used], faces.astype(np.int32)


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> tuple[Array, Array]:
    """Box between two corners: vertices (8, 3), triangles (12, 3) outward."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    triangles = [t for q in quads for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))]
    return np.array(low) + corners * (np.array(high) - low), np.array(triangles, np.int32)
