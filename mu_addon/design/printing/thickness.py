"""Thickness of a solid and width of its gaps, by rays square to its surface."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ..surface import Triangles, Vertices

START = 1e-3
"""Distance in mm from the surface at which a ray starts, so that it does not hit its own triangle."""


@attrs.frozen(eq=False)
class Samples:
    """Points (s, 3) in mm on a surface, outward unit normals (s, 3), areas (s,) in mm2."""

    points: Array
    normals: Array
    area: Array


@attrs.frozen(eq=False)
class RayHits:
    """First hits of rays from samples: distances (s,) in mm, inf beyond reach, and places (s, 3) in mm.

    cosine (s,): between the normals of the sample and of the triangle hit; -1 where these faces are parallel,
    0 where nothing was hit.
    """

    distance: Array
    at: Array
    cosine: Array


def samples(vertices: Vertices, triangles: Triangles, spacing: float) -> Samples:
    """Samples of a surface, vertices (n, 3) in mm and triangles (m, 3), one for each `spacing` squared.

    spacing: in mm. They are spread evenly whatever the triangles' size; within a triangle they follow
    Roberts' R2 sequence, so that they are the same in every run.
    """
    p, q, r = vertices[triangles.T]
    normal = np.cross(q - p, r - p)
    double = np.linalg.norm(normal, axis=1)
    total = np.cumsum(0.5 * double) / spacing**2
    count = np.diff(np.floor(total + 0.5), prepend=0.0).astype(np.int64)
    owner = np.repeat(np.arange(len(triangles)), count)
    k = np.arange(len(owner))
    s, t = (0.5 + 0.7548776662466927 * k) % 1.0, (0.5 + 0.5698402909980532 * k) % 1.0
    over = s + t > 1.0
    s, t = np.where(over, 1.0 - s, s), np.where(over, 1.0 - t, t)
    points = p[owner] + s[:, None] * (q - p)[owner] + t[:, None] * (r - p)[owner]
    area = np.full(len(owner), 0.5 * double.sum() / max(len(owner), 1))
    return Samples(points, (normal / np.maximum(double, 1e-300)[:, None])[owner], area)


def cast_rays(solid: Any, surface: Samples, side: int, reach: float) -> RayHits:
    """Rays through a Manifold from every sample, square to the surface and `reach` mm long.

    side: -1 inward, for thickness, +1 outward, for gaps. The distance is exact for parallel faces, and for
    cylinders and balls through their centres; in a wedge it is the width perpendicular to one face. A ball
    that fits inside is never wider than this.
    """
    direction = side * surface.normals
    first = (surface.points + START * direction).tolist()
    last = (surface.points + (START + reach) * direction).tolist()
    hits = [hit[0] if hit else None for hit in map(solid.ray_cast, first, last)]
    met = np.array([hit is not None for hit in hits], bool)
    share, normal = np.full(len(hits), np.inf), np.zeros((len(hits), 3))
    share[met] = [hit.distance for hit in hits if hit is not None]
    normal[met] = np.array([hit.normal for hit in hits if hit is not None]).reshape(-1, 3)
    distance = START + reach * share
    at = surface.points + np.where(np.isfinite(distance), distance, 0.0)[:, None] * direction
    return RayHits(distance, at, np.einsum("ij,ij->i", normal, surface.normals))
