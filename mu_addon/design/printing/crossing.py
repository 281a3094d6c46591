"""Triangles of a surface that pass through one another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...arrays import ranges
from ..surface import Triangles, Vertices
from .finding import NOWHERE, Points

DEPTH = 2e-3
"""Passing through by less (mm) is rounding: vertices lie on a grid of 1e-4 mm, and layers are 0.1 mm."""

MOST_CROSSINGS = 20_000
"""Points at most: of triangles without order each passes through most others."""

_ROUNDING = 1e-6
"""Height (mm) above a plane that may be rounding, for coordinates up to a kilometre."""
_AT_ONCE = 1_000_000
_PAIRS_AT_ONCE = 200_000
# A box that is wider than so many cells goes into a coarser grid.
_CELLS_ACROSS = 8.0


def crossings(vertices: Vertices, triangles: Triangles) -> Points:
    """Points (k, 3) in mm where an edge of one triangle passes through the interior of another.

    vertices (n, 3) in mm, triangles (m, 3). Triangles with a common edge are not tested against each other;
    overlap within one plane is not found, nor penetration by less than DEPTH mm. After MOST_CROSSINGS points
    no more are sought.
    """
    normals, depth = _planes(vertices[triangles])
    level = np.einsum("mj,mj->m", normals, vertices[triangles[:, 0]])
    found = [NOWHERE]
    for part in _gathered(near_pairs(vertices[triangles])):
        for one, other in (part.T, part[:, ::-1].T):
            # Most pairs touch and go no farther: the one lies on one side of the other's plane.
            low, high = _heights(vertices, triangles, one, normals[other], level[other])
            across = (high > 0.5 * depth[other]) & (low < -0.5 * depth[other])
            one, other = one[across], other[across]
            # An edge of the one within the other means that the other reaches both sides of the one's plane.
            low, high = _heights(vertices, triangles, other, normals[one], level[one])
            across = (high > -_ROUNDING) & (low < _ROUNDING)
            one, other = one[across], other[across]
            shared = (triangles[one][:, :, None] == triangles[other][:, None, :]).sum(axis=(1, 2))
            found.append(_through(vertices, triangles, one[shared < 2], other[shared < 2]))
        if sum(map(len, found)) >= MOST_CROSSINGS:
            break
    return np.concatenate(found)[:MOST_CROSSINGS]


def _gathered(parts: Iterable[NDArray[np.int64]]) -> Iterator[NDArray[np.int64]]:
    """Pairs (p, 2) of all parts, some _PAIRS_AT_ONCE at a time."""
    waiting: list[NDArray[np.int64]] = []
    for part in parts:
        for piece in np.array_split(part, len(part) // _PAIRS_AT_ONCE + 1):
            waiting.append(piece)
            if sum(map(len, waiting)) >= _PAIRS_AT_ONCE:
                yield np.concatenate(waiting)
                waiting = []
    if waiting:
        yield np.concatenate(waiting)


def _heights(
    vertices: Vertices,
    triangles: Triangles,
    which: NDArray[np.int64],
    normals: NDArray[np.float64],
    level: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Least and greatest heights (p,) in mm of the triangles `which` (p,) above planes of unit normals (p, 3)
    whose points have the heights `level` (p,) along them."""
    low, high = np.full(len(which), np.inf), np.full(len(which), -np.inf)
    for corner in triangles[which].T:
        height = np.einsum("pj,pj->p", normals, vertices[corner]) - level
        np.maximum(high, height, out=high)
        np.minimum(low, height, out=low)
    return low, high


