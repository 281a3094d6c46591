"""A surface seen as a grid of cells: which runs of them, along the rows of each layer, are solid.

What is inside is counted (winding number), so that solids which overlap count as one.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..surface import Triangles, Vertices
from .runs import Runs

Array = NDArray[np.float64]
Index = NDArray[np.int64]

_AT_ONCE = 2_000_000


@attrs.frozen(eq=False)
class VoxelRows:
    """A grid of `shape` cells of step (3,) mm from its corner low (3,): layers, rows, cells of a row.

    frame (3, 3): rows are the grid's axes, the first of them along the build. solid: the runs of solid cells;
    the line of row j of layer k is number k * shape[1] + j.
    """

    frame: Array
    low: Array
    step: Array
    shape: tuple[int, int, int]
    solid: Runs

    def lines(self, first: int, last: int) -> Runs:
        """Runs of solid cells in layers first .. last - 1."""
        return self.solid.part(first * self.shape[1], last * self.shape[1])

    def slab(self, first: int, last: int) -> NDArray[np.bool_]:
        """Which cells (last - first, rows, cells) of layers first .. last - 1 are solid."""
        _, rows, cells = self.shape
        here = self.lines(first, last)
        turns = np.zeros(((last - first) * rows, cells + 1), np.int8)
        line = here.line - first * rows
        turns[line, here.start] = 1
        turns[line, here.end] -= 1
        np.cumsum(turns, axis=1, out=turns)
        return turns[:, :-1].astype(bool).reshape(last - first, rows, cells)

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


def voxel_rows(
    vertices: Vertices,
    triangles: Triangles,
    step: float,
    layer: float | None = None,
    frame: Array | None = None,
) -> VoxelRows:
    """Cells of a closed surface, vertices (n, 3) in mm and triangles (m, 3), `step` mm wide.

    layer: height of cells in mm, `step` if None; frame (3, 3): axes as rows, the third along the build, by
    default x, y, z. The grid leaves two cells free on every side; the lowest layer of the part begins where
    the part does.
    """
    axes = (np.eye(3) if frame is None else frame)[[2, 0, 1]]
    seen = vertices @ axes.T
    size = np.array([step if layer is None else layer, step, step])
    extent = np.ptp(seen, axis=0)
    # Centres off the round numbers that designs are made of: no row then runs along a face.
    nudge = np.array([0.0, 0.2718, 0.3141]) * step
    low = seen.min(axis=0) - 2 * size - nudge
    shape = tuple((np.ceil((extent + nudge) / size).astype(int) + 4).tolist())
    line, cell, sign = _crossings((seen - low) / size - 0.5, triangles, shape)
    return VoxelRows(axes, low, size, shape, _filled(line, cell, sign, shape[2]))


def _filled(line: Index, cell: Index, sign: NDArray[np.int8], cells: int) -> Runs:
    """Runs of cells around which a surface winds, from its crossings along the lines."""
    width = cells + 1
    # Crossings at one cell count together, whatever their order.
    place, index = np.unique(line * width + cell, return_inverse=True)
    turns = np.bincount(np.ravel(index), sign, len(place)).astype(np.int64)
    inside = np.cumsum(turns) > 0
    before = np.concatenate([[False], inside[:-1]])
    begin, end = place[inside & ~before], place[before & ~inside]
    return Runs(begin // width, begin % width, end % width, cells)


def _crossings(
    points: Array, triangles: Triangles, shape: tuple[int, int, int]
) -> tuple[Index, Index, NDArray[np.int8]]:
    """Where rows at whole numbers of the first two coordinates meet triangles, in units of cells.

    Of each: number of its line, first cell whose centre lies beyond, and +1 where the solid begins, -1 where
    it ends.
    """
    # Row by row of cells or layer by layer, in whichever there are fewer.
    spans = []
    for k in (0, 1):
        a, b, c = np.ceil(points[:, k]).astype(np.int64)[triangles.T]
        spans.append(np.maximum(np.maximum(a, b), c) - np.minimum(np.minimum(a, b), c))
    across = 0 if spans[0].sum() <= spans[1].sum() else 1
    count = spans[across]
    kept = np.flatnonzero(count)
    cuts = np.flatnonzero(np.diff(np.cumsum(count[kept]) // _AT_ONCE)) + 1
    parts = [_crossed(points, triangles, part, count[part], across, shape) for part in np.split(kept, cuts)]
    line, cell, sign = (np.concatenate(each) for each in zip(*parts, strict=True))
    return line, cell, sign


def _crossed(
    points: Array,
    triangles: Triangles,
    part: Index,
    count: Index,
    across: int,
    shape: tuple[int, int, int],
) -> tuple[Index, Index, NDArray[np.int8]]:
    """Crossings of the triangles `part`, which meet `count` planes of a whole coordinate `across`."""
    along = 1 - across
    owner = np.repeat(part, count)
    first = np.ceil(points[:, across]).astype(np.int64)[triangles[part]].min(axis=1)
    plane = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(first, count)
    low = np.full(len(owner), np.inf)
    high = np.full(len(owner), -np.inf)
    depth_low, depth_high = np.zeros(len(owner)), np.zeros(len(owner))
    falling = np.zeros(len(owner), bool)
    for corner in range(3):
        a, b = triangles[owner, corner], triangles[owner, (corner + 1) % 3]
        # Neighbours see their common edge from the same end, so that it lies at the same place in both.
        p, q = points[np.minimum(a, b)], points[np.maximum(a, b)]
        below = p[:, across] <= plane
        i = np.flatnonzero(below != (q[:, across] <= plane))
        share = (plane[i] - p[i, across]) / (q[i, across] - p[i, across])
        at = p[i, along] + share * (q[i, along] - p[i, along])
        depth = p[i, 2] + share * (q[i, 2] - p[i, 2])
        left = at < low[i]
        right = at > high[i]
        low[i[left]], depth_low[i[left]] = at[left], depth[left]
        falling[i[left]] = below[i[left]] != (a[i[left]] < b[i[left]])
        high[i[right]], depth_high[i[right]] = at[right], depth[right]
    begin = np.ceil(low).astype(np.int64)
    number = np.maximum(np.ceil(high).astype(np.int64) - begin, 0)
    k = np.repeat(np.arange(len(owner)), number)
    at = np.arange(len(k)) - np.repeat(np.cumsum(number) - number, number) + begin[k]
    depth = depth_low[k] + (at - low[k]) / (high[k] - low[k]) * (depth_high[k] - depth_low[k])
    cell = np.clip(np.ceil(depth), 0, shape[2]).astype(np.int64)
    layer, row = (plane[k], at) if across == 0 else (at, plane[k])
    # Seen with the rows toward the eye: the side on which a triangle's lower edge falls is its outside.
    outward = falling[k] == (across == 1)
    return layer * shape[1] + row, cell, np.where(outward, -1, 1).astype(np.int8)
