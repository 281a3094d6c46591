"""Chambers of a part and the openings through which they drain, or leak."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from .voxels import VoxelColumns

Array = NDArray[np.float64]

DEEP = 6.0
"""Distances to the surface are told apart up to so many mm."""
NARROWING = 0.55
"""A pocket is a chamber if its way out is narrower than this share of its own greatest radius."""
MOST_OPENINGS = 12
NEAR = 12.0
"""How far in mm around a pocket its ways out are sought first."""

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
    """Distances (nx, ny, nz) in mm, DEEP at most, of free cells' centres from the surface; 0 in the solid.

    It is the distance to the nearest solid cell's centre less half a cell, and so within half a cell of the
    true one.
    """

    columns: VoxelColumns
    distance: NDArray[np.float32]


@attrs.frozen(eq=False)
class Chambers:
    """The chambers of a part, the largest first, and the grid's cells (nx, ny, nz) within them.

    within: cells of a chamber, up to the narrowest places of its ways out; free: cells that hold no solid.
    """

    found: list[Chamber]
    columns: VoxelColumns
    within: NDArray[np.bool_]
    free: NDArray[np.bool_]

    def hold(self, points: Array) -> NDArray[np.bool_]:
        """Whether each of the points (n, 3) in mm lies in a cell of a chamber, (n,)."""
        return np.asarray(self.within[self._cells(points)])

    def beside(self, points: Array) -> NDArray[np.bool_]:
        """Whether each of the points (n, 3) in mm lies in a free cell of no chamber, (n,)."""
        cells = self._cells(points)
        return np.asarray(self.free[cells] & ~self.within[cells])

    def _cells(self, points: Array) -> tuple[NDArray[np.int64], ...]:
        grid = self.columns
        cell = np.floor((points @ grid.frame.T - grid.low) / grid.step).astype(np.int64)
        return tuple(np.clip(cell, 0, np.array(grid.shape) - 1).T)


def distance_field(columns: VoxelColumns) -> DistanceField:
    """Distances to the surface in a grid of cubes, computed slab by slab to limit memory; see `Room`.

    columns: cells as high as wide; the outermost cells of the grid count as DEEP mm from the surface.
    """
    from scipy.ndimage import distance_transform_edt

    step = float(columns.step[0])
    nx, ny, levels = columns.shape
    halo = int(np.ceil(DEEP / step)) + 1
    thick = max(halo, 12_000_000 // (nx * ny))
    distance = np.zeros((nx, ny, levels), np.float32)
    for first in range(0, levels, thick):
        last = min(first + thick, levels)
        a, b = max(first - halo, 0), min(last + halo, levels)
        free = columns.slab(a, b) <= 0
        if free.all():
            distance[:, :, first:last] = DEEP
            continue
        far = distance_transform_edt(free, sampling=step)[:, :, first - a : last - a]
        np.clip(far - 0.5 * step, 0.5 * step, DEEP, out=far)
        far[~free[:, :, first - a : last - a]] = 0.0
        distance[:, :, first:last] = far
    # The grid ends two cells beside the part: its rim stands for all the room beyond.
    for side in (0, -1):
        distance[side] = distance[:, side] = distance[:, :, side] = DEEP
    return DistanceField(columns, distance)


def chambers(space: DistanceField, smallest_radius: float = 1.0) -> Chambers:
    """Pockets that narrow toward the outside, the largest first, with every way out that the grid resolves.

    smallest_radius: in mm, that the largest ball in a pocket must have at least. Ways out are found down to a
    radius of about 0.87 of a cell; narrower ones cannot be told from a wall of cells.
    """
    from scipy.ndimage import find_objects, label

    step = float(space.columns.step[0])
    d = space.distance.copy()
    found: list[Chamber] = []
    within = np.zeros(d.shape, bool)
    ladder = (4.0, 3.0, 2.2, 1.6, 1.2, 0.9, 0.65, 0.45, 0.3)
    for t in [t for t in ladder if t > 0.9 * step] + [0.0]:
        wide, _ = label(d > t)
        outside = wide[0, 0, 0]
        for number, box in enumerate(find_objects(wide), 1):
            if number == outside:
                continue
            depth = np.where(wide[box] == number, d[box], 0.0)
            greatest = float(depth.max())
            if greatest < max(smallest_radius, t / NARROWING):
                continue
            at = np.array(np.unravel_index(depth.argmax(), depth.shape)) + [s.start for s in box]
            seed = tuple(at.tolist())
            openings: list[Opening] = []
            around = _grown(box, NEAR, step, d.shape)
            while len(openings) < MOST_OPENINGS:
                cells, radius, around = _way_out(d, wide, outside, seed, t, around, step)
                if not len(cells):
                    break
                openings.append(_opening(space, cells, radius))
                _block(d, cells, radius + 2.5 * step, step)
            else:
                around = _grown(box, np.inf, step, d.shape)
            inside, _ = label(d[around] > 0.0)
            inside = inside == inside[_within(seed, around)]
            volume = float(np.count_nonzero(inside)) * space.columns.cell_volume
            d[around][inside] = 0.0
            if volume < 2.0 * greatest**3:  # half a ball: what blocking left over, no chamber
                continue
            within[around] |= inside
            found.append(Chamber(space.columns.points(at), greatest, volume, openings))
    found.sort(key=lambda chamber: -chamber.volume)
    return Chambers(found, space.columns, within, space.distance > 0.0)


def _way_out(
    d: NDArray[np.float32],
    wide: NDArray[np.int32],
    outside: int,
    seed: tuple[int, ...],
    t: float,
    around: Box,
    step: float,
) -> tuple[NDArray[np.int64], float, Box]:
    """Cells (n, 3) of the widest way from the seed to the outside where it is narrowest, none if there is
    none; its radius there; and the part of the grid in which that is sure.

    wide: pieces of d > t as it was, with `outside` and the seed in two of them. Only `around` is looked at.
    There a way that leaves it counts as a way out: as long as that is the better one, more is looked at.
    """
    while True:
        part, at = d[around], _within(seed, around)
        out, edge = _outside(part, wide[around] == outside, t, around, d.shape)
        cells, radius, sure = _narrowest(part, out, edge, at, t, step)
        if sure:
            return cells + [side.start for side in around], radius, around
        around = _grown(around, max(side.stop - side.start for side in around) * step, step, d.shape)


def _grown(box: Box, reach: float, step: float, shape: tuple[int, ...]) -> Box:
    """A box of cells and all that lies within `reach` mm of it."""
    pad = int(min(np.ceil(reach / step), max(shape)))
    return tuple(slice(max(s.start - pad, 0), min(s.stop + pad, n)) for s, n in zip(box, shape, strict=True))


def _within(cell: tuple[int, ...], box: Box) -> tuple[int, ...]:
    return tuple(k - side.start for k, side in zip(cell, box, strict=True))


def _outside(
    part: NDArray[np.float32], known: NDArray[np.bool_], t: float, box: Box, shape: tuple[int, ...]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Of a box's cells those wider than t that are outside, and those by which one could leave the box.

    known: outside before openings were blocked; what blocking cut off does not reach the box's faces.
    """
    from scipy.ndimage import label

    named, count = label(known & (part > t))
    reaches = np.zeros(count + 1, bool)
    edge = np.zeros(part.shape, bool)
    for axis, side in enumerate(box):
        for face, rim in ((0, side.start == 0), (-1, side.stop == shape[axis])):
            at = (slice(None),) * axis + (face,)
            reaches[np.unique(named[at])] = True
            if not rim:
                edge[at] = part[at] > 0.0
    reaches[0] = False
    return reaches[named], edge


