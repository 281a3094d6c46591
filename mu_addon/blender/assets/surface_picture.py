"""A small picture of a surface by numpy alone, seen from +x and a little from above and the side.

It blocks Blender's window, and the renderer of reports would first load Warp.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array

_TOWARDS = np.array([0.80, 0.45, 0.40])
_LIGHT = np.array([0.75, -0.25, 0.61])
_AMBIENT = 0.35
_MARGIN = 1.12


def surface_pixels(points: Array, triangles: Array, colours: Array, size: int) -> Array:
    """Pixels (size, size, 4) of a surface, sRGB from 0 to 1, rows from the bottom up; transparent around it.

    points (v, 3), triangles (t, 3), linear colours (t, 3). The nearest triangle is seen, lit on both sides.
    """
    right = np.cross([0.0, 0.0, 1.0], _TOWARDS)
    axes = np.array([right, np.cross(_TOWARDS, right), _TOWARDS])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    seen = np.asarray(points, float) @ axes.T
    low, high = seen[:, :2].min(axis=0), seen[:, :2].max(axis=0)
    scale = size / (_MARGIN * float((high - low).max()))
    seen[:, :2] = (seen[:, :2] - 0.5 * (low + high)) * scale + 0.5 * size
    corners = seen[triangles]
    first, second, third = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(second - first, third - first)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    # The visible side, whatever the order of a triangle's corners.
    normals *= np.where(normals @ _TOWARDS < 0.0, -1.0, 1.0)[:, None]
    light = _AMBIENT + (1.0 - _AMBIENT) * np.clip(normals @ _LIGHT / np.linalg.norm(_LIGHT), 0.0, 1.0)
    shaded = np.clip(colours * light[:, None], 0.0, 1.0) ** (1.0 / 2.2)

    depth = np.full((size, size), -np.inf)
    pixels = np.zeros((size, size, 4))
    for (a, b, c), colour in zip(corners, shaded, strict=True):
        _fill(pixels, depth, a, b, c, colour)
    return pixels


def _fill(pixels: Array, depth: Array, a: Array, b: Array, c: Array, colour: Array) -> None:
    """Draw the pixels of a triangle whose centres lie in it, where it is nearest."""
    whole = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if abs(whole) < 1e-9:
        return
    corners = np.array([a[:2], b[:2], c[:2]])
    x0, y0 = np.maximum(np.ceil(corners.min(axis=0) - 0.5), 0).astype(int)
    x1, y1 = np.minimum(np.floor(corners.max(axis=0) - 0.5) + 1, len(pixels)).astype(int)
    if x0 >= x1 or y0 >= y1:
        return
    x, y = np.arange(x0, x1) + 0.5, (np.arange(y0, y1) + 0.5)[:, None]
    u = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / whole
    v = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / whole
    z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
    there = depth[y0:y1, x0:x1]
    nearer = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (z > there)
    there[nearer] = z[nearer]
    pixels[y0:y1, x0:x1][nearer] = [*colour, 1.0]
