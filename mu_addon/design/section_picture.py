"""A small picture of a unit's half section, by numpy alone, since it blocks Blender's window."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .lattice import Lattice, lattice_of
from .parameters import Unit
from .profile import cavity_polygon, outer_polygon

# Red, green, blue and opacity. All are opaque: Blender's asset browser adds the colour of a translucent pixel
# whole to what is behind it, which made the envelope as light as its struts.
ENVELOPE, STRUT = (0.25, 0.28, 0.33, 1.0), (0.74, 0.79, 0.85, 1.0)
WALL, CAVITY = (0.79, 0.54, 0.23, 1.0), (0.16, 0.29, 0.36, 1.0)
_MARGIN = 1.06
_PER_ARC = 8


def section_pixels(unit: Unit, size: int = 128) -> Array:
    """Pixels (size, size, 4) of the half section x = 0, from 0 to 1, rows from the bottom up; clear outside.

    The struts shown are those within half a cell of the section, projected onto it.
    """
    d = unit.dimensions
    (_, _), (y0, y1), (z0, z1) = d.bounds
    widest = _MARGIN * max(y1 - y0, z1 - z0)
    along = (np.arange(size) + 0.5) / size - 0.5
    y = (0.5 * (y0 + y1) + widest * along)[None, :] + np.zeros((size, 1))
    z = (0.5 * (z0 + z1) + widest * along)[:, None] + np.zeros((1, size))
    pixels = np.zeros((size, size, 4))
    inside = (y >= y0) & (y <= y1) & (z >= z0) & (z <= z1)
    pixels[inside] = ENVELOPE
    pixels[inside & _on_strut(unit, y, z)] = STRUT
    for polygon, color in ((outer_polygon(d, _PER_ARC), WALL), (cavity_polygon(d, _PER_ARC), CAVITY)):
        pixels[_within(polygon, np.abs(y), z)] = color
    return pixels


def struts_beside_section(lattice: Lattice) -> Array:
    """Rows of the struts within half a cell of the section x = 0, on its +x side."""
    x = lattice.nodes[lattice.struts][..., 0]
    return np.flatnonzero((x.min(axis=1) > -1e-6) & (x.max(axis=1) < 0.51 * lattice.cell))


def _on_strut(unit: Unit, y: Array, z: Array) -> Array:
    """Mask of the points on a strut next to the section, seen along x."""
    lattice = lattice_of(unit.dimensions)
    rows = struts_beside_section(lattice)
    at = np.stack([y, z], axis=-1)
    found = np.zeros(y.shape, bool)
    for row, (first, last) in zip(rows, lattice.nodes[lattice.struts[rows]][:, :, 1:], strict=True):
        way = last - first
        share = np.clip((at - first) @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
        away = np.linalg.norm(at - first - share[..., None] * way, axis=-1)
        found |= away <= lattice.radii(np.array([0.5]), np.array([row]))[0, 0]
    return found


def _within(polygon: Array, r: Array, z: Array) -> Array:
    """Mask of the points in a closed polygon (n, 2), by the crossings of a line along r."""
    inside = np.zeros(r.shape, bool)
    for (r0, z0), (r1, z1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if z0 != z1:
            crosses = (z >= min(z0, z1)) & (z < max(z0, z1))
            inside ^= crosses & (r < r0 + (z - z0) * (r1 - r0) / (z1 - z0))
    return inside
