"""A surface as a grid of cells: the solid runs along the rows of each layer.

The inside is found by winding number, so that overlapping solids count as one.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array, ranges
from ..surface import Triangles, Vertices
from .cell_runs import Runs

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
        """Mask of the solid cells (last - first, rows, cells) of layers first .. last - 1."""
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
    every = line * width + cell
    order = np.argsort(every, kind="stable")
    every = every[order]
    last = np.diff(every, append=-1) != 0
    place, inside = every[last], np.cumsum(sign[order], dtype=np.int64)[last] > 0
    before = np.concatenate([[False], inside[:-1]])
    begin, end = place[inside & ~before], place[before & ~inside]
    return Runs(begin // width, begin % width, end % width, cells)


def _crossings(
    points: Array, triangles: Triangles, shape: tuple[int, int, int]
) -> tuple[Index, Index, NDArray[np.int8]]:
    """Crossings of triangles with rows at whole numbers of the first two coordinates, in units of cells.

    Returned for each: number of its line, first cell whose centre lies beyond, and +1 where the solid begins,
    -1 where it ends.
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
    # Coordinates one by one: where a triangle has many planes, reading rows of points takes most of the time.
    x, y, z = (np.ascontiguousarray(points[:, k]) for k in (across, 1 - across, 2))
    number, plane = ranges(count, np.ceil(x).astype(np.int64)[triangles[part]].min(axis=1))
    low = np.full(len(number), np.inf)
    high = np.full(len(number), -np.inf)
    depth_low, depth_high = np.zeros(len(number)), np.zeros(len(number))
    falling = np.zeros(len(number), bool)
    for corner in range(3):
        a, b = triangles[part, corner], triangles[part, (corner + 1) % 3]
        # Neighbours see their common edge from the same end, so that it lies at the same place in both.
        p, q = np.minimum(a, b), np.maximum(a, b)
        below = np.repeat(x[p], count) <= plane
        i = np.flatnonzero(below != (np.repeat(x[q], count) <= plane))
        edge, below = number[i], below[i]
        forward, p, q = (a < b)[edge], p[edge], q[edge]
        share = (plane[i] - x[p]) / (x[q] - x[p])
        at = y[p] + share * (y[q] - y[p])
        depth = z[p] + share * (z[q] - z[p])
        left = at < low[i]
        right = at > high[i]
        to = i[left]
        low[to], depth_low[to], falling[to] = at[left], depth[left], (below != forward)[left]
        to = i[right]
        high[to], depth_high[to] = at[right], depth[right]
    begin = np.ceil(low).astype(np.int64)
    met = np.maximum(np.ceil(high).astype(np.int64) - begin, 0)
    k, at = ranges(met, begin)
    depth = depth_low[k] + (at - low[k]) / (high[k] - low[k]) * (depth_high[k] - depth_low[k])
    cell = np.clip(np.ceil(depth), 0, shape[2]).astype(np.int64)
    layer, row = (plane[k], at) if across == 0 else (at, plane[k])
    # Seen with the rows toward the eye: the side on which a triangle's lower edge falls is its outside.
    outward = falling[k] == (across == 1)
    return layer * shape[1] + row, cell, np.where(outward, -1, 1).astype(np.int8)
