"""What a printer's layers look like: outlines of a part's sections, and what they enclose."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..surface import Triangles, Vertices
from .voxels import frame_along

Array = NDArray[np.float64]

# Points of an outline nearer than this, in mm, to the line between their neighbours go.
_SIMPLE_mm = 0.02


@attrs.frozen(eq=False)
class Slice:
    """One section of a part, at a height in mm above the part's lowest point.

    outlines: closed polygons (n, 2) in mm, in the plane of the section, counter-clockwise around material and
    clockwise around holes. area_mm2: of the material; enclosed_mm2: of the holes, which hold resin that can
    leave only along the build, as a chamber's.
    """

    height_mm: float
    outlines: list[Array]
    area_mm2: float
    enclosed_mm2: float


def even_heights(vertices: Vertices, direction: ArrayLike, count: int) -> list[float]:
    """Heights in mm of so many sections of a part (n, 3) built along a direction (3,), evenly spaced."""
    height = float(np.ptp(vertices @ frame_along(np.asarray(direction, float))[2]))
    return [height * (k + 0.5) / count for k in range(count)]


def slices(
    vertices: Vertices, triangles: Triangles, direction: ArrayLike, heights_mm: Sequence[float]
) -> list[Slice]:
    """Sections of a closed surface, (n, 3) in mm and (m, 3), square to its build direction (3,).

    Empty for a surface that encloses no volume.
    """
    from manifold3d import Error, Manifold, Mesh64

    built = vertices @ frame_along(np.asarray(direction, float)).T
    solid = Manifold(Mesh64(built, triangles.astype(np.uint64)))
    if solid.status() != Error.NoError or solid.is_empty():
        return []
    low = built[:, 2].min()
    found = []
    for height in heights_mm:
        section = solid.slice(float(low + height))
        holes = -sum(min(signed_area(np.asarray(ring)), 0.0) for ring in section.to_polygons())
        drawn = [np.asarray(ring) for ring in section.simplify(_SIMPLE_mm).to_polygons()]
        found.append(Slice(float(height), drawn, float(section.area()), holes))
    return found


def signed_area(ring: Array) -> float:
    """Area in mm2 of a polygon (n, 2), positive where it runs counter-clockwise."""
    x, y = (ring - ring[0]).T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))
