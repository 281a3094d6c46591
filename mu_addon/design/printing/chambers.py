"""Chambers of a part and the openings through which they drain, or leak."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array
from .cell_runs import Parts, parts_of, runs_of
from .voxels import VoxelRows

Index = NDArray[np.int64]

DEEP = 6.0
"""Distances to the surface are resolved up to so many mm."""
NARROWING = 0.55
"""A pocket is a chamber if its way out is narrower than this share of its greatest radius."""
MOST_OPENINGS = 12
RUNGS = (3.0, 2.2, 1.6, 1.2, 0.9, 0.65, 0.45, 0.3)
"""Distances in mm from the surface at which pockets may separate from the outside, at most DEEP * NARROWING.
"""
NEAR = 4.0
"""Distance in mm around a pocket within which its ways out are sought first."""

Box = tuple[slice, ...]


@attrs.frozen(eq=False)
class Opening:
    """A way out of a chamber: its narrowest place (3,) in mm, and the unit vector (3,) along the way there.

    radius: of the largest ball in mm that fits there, to within a cell.
    """

    place: Array
    radius: float
    along: Array


@attrs.frozen(eq=False)
class Chamber:
    """A pocket: its widest place (3,) in mm, the radius of the largest ball there in mm, its volume in mm3.

    openings: its ways out, the widest first; a sealed chamber has none.
    """

    place: Array
    radius: float
    volume: float
    openings: list[Opening]


@attrs.frozen(eq=False)
class DistanceField:
    """Distances of free cells' centres from the surface, DEEP mm at most.

    squared: squares of the distances to the nearest solid cell's centre, in cells; 0 in the solid. Its value
    minus half a cell is within half a cell of the distance to the surface.
    """

    grid: VoxelRows
    squared: NDArray[np.uint16]

    def radius(self, squared: ArrayLike) -> Array:
        """Distances in mm to the surface of cells with these squares."""
        known = np.asarray(squared, float)
        step = float(self.grid.step[0])
        return np.where(known > 0, np.clip((np.sqrt(known) - 0.5) * step, 0.5 * step, DEEP), 0.0)

    def wider(self, radius: float) -> int:
        """The greatest square of a distance, in cells, of a cell that is no farther than `radius` in mm."""
        return int((radius / float(self.grid.step[0]) + 0.5) ** 2)


@attrs.frozen(eq=False)
class Chambers:
    """The chambers of a part, the largest first, and the grid's cells within them.

    within: cells of a chamber, up to the narrowest places of its ways out; free: cells that hold no solid.
    """

    found: list[Chamber]
    grid: VoxelRows
    within: NDArray[np.bool_]
    free: NDArray[np.bool_]

    def hold(self, points: Array) -> NDArray[np.bool_]:
        """True for each of the points (n, 3) in mm that lies in a cell of a chamber, (n,)."""
        return np.asarray(self.within[self._cells(points)])

    def beside(self, points: Array) -> NDArray[np.bool_]:
        """True for each of the points (n, 3) in mm that lies in a free cell of no chamber, (n,)."""
        cells = self._cells(points)
        return np.asarray(self.free[cells] & ~self.within[cells])

    def _cells(self, points: Array) -> tuple[NDArray[np.int64], ...]:
        grid = self.grid
        cell = np.floor((points @ grid.frame.T - grid.low) / grid.step).astype(np.int64)
        return tuple(np.clip(cell, 0, np.array(grid.shape) - 1).T)


def distance_field(grid: VoxelRows) -> DistanceField:
    """Distances to the surface in a grid of cubes; the outermost cells count as DEEP mm from the surface.

    The Euclidean distance, of one axis after the other (Saito and Toriwaki, Pattern Recognition 27 (1994)
    1551): exact up to DEEP, and computed in slices that fit the processor's cache.
    """
    step = float(grid.step[0])
    reach = int(np.ceil(DEEP / step + 0.5))
    layers, rows, cells = grid.shape
    squared = np.empty(grid.shape, np.uint16)
    thick = max(1, 1_000_000 // (rows * cells))
    for first in range(0, layers, thick):
        last = min(first + thick, layers)
        squared[first:last] = _along_rows(grid.slab(first, last), reach)
        for k in range(first, last):
            squared[k] = _nearer(squared[k], reach)
    for j in range(rows):
        squared[:, j] = _nearer(squared[:, j].copy(), reach)
    # The grid ends two cells beside the part: its rim stands for all the room beyond.
    for side in (0, -1):
        squared[side] = squared[:, side] = squared[:, :, side] = reach * reach
    return DistanceField(grid, squared)


def _along_rows(solid: NDArray[np.bool_], reach: int) -> NDArray[np.uint16]:
    """Squares of the distances to the nearest solid cell of the same row, of `reach` cells at most."""
    cells = solid.shape[2]
    at = np.arange(cells, dtype=np.int32)
    before = np.maximum.accumulate(np.where(solid, at, -reach), axis=2)
    after = np.minimum.accumulate(np.where(solid, at, cells + reach)[:, :, ::-1], axis=2)[:, :, ::-1]
    nearest = np.minimum(np.minimum(at - before, after - at), reach)
    return (nearest * nearest).astype(np.uint16)


def _nearer(squared: NDArray[np.uint16], reach: int) -> NDArray[np.uint16]:
    """The least of each cell's square and those of others along the first axis, each plus its way's."""
    found = squared.copy()
    if not (squared < reach * reach).any():
        return found
    for away in range(1, min(reach, len(squared))):
        farther = squared + np.uint16(away * away)
        np.minimum(found[away:], farther[:-away], out=found[away:])
        np.minimum(found[:-away], farther[away:], out=found[:-away])
    return found


def chambers(space: DistanceField, smallest_radius: float = 1.0) -> Chambers:
    """Pockets that narrow toward the outside, the largest first, with every way out that the grid resolves.

    smallest_radius: in mm, that the largest ball in a pocket must have at least. Ways out are found down to a
    radius of about 0.87 of a cell; narrower ones cannot be distinguished from a wall of cells. The squares of
    `space` are used up.
    """
    grid = space.grid
    step = float(grid.step[0])
    free = space.squared > 0
    within = np.zeros(grid.shape, bool)
    found: list[Chamber] = []
    for t in _rungs(smallest_radius, step):
        wide = parts_of(space.squared > space.wider(t))
        outside = int(wide.at(np.zeros((1, 3), np.int64))[0])
        for number in _deep(space, wide, max(smallest_radius, t / NARROWING)):
            if number == outside:
                continue
            first, last = wide.ends(wide.part == number)
            depth, at = _deepest(space.squared, first, last)
            box = tuple(slice(a, b + 1) for a, b in zip(first.min(axis=0), last.max(axis=0), strict=True))
            openings: list[Opening] = []
            around = _grown(box, NEAR, step, grid.shape)
            while len(openings) < MOST_OPENINGS:
                cells, radius, around = _way_out(space, wide, outside, at, t, around)
                if not len(cells):
                    break
                openings.append(_opening(space, cells, radius))
                _block(space.squared, cells, radius + 2.5 * step, step)
            else:
                around = _grown(box, np.inf, step, grid.shape)
            corner = np.array([side.start for side in around])
            inside = parts_of(space.squared[around] > 0)
            runs = [end + corner for end in inside.ends(inside.part == inside.at(at[None] - corner)[0])]
            volume = float((runs[1][:, 2] + 1 - runs[0][:, 2]).sum()) * grid.cell_volume
            # Less than half a ball is what blocking left over, and no chamber.
            greatest = float(space.radius(depth))
            mine = volume >= 2.0 * greatest**3
            for (i, j, a), b in zip(runs[0].tolist(), (runs[1][:, 2] + 1).tolist(), strict=True):
                space.squared[i, j, a:b] = 0
                within[i, j, a:b] |= mine
            if mine:
                found.append(Chamber(grid.points(at), greatest, volume, openings))
    found.sort(key=lambda chamber: -chamber.volume)
    return Chambers(found, grid, within, free)


def _rungs(smallest_radius: float, step: float) -> list[float]:
    """RUNGS that separate pockets of a radius from the outside on a grid, the greatest first; 0 for none.

    A pocket that is separate at a small distance from the surface is so at all greater ones. So of the rungs
    at which any pocket is deep enough only the greatest is needed.
    """
    rungs = [t for t in RUNGS if t > 0.9 * step] + [0.0]
    last = next(k for k, t in enumerate(rungs) if t <= NARROWING * smallest_radius)
    return rungs[: last + 1]


def _deep(space: DistanceField, wide: Parts, radius: float) -> list[int]:
    """Parts with a cell that is `radius` mm or more from the surface, in order."""
    squared = max(1, int(np.ceil((radius / float(space.grid.step[0]) + 0.5) ** 2)))
    deep = runs_of(space.squared >= squared)
    rows = space.squared.shape[1]
    found = wide.at(np.stack([deep.line // rows, deep.line % rows, deep.start], axis=1))
    return [int(number) for number in np.unique(found)]


def _deepest(squared: NDArray[np.uint16], first: Index, last: Index) -> tuple[int, Index]:
    """The greatest square among cells of runs, first and last cells (r, 3), and the cell (3,) that has it."""
    greatest, place = -1, first[0]
    for (i, j, a), b in zip(first.tolist(), (last[:, 2] + 1).tolist(), strict=True):
        row = squared[i, j, a:b]
        k = int(row.argmax())
        if row[k] > greatest:
            greatest, place = int(row[k]), np.array([i, j, a + k])
    return greatest, place


def _way_out(
    space: DistanceField, wide: Parts, outside: int, seed: Index, t: float, around: Box
) -> tuple[Index, float, Box]:
    """The neck of the widest way from the seed to the outside: cells (n, 3), radius, and certain part of the
    grid.

    wide: parts farther than t mm from the surface as they were, with `outside` and the seed in two of them.
    Only `around` is looked at. There a way that leaves it counts as a way out: as long as that is the better
    one, more is looked at.
    """
    step, shape = float(space.grid.step[0]), space.squared.shape
    while True:
        corner = np.array([side.start for side in around])
        part = space.squared[around]
        rims = [(side.start == 0, side.stop == n) for side, n in zip(around, shape, strict=True)]
        known = _outside(parts_of(part > space.wider(t)), wide, outside, corner)
        cells, radius, sure = _narrowest(space, part, known, rims, seed - corner, t)
        if sure:
            return cells + corner, radius, around
        around = _grown(around, max(side.stop - side.start for side in around) * step, step, shape)


def _grown(box: Box, reach: float, step: float, shape: tuple[int, ...]) -> Box:
    """A box of cells and all that lies within `reach` mm of it."""
    pad = int(min(np.ceil(reach / step), max(shape)))
    return tuple(slice(max(s.start - pad, 0), min(s.stop + pad, n)) for s, n in zip(box, shape, strict=True))


def _outside(here: Parts, wide: Parts, outside: int, corner: Index) -> Index:
    """A cell (k, 3) of each part in a box from `corner` that is outside.

    It was outside before openings were blocked, and reaches a face of the box, unlike parts cut off by
    blocking.
    """
    first, last = here.ends()
    touches = np.zeros(here.count, bool)
    touches[here.part[_on_face(first, last, here.shape)]] = True
    one = np.unique(here.part, return_index=True)[1]
    cells = first[one]
    return cells[touches & (wide.at(cells + corner) == outside)]


def _on_face(
    first: Index, last: Index, shape: tuple[int, ...], rims: list[tuple[bool, bool]] | None = None
) -> NDArray[np.bool_]:
    """Runs, first and last cells (r, 3), that reach a face of their box, other than those that are rims."""
    found = np.zeros(len(first), bool)
    for axis in range(3):
        low, high = (False, False) if rims is None else rims[axis]
        if not low:
            found |= first[:, axis] == 0
        if not high:
            found |= last[:, axis] == shape[axis] - 1
    return found


def _narrowest(
    space: DistanceField,
    squared: NDArray[np.uint16],
    out: Index,
    rims: list[tuple[bool, bool]],
    seed: Index,
    t: float,
) -> tuple[Index, float, bool]:
    """Narrowest cells (n, 3) of the widest way from the seed to `out`, its radius there, and a bool.

    The bool is True if no way over the box's faces, other than rims of the grid, can be wider.
    """

    def reached(radius: float) -> tuple[bool, bool]:
        parts = parts_of(squared > space.wider(radius))
        mine = parts.at(seed[None])[0]
        if mine < 0:
            return False, False
        ends = parts.ends(parts.part == mine)
        return bool((parts.at(out) == mine).any()), bool(_on_face(*ends, squared.shape, rims).any())

    none = np.empty((0, 3), np.int64)
    if not squared[tuple(seed)]:
        return none, 0.0, True
    low, high = 0.0, t
    found, left = reached(low)
    if not found:
        return none, 0.0, not left
    while high - low > float(space.grid.step[0]) / 8.0:
        middle = 0.5 * (low + high)
        ways = reached(middle)
        if any(ways):
            low, found = middle, ways[0]
        else:
            high = middle
    if not found:
        return none, 0.0, False
    parts = parts_of(squared > space.wider(high))
    outer = np.unique(parts.at(out))
    way = _passage(squared > space.wider(low), parts, int(parts.at(seed[None])[0]), outer[outer >= 0])
    return way, 0.5 * (low + high), True


def _passage(free: NDArray[np.bool_], wide: Parts, inner: int, outer: Index) -> Index:
    """Cells (n, 3) of a shortest way from the parts `outer` to the part `inner` through free cells."""
    sides = np.concatenate([np.eye(3, dtype=np.int64), -np.eye(3, dtype=np.int64)])
    size = np.array(free.shape)

    def beside(cells: Index) -> Index:
        """Free cells by the side of cells, each once."""
        near = (cells[:, None] + sides).reshape(-1, 3)
        near = near[((near >= 0) & (near < size)).all(axis=1)]
        near = near[free[tuple(near.T)]]
        return np.unique(near, axis=0)

    # Rings of cells around the inner part, each of those by the side of the ring before.
    rings = [_surface(wide, inner)]
    while True:
        near = beside(rings[-1])
        part = wide.at(near)
        arrived = near[np.isin(part, outer)]
        if len(arrived):
            break
        near = near[part != inner]
        if len(rings) > 1:
            near = near[~_among(near, rings[-1], free.shape) & ~_among(near, rings[-2], free.shape)]
        rings.append(near)
    # Back from the place where outside was met, one ring at a time.
    way = [arrived[0]]
    for ring in reversed(rings):
        near = way[-1] + sides
        way.append(near[_among(near, ring, free.shape)][0])
    return np.array(way)


def _surface(parts: Parts, number: int) -> Index:
    """Cells (n, 3) of a part that have a neighbour outside it."""
    first, last = parts.ends(parts.part == number)
    box = first.min(axis=0), last.max(axis=0) + 1
    body = np.zeros(box[1] - box[0] + 2, bool)
    for (i, j, a), b in zip(
        (first - box[0] + 1).tolist(), (last[:, 2] - box[0][2] + 2).tolist(), strict=True
    ):
        body[i, j, a:b] = True
    inner = body[1:-1, 1:-1, 1:-1].copy()
    for axis in range(3):
        for side in (slice(None, -2), slice(2, None)):
            inner &= body[tuple(side if k == axis else slice(1, -1) for k in range(3))]
    return np.argwhere(body[1:-1, 1:-1, 1:-1] & ~inner) + box[0]


def _among(cells: Index, others: Index, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    known = np.all((cells >= 0) & (cells < np.array(shape)), axis=1)
    found = np.zeros(len(cells), bool)
    _, b, c = shape
    one, other = ((k[:, 0] * b + k[:, 1]) * c + k[:, 2] for k in (cells[known], others))
    found[known] = np.isin(one, other)
    return found


def _opening(space: DistanceField, cells: Index, radius: float) -> Opening:
    """The opening where a way of cells (n, 3) is narrowest, halfway if it is so for a while."""
    width = space.squared[tuple(cells.T)]
    narrowest = np.flatnonzero(width == width.min())
    middle = int(narrowest[len(narrowest) // 2])
    near = space.grid.points(cells[max(middle - 3, 0) : middle + 4])
    along = near[-1] - near[0]
    return Opening(space.grid.points(cells[middle]), radius, along / np.linalg.norm(along))


def _block(squared: NDArray[np.uint16], cells: Index, radius: float, step: float) -> None:
    """Fill everything within `radius` mm of cells."""
    from scipy.ndimage import distance_transform_edt

    pad = int(np.ceil(radius / step)) + 1
    first = np.maximum(cells.min(axis=0) - pad, 0)
    last = cells.max(axis=0) + pad + 1
    box = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
    free = np.ones(squared[box].shape, bool)
    free[tuple((cells - first).T)] = False
    squared[box][distance_transform_edt(free, sampling=step) <= radius] = 0
