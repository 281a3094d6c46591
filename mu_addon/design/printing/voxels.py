"""A surface seen as columns: where each line along the build direction enters and leaves the solid.

What is inside is counted (winding number), so that solids which overlap count as one.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..surface import Triangles, Vertices

Array = NDArray[np.float64]

_AT_ONCE = 2_000_000


@attrs.frozen(eq=False)
class VoxelColumns:
    """A grid of `shape` cells of step (3,) mm from its corner low (3,), and the surface's crossings along z.

    frame (3, 3): rows are the grid's axes. column, level and sign (c,) of each crossing: the column's number
    i * shape[1] + j, the first cell whose centre lies above it, and +1 where the solid begins, -1 where it
    ends; sorted by level.
    """

    frame: Array
    low: Array
    step: Array
    shape: tuple[int, int, int]
    column: NDArray[np.int64]
    level: NDArray[np.int64]
    sign: NDArray[np.int8]

    def slab(self, first: int, last: int) -> NDArray[np.int8]:
        """Winding numbers (nx, ny, last - first) at the centres of cells in levels first .. last - 1."""
        nx, ny, _ = self.shape
        a, b = np.searchsorted(self.level, [first, last])
        turns = np.zeros((nx * ny, last - first), np.int8)
        if a:
            turns[:, 0] = np.bincount(self.column[:a], self.sign[:a], nx * ny)
        np.add.at(turns, (self.column[a:b], self.level[a:b] - first), self.sign[a:b])
        np.cumsum(turns, axis=1, out=turns)
        return turns.reshape(nx, ny, last - first)

    def points(self, index: ArrayLike) -> Array:
        """Places (n, 3) in mm, in the surface's frame, of cells (n, 3); whole numbers are cell centres."""
        return np.asarray((self.low + (np.asarray(index) + 0.5) * self.step) @ self.frame)

    @property
    def cell_volume(self) -> float:
        """Volume of a cell in mm3."""
        return float(np.prod(self.step))


def frame_along(direction: Array) -> Array:
    """Orthogonal unit vectors as rows (3, 3), right-handed, the third along a direction (3,)."""
    up = np.asarray(direction, float) / np.linalg.norm(direction)
    aside = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = aside - (aside @ up) * up
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def voxel_columns(
    vertices: Vertices,
    triangles: Triangles,
    step: float,
    layer: float | None = None,
    frame: Array | None = None,
    margin: float = 0.0,
) -> VoxelColumns:
    """Columns through a closed surface, vertices (n, 3) in mm and triangles (m, 3), `step` mm apart.

    layer: height of cells in mm, `step` if None; frame (3, 3): the grid's axes as rows, by default x, y, z.
    The grid leaves `margin` mm, and at least two cells, free on every side; the lowest layer of the part
    begins where the part does.
    """
    frame = np.eye(3) if frame is None else frame
    seen = vertices @ frame.T
    size = np.array([step, step, step if layer is None else layer])
    pad = 2 + np.ceil(margin / size).astype(int)
    extent = np.ptp(seen, axis=0)
    # Centres off the round numbers that designs are made of: no column then runs along a face.
    nudge = np.array([0.2718, 0.3141, 0.0]) * step
    low = seen.min(axis=0) - pad * size - nudge
    shape = tuple((np.ceil((extent + nudge) / size).astype(int) + 2 * pad).tolist())
    local = (seen - low) / size - 0.5
    column, level, sign = _crossings(local, triangles, shape)
    order = np.argsort(level, kind="stable")
    return VoxelColumns(frame, low, size, shape, column[order], level[order], sign[order])


def _crossings(
    points: Array, triangles: Triangles, shape: tuple[int, int, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int8]]:
    """Crossings of the lines at whole numbers x, y with triangles, in units of cells."""
    corners = points[triangles]
    low = np.ceil(corners[:, :, :2].min(axis=1)).astype(np.int64)
    high = np.floor(corners[:, :, :2].max(axis=1)).astype(np.int64)
    span = np.maximum(high - low + 1, 0)
    p, q, r = corners[:, 0], corners[:, 1], corners[:, 2]
    double: Array = (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (r[:, 0] - p[:, 0]) * (q[:, 1] - p[:, 1])
    count = np.where(double != 0.0, span.prod(axis=1), 0)
    kept = np.flatnonzero(count)
    count = count[kept]
    cuts = np.flatnonzero(np.diff(np.cumsum(count) // _AT_ONCE)) + 1
    parts = [_crossed(points, triangles, double, low, span, part, shape) for part in np.split(kept, cuts)]
    column, level, sign = (np.concatenate(each) for each in zip(*parts, strict=True))
    return column, level, sign


def _crossed(
    points: Array,
    triangles: Triangles,
    double: Array,
    low: NDArray[np.int64],
    span: NDArray[np.int64],
    part: NDArray[np.int64],
    shape: tuple[int, int, int],
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int8]]:
    count = span[part].prod(axis=1)
    owner = np.repeat(part, count)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    wide = span[owner, 0]
    x, y = low[owner, 0] + k % wide, low[owner, 1] + k // wide
    inside = np.ones(len(owner), bool)
    weights = []
    for corner in range(3):
        a, b = triangles[owner, (corner + 1) % 3], triangles[owner, (corner + 2) % 3]
        # Neighbours see their common edge from the same end, so that a line on it is counted in one of them.
        swapped = a > b
        first, second = points[np.where(swapped, b, a)], points[np.where(swapped, a, b)]
        area = (second[:, 0] - first[:, 0]) * (y - first[:, 1])
        area -= (second[:, 1] - first[:, 1]) * (x - first[:, 0])
        area *= np.where(swapped, -1.0, 1.0) * np.sign(double[owner])
        inside &= (area > 0.0) | ((area == 0.0) & (swapped == (double[owner] > 0.0)))
        weights.append(area)
    owner, x, y = owner[inside], x[inside], y[inside]
    share = np.stack([w[inside] for w in weights], axis=1)
    share /= share.sum(axis=1, keepdims=True)
    height = np.einsum("ij,ij->i", share, points[triangles[owner], 2])
    level = np.clip(np.ceil(height), 0, shape[2]).astype(np.int64)
    kept = level < shape[2]
    sign = np.where(double[owner] < 0.0, 1, -1).astype(np.int8)
    return (x * shape[1] + y)[kept], level[kept], sign[kept]
