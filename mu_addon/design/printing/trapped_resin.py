"""Resin that a part traps while it is printed, in cups.

In a printer whose part hangs from the platform, the film of the tank closes every layer. A volume that the
part encloses against it is a cup.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from .layers import Regions
from .voxels import VoxelRows


@attrs.frozen(eq=False)
class Cups:
    """Cups, the largest first: largest sealed volumes (n,) in mm3, and places (n, 3) in mm of their middles.

    sealed (n,): True if a cup never opens. first, last (n, 3): middles in mm of the regions with which it
    begins, on the platform's side, and ends.
    """

    volume: Array
    places: Array
    sealed: NDArray[np.bool_]
    first: Array
    last: Array


def cups(grid: VoxelRows, free: Regions) -> Cups:
    """Cups: groups of free regions that are closed in from the sides and from the platform's side.

    free: the free regions in the same grid. Regions are joined in the order of building; while a group has
    not met the outside, the film seals it. A cup's volume is that just before its group joins the outside, or
    that of the whole group if it never does.
    """
    parent = list(range(len(free.layer)))
    # Of each group of regions: cells, and the sums of their middles; whether it met the outside; its start.
    weight = np.concatenate([free.cells[:, None], free.cells[:, None] * free.middle], axis=1).tolist()
    is_open, start, top = free.outside.tolist(), free.layer.tolist(), free.layer.tolist()
    # The regions of a group that lie lowest and highest.
    lowest, highest = list(range(len(parent))), list(range(len(parent)))
    found: list[tuple[list[float], bool, int, int]] = []

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
            # A region of this layer alone, closed at the sides but open below, is no cup.
            if is_open[other] and not is_open[closed] and start[closed] < level:
                found.append((weight[closed], False, lowest[closed], highest[closed]))
        parent[two] = one
        weight[one] = [x + y for x, y in zip(weight[one], weight[two], strict=True)]
        is_open[one] = is_open[one] or is_open[two]
        if start[two] < start[one]:
            start[one], lowest[one] = start[two], lowest[two]
        if top[two] > top[one]:
            top[one], highest[one] = top[two], highest[two]
    found += [
        (weight[k], True, lowest[k], highest[k])
        for k in range(len(parent))
        if parent[k] == k and not is_open[k]
    ]
    found.sort(key=lambda cup: -cup[0][0])
    sums = np.array([cup[0] for cup in found]).reshape(-1, 4)
    middle = sums[:, 1:] / np.maximum(sums[:, :1], 1.0)
    first = free.middle[np.array([cup[2] for cup in found], np.int64)]
    last = free.middle[np.array([cup[3] for cup in found], np.int64)]
    return Cups(
        sums[:, 0] * grid.cell_volume,
        grid.points(middle),
        np.array([cup[1] for cup in found], bool),
        grid.points(first),
        grid.points(last),
    )
