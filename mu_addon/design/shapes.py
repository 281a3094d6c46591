"""Elementary solids for manifold3d, with facets enlarged to the area or volume of the exact shape."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array


def inscribed(n: int) -> float:
    """Factor on the radius that gives an n-sided polygon the area of its circle: sqrt((2 pi/n)/sin(2 pi/n)).

    >>> round(inscribed(16), 4)
    1.013
    """
    return float(np.sqrt((2.0 * np.pi / n) / np.sin(2.0 * np.pi / n)))


def box(low: ArrayLike, high: ArrayLike) -> Any:
    """Axis-aligned box from corner `low` (3,) to `high` (3,) in mm, as a Manifold."""
    from manifold3d import Manifold

    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return Manifold.cube((high - low).tolist()).translate(low.tolist())


def cylinder(radius: float, low: float, high: float, n: int) -> Any:
    """Prism of n sides around the z axis between two heights in mm, as a Manifold.

    Its section has the area of a circle of `radius` mm.
    """
    from manifold3d import Manifold

    return Manifold.cylinder(high - low, radius * inscribed(n), circular_segments=n).translate(
        [0.0, 0.0, low]
    )


def revolved(polygon: Array, n: int) -> Any:
    """Body of n sides from a counter-clockwise half section (m, 2), radius and z in mm, turned around z.

    A Manifold; its sections have the area of the circles that they approximate.
    """
    from manifold3d import CrossSection

    return CrossSection([polygon * [inscribed(n), 1.0]]).revolve(n)


def offset_along(normals: Array, offset: ArrayLike) -> Array:
    """Moves (n, 3) of a surface with unit normals (n, 3) for offsets (3,) along x, y and z, in their unit.

    D^2 n / |D n| with D = diag(offset): the point of the ellipsoid of those half-axes whose normal is n, so
    that the body grows by that ellipsoid (its Minkowski sum); o n for equal offsets o. A negative offset
    moves its component inward.
    """
    offset = np.asarray(offset, dtype=float)
    # A normal that should lie in the plane must not pick a side of an ellipsoid without width by roundoff.
    normals = np.where(np.abs(normals) < 1e-9, 0.0, normals)
    length = np.linalg.norm(offset * normals, axis=-1, keepdims=True)
    moved = np.sign(offset) * offset**2 * normals
    return np.divide(moved, length, out=np.zeros_like(moved), where=length > 0.0)


def ball(radius: float, n: int, offset: ArrayLike | None = None) -> Any:
    """Faceted ball around the origin with the volume of a sphere of `radius` mm, about n facets around.

    offset (3,): outward move of its surface along x, y and z in mm. The result is a Manifold.
    """
    from manifold3d import Manifold

    unit = Manifold.sphere(1.0, n)
    enlarged = (4.0 / 3.0 * np.pi / unit.volume()) ** (1.0 / 3.0)
    if offset is None:
        return unit.scale([radius * enlarged] * 3)
    return unit.warp_batch(lambda normal: enlarged * (radius * normal + offset_along(normal, offset)))


def ring(axis: Array, n: int) -> Array:
    """Unit vectors (n, 3) square to an axis (3,), evenly spaced around it.

    >>> ring(np.array([0.0, 0.0, 2.0]), 4).shape
    (4, 3)
    """
    along = axis / np.linalg.norm(axis)
    # One faces z, so that struts mirrored in a vertical plane have mirrored facets; around upright ones, x.
    up = np.array([0.0, 0.0, 1.0]) - along[2] * along
    if np.abs(up).max() < 1e-9:
        up = np.array([1.0, 0.0, 0.0])
    up /= np.linalg.norm(up)
    angle = 2.0 * np.pi * np.arange(n) / n
    return np.asarray(np.cos(angle)[:, None] * up + np.sin(angle)[:, None] * np.cross(along, up))


def spindle(axis: Array, radii: Array, n: int, offset: ArrayLike | None = None) -> Any:
    """Manifold of n sides along `axis` (3,) in mm from the origin, with evenly spaced radii (m,) in mm.

    offset (3,): outward move of its sides along x, y and z in mm; the part perpendicular to the axis is used.
    """
    from manifold3d import Manifold, Mesh64

    along = axis / np.linalg.norm(axis)
    normals = ring(axis, n)
    m = len(radii)
    stations = (
        np.linspace(0.0, 1.0, m)[:, None, None] * axis + (radii * inscribed(n))[:, None, None] * normals
    )
    if offset is not None:
        moved = offset_along(normals, offset)
        stations += inscribed(n) * (moved - (moved @ along)[:, None] * along)
    vertices = np.concatenate([stations.reshape(-1, 3), np.zeros((1, 3)), axis[None]])

    i = np.arange(n)
    j = (i + 1) % n
    lower, upper = np.arange(m - 1)[:, None] * n, np.arange(1, m)[:, None] * n
    sides = [np.stack([lower + i, lower + j, upper + j], 2), np.stack([lower + i, upper + j, upper + i], 2)]
    if offset is not None:
        # Sides moved unequally are warped: only if their diagonals are mirror images, too, do mirrored
        # struts meet in the plane between them and not in slivers beside it.
        other = (4 * i // n % 2 == 1)[None, :] ^ (2 * np.arange(m - 1) >= m - 1)[:, None]
        crossed = [
            np.stack([lower + i, lower + j, upper + i], 2),
            np.stack([lower + j, upper + j, upper + i], 2),
        ]
        sides = [np.where(other[..., None], b, a) for a, b in zip(sides, crossed, strict=True)]
    ends = [
        np.stack([np.full(n, m * n), j, i], 1),
        np.stack([np.full(n, m * n + 1), (m - 1) * n + i, (m - 1) * n + j], 1),
    ]
    triangles = np.concatenate([part.reshape(-1, 3) for part in sides] + ends)
    return Manifold(Mesh64(vertices, triangles.astype(np.uint64)))
