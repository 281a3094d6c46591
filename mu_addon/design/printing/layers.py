"""A part built layer by layer: islands, cups, overhangs and spans.

Layers are built from the platform in the direction of the frame's third axis. In a printer whose part hangs
from the platform the film below the tank closes every layer; what the part encloses against it is a cup.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from .voxels import VoxelColumns

Array = NDArray[np.float64]

_ACROSS = np.zeros((3, 3, 3), bool)
_ACROSS[1, :, 1] = _ACROSS[:, 1, 1] = True
_ROUND = np.zeros((3, 3, 3), bool)
_ROUND[:, :, 1] = True


@attrs.frozen(eq=False)
class Regions:
    """Connected regions of every layer, of solid or free cells, and which overlap from layer to layer.

    layer (r,): number of each region's layer; cells (r,): count of its cells; middle (r, 3): its mean, in
    cells, see VoxelColumns.points; outside (r,): whether it reaches the edge of the grid. links (l, 2):
    numbers of a region and of one in the next layer above it.
    """

    layer: NDArray[np.int64]
    cells: NDArray[np.int64]
    middle: Array
    outside: NDArray[np.bool_]
    links: NDArray[np.int64]


@attrs.frozen(eq=False)
class Islands:
    """Islands, the largest first: places (n, 3) in mm of their middles, and areas (n,) in mm2."""

    places: Array
    area: Array


@attrs.frozen(eq=False)
class Cups:
    """Cups, the largest first: largest sealed volumes (n,) in mm3, and places (n, 3) in mm of their middles.

    sealed (n,): whether a cup never opens.
    """

    volume: Array
    places: Array
    sealed: NDArray[np.bool_]


@attrs.frozen(eq=False)
class Overhang:
    """Regions of layers beyond what supports them: their farthest points (n, 3) in mm.

    reach (n,): distance of these points from the supported part, in mm; bridge (n,): whether a region is
    supported from opposite sides.
    """

    places: Array
    reach: Array
    bridge: NDArray[np.bool_]


def regions(columns: VoxelColumns, free: bool, at_once: int = 8_000_000) -> Regions:
    """Connected regions of every layer: free cells that touch by side, or solid ones, by side or corner.

    free: which of both; at_once: largest number of cells that are held in memory at a time.
    """
    from scipy.ndimage import label

    nx, ny, levels = columns.shape
    thick = max(1, at_once // (nx * ny))
    layer, cells, middle, outside, links = [], [], [], [], []
    before, begin, begin_before = None, 0, 0
    for first in range(0, levels, thick):
        last = min(first + thick, levels)
        body = columns.slab(first, last) > 0
        named, count = label(~body if free else body, _ACROSS if free else _ROUND)
        index = np.flatnonzero(named)
        flat = named.ravel()[index]
        size = np.bincount(flat, minlength=count + 1)[1:]
        at = np.unravel_index(index, named.shape)
        sums = [np.bincount(flat, axis, count + 1)[1:] / np.maximum(size, 1) for axis in at]
        edge = np.zeros(count + 1, bool)
        for side in (named[0], named[-1], named[:, 0], named[:, -1]):
            edge[np.unique(side)] = True
        layer.append(np.rint(sums[2]).astype(np.int64) + first)
        cells.append(size)
        middle.append(np.stack([sums[0], sums[1], sums[2] + first], axis=1))
        outside.append(edge[1:])
        if before is not None:
            links.append(_touching(before, named[:, :, 0], begin_before, begin))
        for k in range(last - first - 1):
            links.append(_touching(named[:, :, k], named[:, :, k + 1], begin, begin))
        before, begin_before = named[:, :, -1].copy(), begin
        begin += count
    return Regions(
        np.concatenate(layer),
        np.concatenate(cells),
        np.concatenate(middle),
        np.concatenate(outside),
        np.concatenate(links) if links else np.empty((0, 2), np.int64),
    )


def islands(columns: VoxelColumns, solid: Regions) -> Islands:
    """Islands: solid regions above the first layer without any solid below them.

    solid: the regions of the solid in the same columns.
    """
    held = np.zeros(len(solid.layer), bool)
    held[solid.links[:, 1]] = True
    found = np.flatnonzero(~held)
    found = found[solid.layer[found] > solid.layer.min()]
    found = found[np.argsort(-solid.cells[found], kind="stable")]
    area = solid.cells[found] * columns.step[0] * columns.step[1]
    return Islands(columns.points(solid.middle[found]), area)


def cups(columns: VoxelColumns, free: Regions) -> Cups:
    """Cups: groups of free regions that are closed in from the sides and from the platform's side.

    free: the free regions in the same columns. Regions are joined in the order of building; while a group has
    not met the outside, the film seals it. A cup's volume is that just before its group meets the outside, or
    that of the whole group if it never does.
    """
    parent = list(range(len(free.layer)))
    # Of each group of regions: cells, and the sums of their middles; whether it met the outside; its start.
    weight = np.concatenate([free.cells[:, None], free.cells[:, None] * free.middle], axis=1).tolist()
    is_open, start = free.outside.tolist(), free.layer.tolist()
    found: list[tuple[list[float], bool]] = []

    def root(k: int) -> int:
        while parent[k] != k:
            parent[k] = parent[parent[k]]
            k = parent[k]
        return k

    above = free.layer[free.links[:, 1]]
    order = np.argsort(above, kind="stable")
    for level, (a, b) in zip(above[order].tolist(), free.links[order].tolist(), strict=True):
        one, two = root(a), root(b)
        if one == two:
            continue
        for closed, other in ((one, two), (two, one)):
            # A region of this layer alone, closed to the side but open to below, is no cup.
            if is_open[other] and not is_open[closed] and start[closed] < level:
                found.append((weight[closed], False))
        parent[two] = one
        weight[one] = [x + y for x, y in zip(weight[one], weight[two], strict=True)]
        is_open[one] = is_open[one] or is_open[two]
        start[one] = min(start[one], start[two])
    found += [(weight[k], True) for k in range(len(parent)) if parent[k] == k and not is_open[k]]
    found.sort(key=lambda cup: -cup[0][0])
    sums = np.array([cup[0] for cup in found]).reshape(-1, 4)
    middle = sums[:, 1:] / np.maximum(sums[:, :1], 1.0)
    return Cups(
        sums[:, 0] * columns.cell_volume, columns.points(middle), np.array([c[1] for c in found], bool)
    )


def overhangs(columns: VoxelColumns, slope_deg: float, at_once: int = 8_000_000) -> Overhang:
    """What layers extend beyond the layer below, which supports slopes of `slope_deg` degrees from level.

    Islands are left out. A region supported from opposite sides is a bridge, whose span is twice its reach.
    at_once: largest number of cells that are held in memory at a time.
    """
    from scipy.ndimage import label

    nx, ny, levels = columns.shape
    thick = max(1, at_once // (nx * ny))
    near = _disk(columns.step[2] / np.tan(np.radians(slope_deg)) / columns.step[0])
    found: list[tuple[float, float, float, float, bool]] = []
    before = np.zeros((nx, ny), bool)
    begun = False
    for first in range(0, levels, thick):
        last = min(first + thick, levels)
        body = columns.slab(first, last) > 0
        filled = body.any(axis=(0, 1))
        for k in np.flatnonzero(filled).tolist():
            layer = body[:, :, k]
            if begun and (layer & ~before).any():
                held = _widened(before, near)
                beyond, count = label(layer & ~held, np.ones((3, 3)))
                if count:
                    found += _reaches(beyond, layer & held, float(columns.step[0]), first + k)
            before, begun = layer, True
    rows = np.array([f[:4] for f in found]).reshape(-1, 4)
    places = columns.points(rows[:, [1, 2, 3]]) if len(rows) else rows[:, 1:]
    return Overhang(places, rows[:, 0], np.array([f[4] for f in found], bool))


def _reaches(
    beyond: NDArray[np.int32], held: NDArray[np.bool_], step: float, level: int
) -> list[tuple[float, float, float, float, bool]]:
    """Reach, place in cells and whether it is a bridge, of each region that touches what is held."""
    from scipy.ndimage import distance_transform_edt, find_objects

    found: list[tuple[float, float, float, float, bool]] = []
    for number, box in enumerate(find_objects(beyond), 1):
        pad = 2 + max(s.stop - s.start for s in box)
        crop = tuple(slice(max(s.start - pad, 0), s.stop + pad) for s in box)
        part, support = beyond[crop] == number, held[crop]
        if not (_widened(part, np.ones((3, 3), bool)) & support).any():
            continue
        distance, (to_i, to_j) = distance_transform_edt(~support, return_indices=True)
        i, j = np.unravel_index(np.where(part, distance, 0.0).argmax(), part.shape)
        around = np.argwhere(part[max(i - 2, 0) : i + 3, max(j - 2, 0) : j + 3])
        around += np.array([max(i - 2, 0), max(j - 2, 0)])
        ways = np.stack([to_i[tuple(around.T)], to_j[tuple(around.T)]], axis=1) - around
        ways = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
        bridge = bool((ways @ ways.T).min() < -0.5)
        found.append((distance[i, j] * step, crop[0].start + i, crop[1].start + j, level, bridge))
    return found


def _disk(radius: float) -> NDArray[np.bool_]:
    """Cells (k, k) within `radius` cells of the middle one."""
    n = int(radius)
    i, j = np.ogrid[-n : n + 1, -n : n + 1]
    return np.asarray(i * i + j * j <= radius * radius)


def _widened(layer: NDArray[np.bool_], by: NDArray[np.bool_]) -> NDArray[np.bool_]:
    from scipy.ndimage import binary_dilation

    return np.asarray(binary_dilation(layer, by))


def _touching(
    below: NDArray[np.int32], above: NDArray[np.int32], begin_below: int, begin_above: int
) -> NDArray[np.int64]:
    """Pairs (l, 2) of numbers of regions with a cell over a cell; labels count from 1, numbers from 0."""
    both = (below > 0) & (above > 0)
    a, b = below[both].astype(np.int64), above[both].astype(np.int64)
    span = int(b.max(initial=0)) + 1
    code = np.unique(a * span + b)
    return np.stack([code // span - 1 + begin_below, code % span - 1 + begin_above], axis=1)