def near_pairs(corners: NDArray[np.float64]) -> Iterator[NDArray[np.int64]]:
    """Pairs (p, 2) of numbers of triangles, corners (m, 3, 3) in mm, whose bounding boxes overlap, each once.

    Some at a time. Found by hashing the boxes into cells of a grid, and those far larger than most into
    coarser grids.
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    if not len(corners):
        return
    origin = low.min(axis=0)
    extent = (high - low).max(axis=1)
    size = 1.5 * float(np.median(extent)) or 1.0
    # Cells are counted in whole numbers of 64 bits.
    size = max(size, float((high - origin).max()) * 2.0**-40)
    level = np.ceil(np.log2(np.maximum(extent / (_CELLS_ACROSS * size), 1.0)) / 2.0).astype(np.int64)
    for n in np.unique(level):
        here = np.flatnonzero(level <= n)
        cells = size * 4.0**n
        first = np.floor((low[here] - origin) / cells).astype(np.int64)
        last = np.floor((high[here] - origin) / cells).astype(np.int64)
        for pairs in _sharing(first, last, level[here] == n):
            a, b = here[pairs].T
            touch = ((low[a] <= high[b]) & (low[b] <= high[a])).all(axis=1)
            yield np.stack([a[touch], b[touch]], axis=1)


def _sharing(
    first: NDArray[np.int64], last: NDArray[np.int64], own: NDArray[np.bool_]
) -> Iterator[NDArray[np.int64]]:
    """Pairs (p, 2) of boxes of cells first..last (m, 3) that share a cell, each once; one is `own` (m,)."""
    owner, cell = covered(first, last)
    code = _codes(cell)
    # In a cell its own boxes come first, each before all that it is paired with.
    order = np.lexsort((~own[owner], code)) if not own.all() else np.argsort(code, kind="stable")
    owner, cell, code = owner[order], cell[order], code[order]
    begins = np.packbits(first[owner] == cell, axis=1, bitorder="little")[:, 0]
    end = np.searchsorted(code, code, side="right")
    partners = np.where(own[owner], end - 1 - np.arange(len(code)), 0)
    for part in _slices(partners):
        one, two = ranges(partners[part], np.arange(part.start, part.stop) + 1)
        one += part.start
        # A pair meets in every cell both cover; it counts in the one where their common box begins.
        once = (begins[one] | begins[two]) == 7
        yield np.stack([owner[one[once]], owner[two[once]]], axis=1)


def _codes(cell: NDArray[np.int64]) -> NDArray[np.int64]:
    """A number (c,) for each of the cells (c, 3), equal only for equal cells."""
    shape = cell.max(axis=0).astype(float) + 1.0
    if shape.prod() < 2.0**62:
        return (cell[:, 0] * int(shape[1]) + cell[:, 1]) * int(shape[2]) + cell[:, 2]
    code = np.zeros(len(cell), np.int64)
    for k in range(3):
        ranks = np.unique(cell[:, k], return_inverse=True)[1].reshape(-1)
        code = np.unique(code * (int(ranks.max()) + 1) + ranks, return_inverse=True)[1].reshape(-1)
    return code


def _planes(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit normals (m, 3) of triangles, corners (m, 3, 3), and how deep (m,) in mm one passes through them.

    The normal of a triangle without area is 0, and no edge crosses it.
    """
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(u, v)
    length = np.linalg.norm(normal, axis=1)
    normal[length < 1e-12] = 0.0
    normal /= np.maximum(length, 1e-12)[:, None]
    longest = np.maximum.reduce([np.linalg.norm(w, axis=1) for w in (u, v, v - u)])
    return normal, np.minimum(DEPTH, 1e-2 * longest)


def _through(
    vertices: Vertices, triangles: Triangles, one: NDArray[np.int64], other: NDArray[np.int64]
) -> Points:
    """Points where edges of triangles `one` (p,) go through triangles `other` (p,)."""
    origin, second, third = np.moveaxis(vertices[triangles[other]], 1, 0)
    u, v = second - origin, third - origin
    normal, depth = _planes(vertices[triangles[other]])
    corners = vertices[triangles[one]] - origin[:, None, :]
    height = np.einsum("pij,pj->pi", corners, normal)
    found = []
    for k in range(3):
        n = (k + 1) % 3
        ends = triangles[one][:, [k, n]]
        common = (ends[:, :, None] == triangles[other][:, None, :]).any(axis=(1, 2))
        a, b = height[:, k], height[:, n]
        across = (a * b < 0.0) & (np.minimum(np.abs(a), np.abs(b)) > depth) & ~common
        i = np.flatnonzero(across)
        t = (a[i] / (a[i] - b[i]))[:, None]
        point = corners[i, k] + t * (corners[i, n] - corners[i, k])
        # Barycentric shares, each at least `depth` away from its edge.
        inside = np.ones(len(i), bool)
        loop = (np.zeros_like(u[i]), u[i], v[i])
        for j in range(3):
            side = loop[(j + 1) % 3] - loop[j]
            off = np.einsum("pi,pi->p", np.cross(side, point - loop[j]), normal[i])
            inside &= off / np.maximum(np.linalg.norm(side, axis=1), 1e-12) > depth[i]
        found.append((point + origin[i])[inside])
    return np.concatenate(found)


def covered(first: NDArray[np.int64], last: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Every cell (c, 3) of boxes first..last (m, 3), and the number (c,) of its box."""
    span = last - first + 1
    count = span.prod(axis=1)
    owner, k = ranges(count)
    sx, sy = span[owner, 0], span[owner, 1]
    cell = first[owner] + np.stack([k % sx, k // sx % sy, k // (sx * sy)], axis=1)
    return owner, cell


def _slices(count: NDArray[np.int64]) -> list[slice]:
    """Consecutive slices whose counts add up to about _AT_ONCE at most."""
    part = np.cumsum(count) // _AT_ONCE
    cuts = [0, *(np.flatnonzero(np.diff(part)) + 1).tolist(), len(count)]
    return [slice(a, b) for a, b in pairwise(cuts)]
