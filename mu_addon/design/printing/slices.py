"""Pictures of a printer's layers: outlines of a part's sections, and of the enclosed areas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import InputError
from ..surface import Triangles, Vertices
from .voxels import frame_along

# Points of an outline nearer than this, in mm, to the line between their neighbours go.
_SIMPLE_mm = 0.02


@attrs.frozen(eq=False)
class Slice:
    """One section of a part, at a height in mm above the part's lowest point.

    outlines: closed polygons (n, 2) in mm, in the plane of the section, counter-clockwise around material and
    clockwise around holes. area_mm2: of the material; enclosed_mm2: of the holes, whose resin can leave only
    along the build, as in a chamber. open_chamber: polygons of chambers that are open here by their inlet and
    therefore no holes; open_mm2: their area.
    """

    height_mm: float
    outlines: list[Array]
    area_mm2: float
    enclosed_mm2: float
    open_chamber: list[Array]
    open_mm2: float


@attrs.frozen(eq=False)
class Filled:
    """One section as triangles: vertices (n, 3) in mm, of its material (m, 3) and of enclosed areas (k, 3).

    area_mm2, enclosed_mm2: their areas.
    """

    vertices: Array
    material: Triangles
    enclosed: Triangles
    area_mm2: float
    enclosed_mm2: float


def even_heights(vertices: Vertices, direction: ArrayLike, count: int) -> list[float]:
    """Heights in mm of so many sections of a part (n, 3) built along a direction (3,), evenly spaced."""
    height = float(np.ptp(vertices @ frame_along(np.asarray(direction, float))[2]))
    return [height * (k + 0.5) / count for k in range(count)]


def slices(
    vertices: Vertices,
    triangles: Triangles,
    direction: ArrayLike,
    heights_mm: Sequence[float],
    chamber: tuple[Vertices, Triangles] | None = None,
) -> list[Slice]:
    """Sections of a closed surface, (n, 3) in mm and (m, 3), square to its build direction (3,).

    chamber: the closed surface of a chamber within it, in the same frame. Empty for a surface that encloses
    no volume.
    """
    frame = frame_along(np.asarray(direction, float))
    built = vertices @ frame.T
    solid = _closed(built, triangles)
    if solid is None:
        return []
    within = None if chamber is None else _closed(chamber[0] @ frame.T, chamber[1])
    low = built[:, 2].min()
    found = []
    for height in heights_mm:
        section = solid.slice(float(low + height))
        holes = -sum(min(signed_area(np.asarray(ring)), 0.0) for ring in section.to_polygons())
        opened = None if within is None else within.slice(float(low + height)) - _filled(section)
        found.append(
            Slice(
                float(height),
                _outlines(section),
                float(section.area()),
                holes,
                [] if opened is None else _outlines(opened),
                0.0 if opened is None else float(opened.area()),
            )
        )
    return found


def has_volume(vertices: Vertices, triangles: Triangles) -> bool:
    """Return True if a surface, (n, 3) in mm and (m, 3), is closed and encloses a volume: it has layers."""
    return _closed(vertices, triangles) is not None


def _closed(built: Vertices, triangles: Triangles) -> Any | None:
    """The solid within a surface (n, 3), (m, 3); None where that encloses no volume."""
    from manifold3d import Error, Manifold, Mesh64

    solid = Manifold(Mesh64(built, triangles.astype(np.uint64)))
    return None if solid.status() != Error.NoError or solid.is_empty() else solid


def _filled(section: Any) -> Any:
    """A section, a CrossSection, with its holes filled."""
    from manifold3d import CrossSection, FillRule

    rings = [np.asarray(ring) for ring in section.to_polygons()]
    return CrossSection([ring for ring in rings if signed_area(ring) > 0.0], FillRule.NonZero)


def _outlines(section: Any) -> list[Array]:
    return [np.asarray(ring) for ring in section.simplify(_SIMPLE_mm).to_polygons()]


class Layers:
    """A closed surface, vertices (n, 3) in mm and triangles (m, 3), whose sections are computed on demand.

    direction (3,): of the build, away from the platform. height_mm: of the whole part along it. chamber: the
    closed surface of a chamber within it, which counts as enclosed also where its inlet opens it. Raises
    InputError for a surface that encloses no volume.
    """

    def __init__(
        self,
        vertices: Vertices,
        triangles: Triangles,
        direction: ArrayLike,
        chamber: tuple[Vertices, Triangles] | None = None,
    ) -> None:
        self.frame = frame_along(np.asarray(direction, float))
        built = vertices @ self.frame.T
        self._low, high = (float(z) for z in (built[:, 2].min(), built[:, 2].max()))
        self.height_mm = high - self._low
        solid = _closed(built, triangles)
        if solid is None:
            raise InputError("the surface encloses no volume", "layers", "build the solid again")
        self._solid = solid
        self._chamber = None if chamber is None else _closed(chamber[0] @ self.frame.T, chamber[1])

    def filled(self, height_mm: float) -> Filled:
        """The section at a height above the lowest point, as triangles in the part's frame."""
        section = self._solid.slice(self._low + height_mm)
        enclosed = _filled(section) - section
        if self._chamber is not None:
            enclosed += self._chamber.slice(self._low + height_mm) - section
        points, faces = [np.empty((0, 3))], []
        for region in (section, enclosed):
            flat, triangles = _triangulated(region)
            faces.append(triangles + sum(map(len, points)))
            level = np.full((len(flat), 1), self._low + height_mm)
            points.append(np.concatenate([flat, level], axis=1) @ self.frame)
        areas = float(section.area()), float(enclosed.area())
        return Filled(np.concatenate(points), faces[0], faces[1], *areas)


def _triangulated(region: Any) -> tuple[Array, Triangles]:
    """Points (n, 2) and triangles (m, 3) of a CrossSection."""
    from manifold3d import triangulate

    rings = [np.asarray(ring) for ring in region.to_polygons()]
    if not rings:
        return np.empty((0, 2)), np.empty((0, 3), np.int64)
    return np.concatenate(rings), np.asarray(triangulate(rings)).astype(np.int64)


def signed_area(ring: Array) -> float:
    """Area in mm2 of a polygon (n, 2), positive where it runs counter-clockwise."""
    x, y = (ring - ring[0]).T
    return float(0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)))
