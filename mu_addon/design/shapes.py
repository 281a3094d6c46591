"""Elementary solids for manifold3d, with facets enlarged to the area or volume of what they stand for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def inscribed(n: int) -> float:
    """Factor on the radius that gives an n-sided polygon its circle's area: sqrt((2 pi/n)/sin(2 pi/n))."""
    return float(np.sqrt((2.0 * np.pi / n) / np.sin(2.0 * np.pi / n)))


def box(low: ArrayLike, high: ArrayLike) -> Any:
    """Axis-aligned box between two corners (3,) in mm."""
    from manifold3d import Manifold

    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return Manifold.cube((high - low).tolist()).translate(low.tolist())


def cylinder(radius: float, low: float, high: float, n: int) -> Any:
    """Cylinder of n sides around the z axis between two heights, mm."""
    from manifold3d import Manifold

    return Manifold.cylinder(high - low, radius * inscribed(n), circular_segments=n).translate(
        [0.0, 0.0, low]
    )


def revolved(polygon: Array, n: int) -> Any:
    """Body of n sides around z from a counter-clockwise half section (m, 2) of (radius, z) in mm."""
    from manifold3d import CrossSection

    return CrossSection([polygon * [inscribed(n), 1.0]]).revolve(n)


def ball(radius: float, n: int) -> Any:
    """Ball with about n facets around, mm."""
    from manifold3d import Manifold

    unit = Manifold.sphere(1.0, n)
    return unit.scale([radius * (4.0 / 3.0 * np.pi / unit.volume()) ** (1.0 / 3.0)] * 3)


def spindle(axis: Array, radii: Array, n: int) -> Any:
    """Body of n sides along `axis` (3,) from the origin, with evenly spaced radii (m,) in mm."""
    from manifold3d import Manifold, Mesh64

    along = axis / np.linalg.norm(axis)
    # One side faces z, so that struts mirrored in a vertical plane have mirrored facets.
    up = np.array([0.0, 0.0, 1.0]) - along[2] * along
    up /= np.linalg.norm(up)
    angle = 2.0 * np.pi * np.arange(n) / n
    ring = np.cos(angle)[:, None] * up + np.sin(angle)[:, None] * np.cross(along, up)
    m = len(radii)
    stations = np.linspace(0.0, 1.0, m)[:, None, None] * axis + (radii * inscribed(n))[:, None, None] * ring
    vertices = np.concatenate([stations.reshape(-1, 3), np.zeros((1, 3)), axis[None]])

    i = np.arange(n)
    j = (i + 1) % n
    lower, upper = np.arange(m - 1)[:, None] * n, np.arange(1, m)[:, None] * n
    sides = [np.stack([lower + i, lower + j, upper + j], 2), np.stack([lower + i, upper + j, upper + i], 2)]
    ends = [
        np.stack([np.full(n, m * n), j, i], 1),
        np.stack([np.full(n, m * n + 1), (m - 1) * n + i, (m - 1) * n + j], 1),
    ]
    triangles = np.concatenate([part.reshape(-1, 3) for part in sides] + ends)
    return Manifold(Mesh64(vertices, triangles.astype(np.uint64)))