def _narrowest(
    d: NDArray[np.float32],
    out: NDArray[np.bool_],
    edge: NDArray[np.bool_],
    seed: tuple[int, ...],
    t: float,
    step: float,
) -> tuple[NDArray[np.int64], float, bool]:
    """Cells (n, 3) where the widest way from the seed to `out` is narrowest, its radius there, and whether
    no way over `edge` can be wider."""
    from scipy.ndimage import label

    def reached(radius: float) -> tuple[bool, bool]:
        named, _ = label(d > radius)
        mine = named == named[seed]
        return bool((mine & out).any()), bool((mine & edge).any())

    none = np.empty((0, 3), np.int64)
    if d[seed] <= 0.0:
        return none, 0.0, True
    low, high = 0.0, t
    found, left = reached(low)
    if not found:
        return none, 0.0, not left
    while high - low > step / 8.0:
        middle = 0.5 * (low + high)
        ways = reached(middle)
        if any(ways):
            low, found = middle, ways[0]
        else:
            high = middle
    if not found:
        return none, 0.0, False
    wide, _ = label(d > high)
    outer = np.isin(wide, np.unique(wide[out]))
    return _passage(d > low, wide == wide[seed], outer & (wide > 0)), 0.5 * (low + high), True


def _passage(
    free: NDArray[np.bool_], inner: NDArray[np.bool_], outer: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Cells (n, 3) of a shortest way from `outer` to `inner` through what is free, with its ends in them."""
    # A rim of cells that are not free, so that no ring runs over the edge.
    free, inner, outer = (np.pad(mask, 1) for mask in (free, inner, outer))
    offsets = np.array([1, -1], np.int64)[:, None] * np.array(
        [free.shape[1] * free.shape[2], free.shape[2], 1]
    )
    offsets = offsets.ravel()
    flat_free, flat_outer = free.ravel(), outer.ravel()
    # Rings around the inner part.
    ring = np.where(inner.ravel(), np.int16(0), np.int16(-1))
    cells = np.flatnonzero(ring == 0)
    cells = cells[(ring[cells[:, None] + offsets] < 0).any(axis=1)]  # its surface
    for distance in range(1, 30_000):
        reached = np.unique((cells[:, None] + offsets).ravel())
        arrived = reached[flat_outer[reached]]
        if len(arrived):
            break
        cells = reached[flat_free[reached] & (ring[reached] < 0)]
        ring[cells] = distance
    # Back from the place where outside was met, one ring at a time.
    steps = arrived[:1]
    way = [int(steps[0])]
    for level in range(distance - 1, -1, -1):
        steps = steps[0] + offsets
        steps = steps[ring[steps] == level][:1]
        way.append(int(steps[0]))
    return np.stack(np.unravel_index(np.array(way), free.shape), axis=1) - 1


def _opening(space: DistanceField, cells: NDArray[np.int64], radius: float) -> Opening:
    """The opening where a way of cells (n, 3) is narrowest, halfway if it is so for a while."""
    width = space.distance[tuple(cells.T)]
    narrowest = np.flatnonzero(width <= width.min() + 1e-3)
    middle = int(narrowest[len(narrowest) // 2])
    near = space.columns.points(cells[max(middle - 3, 0) : middle + 4])
    along = near[-1] - near[0]
    return Opening(space.columns.points(cells[middle]), radius, along / np.linalg.norm(along))


def _block(d: NDArray[np.float32], cells: NDArray[np.int64], radius: float, step: float) -> None:
    """Fill what lies within `radius` mm of cells."""
    from scipy.ndimage import distance_transform_edt

    pad = int(np.ceil(radius / step)) + 1
    first = np.maximum(cells.min(axis=0) - pad, 0)
    last = cells.max(axis=0) + pad + 1
    box = tuple(slice(a, b) for a, b in zip(first, last, strict=True))
    free = np.ones(d[box].shape, bool)
    free[tuple((cells - first).T)] = False
    d[box][distance_transform_edt(free, sampling=step) <= radius] = 0.0
