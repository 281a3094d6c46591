"""A part built layer by layer: islands, overhangs and spans; resin that is trapped: `trapped_resin`.

Layers are built from the platform in the direction of the grid's first axis.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, connected
from .cell_runs import Runs, meeting
from .voxels import VoxelRows


@attrs.frozen(eq=False)
class Regions:
    """Connected regions of every layer, of solid or free cells, and their overlaps from layer to layer.

    layer (r,): number of each region's layer; cells (r,): count of its cells; middle (r, 3): its mean, in
    cells, see VoxelRows.points; outside (r,): True if it reaches the edge of the grid. links (l, 2): numbers
    of a region and of one in the next layer above it.
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
class Overhang:
    """Regions of layers beyond their support: their farthest points (n, 3) in mm.

    reach (n,): distance of these points from the supported part, in mm; bridge (n,): True if a region is
    supported from opposite sides.
    """

    places: Array
    reach: Array
    bridge: NDArray[np.bool_]


def regions(grid: VoxelRows, free: bool, at_once: int = 8_000_000) -> Regions:
    """Connected regions of every layer: free cells that touch by side, or solid ones, by side or corner.

    free: of free cells instead of solid ones; at_once: cells of the layers processed together, to limit
    memory.
    """
    layers, rows, cells = grid.shape
    thick = max(1, at_once // (rows * cells))
    layer, size, middle, outside, links = [], [], [], [], []
    before: tuple[Runs, NDArray[np.int64]] | None = None
    begin = 0
    for first in range(0, layers, thick):
        last = min(first + thick, layers)
        runs = grid.lines(first, last)
        if free:
            runs = runs.complement(first * rows, last * rows)
        one, other = meeting(runs, runs, 1, 0 if free else 1)
        beside = runs.line[one] % rows != rows - 1
        part = connected(len(runs.line), one[beside], other[beside])
        count = int(part.max(initial=-1)) + 1
        length = runs.end - runs.start
        at_layer, at_row = runs.line // rows, runs.line % rows
        number = np.bincount(part, length, count)
        centre = [at_layer, at_row, 0.5 * (runs.start + runs.end - 1)]
        middle.append(
            np.stack([np.bincount(part, length * x, count) / np.maximum(number, 1) for x in centre], axis=1)
        )
        edge = np.zeros(count, bool)
        edge[part[(at_row == 0) | (at_row == rows - 1) | (runs.start == 0) | (runs.end == cells)]] = True
        layer.append(np.rint(middle[-1][:, 0]).astype(np.int64))
        size.append(np.rint(number).astype(np.int64))
        outside.append(edge)
        named = part + begin
        if before is not None:
            links.append(_linked(*before, runs.part(first * rows, (first + 1) * rows), named, rows))
        links.append(_linked(runs, named, runs, named, rows))
        tail = int(np.searchsorted(runs.line, (last - 1) * rows))
        before = runs.part((last - 1) * rows, last * rows), named[tail:]
        begin += count
    return Regions(
        np.concatenate(layer),
        np.concatenate(size),
        np.concatenate(middle),
        np.concatenate(outside),
        np.concatenate(links),
    )


def islands(grid: VoxelRows, solid: Regions) -> Islands:
    """Islands: solid regions above the first layer without any solid below them.

    solid: the regions of the solid in the same grid.
    """
    held = np.zeros(len(solid.layer), bool)
    held[solid.links[:, 1]] = True
    found = np.flatnonzero(~held)
    found = found[solid.layer[found] > solid.layer.min()]
    found = found[np.argsort(-solid.cells[found], kind="stable")]
    area = solid.cells[found] * grid.step[1] * grid.step[2]
    return Islands(grid.points(solid.middle[found]), area)


def overhangs(grid: VoxelRows, slope_deg: float, at_once: int = 8_000_000) -> Overhang:
    """Overhangs of layers beyond the layer below, which supports slopes of `slope_deg` degrees from level.

    Islands are left out. A region supported from opposite sides is a bridge, whose span is twice its reach.
    at_once: largest number of cells that are held in memory at a time.
    """
    from scipy.ndimage import label

    layers, rows, cells = grid.shape
    thick = max(1, at_once // (rows * cells))
    near = _disk(grid.step[0] / np.tan(np.radians(slope_deg)) / grid.step[1])
    found: list[tuple[float, float, float, float, bool]] = []
    before = np.zeros((rows, cells), bool)
    begun = False
    for first in range(0, layers, thick):
        body = grid.slab(first, min(first + thick, layers))
        for k in np.flatnonzero(body.any(axis=(1, 2))).tolist():
            layer = body[k]
            if begun and (layer & ~before).any():
                held = _widened(before, near)
                beyond, count = label(layer & ~held, np.ones((3, 3)))
                if count:
                    found += _reaches(beyond, layer & held, float(grid.step[1]), first + k)
            before, begun = layer, True
    worst = np.array([f[:4] for f in found]).reshape(-1, 4)
    places = grid.points(worst[:, 1:]) if len(worst) else worst[:, 1:]
    return Overhang(places, worst[:, 0], np.array([f[4] for f in found], bool))


def _reaches(
    beyond: NDArray[np.int32], held: NDArray[np.bool_], step: float, level: int
) -> list[tuple[float, float, float, float, bool]]:
    """Reach, position in cells, and True for a bridge, of each region that touches supported cells."""
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
        found.append((distance[i, j] * step, level, crop[0].start + i, crop[1].start + j, bridge))
    return found


def _disk(radius: float) -> NDArray[np.bool_]:
    """Cells (k, k) within `radius` cells of the middle one."""
    n = int(radius)
    i, j = np.ogrid[-n : n + 1, -n : n + 1]
    return np.asarray(i * i + j * j <= radius * radius)


def _widened(layer: NDArray[np.bool_], by: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells (a, b) that a shape `by`, of an odd number of cells a side, reaches from a marked one."""
    rows, cells = layer.shape
    found = np.zeros((rows + by.shape[0] - 1, cells + by.shape[1] - 1), bool)
    # Shapes have a few cells: as many shifts take a tenth of the time of a general dilation.
    for i, j in np.argwhere(by).tolist():
        found[i : i + rows, j : j + cells] |= layer
    i, j = by.shape[0] // 2, by.shape[1] // 2
    return found[i : i + rows, j : j + cells]


def _linked(
    below: Runs, named_below: NDArray[np.int64], above: Runs, named_above: NDArray[np.int64], rows: int
) -> NDArray[np.int64]:
    """Pairs (l, 2) of numbers of regions with a cell over a cell."""
    one, other = meeting(below, above, rows)
    a, b = named_below[one].astype(np.int64), named_above[other].astype(np.int64)
    span = int(b.max(initial=0)) + 1
    code = np.unique(a * span + b)
    return np.stack([code // span, code % span], axis=1)
