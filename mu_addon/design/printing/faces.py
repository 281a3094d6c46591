"""Faults of a triangle surface: open edges, doubled or flipped faces, loose pieces, sealed voids."""

from __future__ import annotations

from typing import Any, NamedTuple

import attrs
import numpy as np
from numpy.typing import NDArray

from ...arrays import connected
from ..surface import Triangles, Vertices, winding_number
from .finding import NOWHERE, Points

MOST_SHELLS = 400
"""Number of shells beyond which only the largest are examined one by one."""


class Edges(NamedTuple):
    """Edges of triangles (m, 3): their ends (e, 2), and of each side its edge and its direction, (3 m,) each.

    Side k of triangle t is number k m + t and runs from corner k to the next; forward: from the lower to the
    higher vertex number.
    """

    ends: NDArray[np.int64]
    of_side: NDArray[np.int64]
    forward: NDArray[np.bool_]


@attrs.frozen(eq=False)
class Shell:
    """A closed connected part of a surface: its triangles (k,), volume in mm3 and centroid (3,) in mm.

    The triangles are given by number; the volume is negative for a surface that faces inward.
    """

    triangles: NDArray[np.int64]
    volume: float
    centroid: Points


@attrs.frozen(eq=False)
class Pieces:
    """Shells by kind, the largest first: solid bodies, sealed voids, solids within solids, inside out."""

    bodies: list[Shell]
    voids: list[Shell]
    nested: list[Shell]
    inside_out: list[Shell]


def edges(triangles: Triangles) -> Edges:
    """Edges of triangles (m, 3), each once, and the edge of every side."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forward = sides[:, 0] < sides[:, 1]
    low, high = sides.min(axis=1), sides.max(axis=1)
    span = int(high.max(initial=0)) + 1
    code, of_side = np.unique(low * span + high, return_inverse=True)
    return Edges(np.stack([code // span, code % span], axis=1), np.ravel(of_side), forward)


def doubled(triangles: Triangles) -> NDArray[np.bool_]:
    """Mask of triangles (m, 3) with the same three corners as an earlier one, in any order; (m,)."""
    key = np.sort(triangles, axis=1)
    order = np.lexsort(key.T[::-1])
    same = np.zeros(len(key), bool)
    same[order[1:]] = (key[order[1:]] == key[order[:-1]]).all(axis=1)
    return same


def open_places(vertices: Vertices, triangles: Triangles) -> tuple[Points, int]:
    """Middles (k, 3) in mm of a surface's holes, the largest first, and the number of open edges.

    vertices (n, 3) in mm, triangles (m, 3). An edge is open unless exactly two triangles share it; a hole is
    a connected set of open edges.
    """
    e = edges(triangles)
    ends = e.ends[np.bincount(e.of_side) != 2]
    if not len(ends):
        return NOWHERE, 0
    used, index = np.unique(ends, return_inverse=True)
    a, b = index.reshape(-1, 2).T
    label = connected(len(used), a, b)[a]
    length = np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)
    middle = vertices[ends].mean(axis=1)
    around = np.bincount(label, length)
    places = np.stack([np.bincount(label, length * middle[:, k]) / around for k in range(3)], axis=1)
    return places[np.argsort(-around, kind="stable")], len(ends)


def turned(vertices: Vertices, triangles: Triangles) -> NDArray[np.bool_]:
    """Mask of triangles (m, 3) that face against the larger part, by area in mm2, of their surface; (m,).

    vertices (n, 3) in mm. Two triangles are joined if they alone share an edge.
    """
    m = len(triangles)
    e = edges(triangles)
    order = np.argsort(e.of_side, kind="stable")
    count = np.bincount(e.of_side)
    start = np.cumsum(count) - count
    pairs = start[count == 2]
    first, second = order[pairs], order[pairs + 1]
    agree = e.forward[first] != e.forward[second]
    wrong = np.zeros(m, bool)
    if agree.all():
        return wrong
    a, b = first % m, second % m
    patch = connected(m, a[agree], b[agree])
    area = np.linalg.norm(_area_vectors(vertices, triangles), axis=1)
    size = np.bincount(patch, area)
    links = _graph(patch[a[~agree]], patch[b[~agree]], len(size))
    return np.asarray(_against_the_larger(links, size)[patch])


def _against_the_larger(links: Any, size: NDArray[Any]) -> NDArray[np.bool_]:
    """Mask of patches (n,) that are oriented against the larger part, by size (n,), of the linked ones.

    links: between patches that face each other's way, as a sparse matrix (n, n).
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order

    n = len(size)
    links = coo_matrix(links + links.T)
    group = connected(n, links.row, links.col)
    # The largest patch of each group, and one walk through all of them from a node that is linked to these.
    largest_last = np.lexsort((-np.arange(n), size, group))
    roots = largest_last[np.cumsum(np.bincount(group)) - 1]
    starts, ends = np.concatenate([links.row, np.full(len(roots), n)]), np.concatenate([links.col, roots])
    walk, before = breadth_first_order(_graph(starts, ends, n + 1), n)
    against = [True] * (n + 1)
    for node, last in zip(walk[1:].tolist(), before[walk[1:]].tolist(), strict=True):
        against[node] = not against[last]
    parity = np.array(against[:n])
    swap = np.bincount(group, size * parity) > 0.5 * np.bincount(group, size)
    return np.asarray(parity ^ swap[group])


def pieces(vertices: Vertices, triangles: Triangles) -> Pieces:
    """The shells of a closed, oriented surface of vertices (n, 3) in mm and triangles (m, 3), by kind.

    The kind follows from the sign of a shell's volume and from whether the other shells enclose it, by the
    winding number; beyond the MOST_SHELLS largest, shells count as not enclosed.
    """
    m = len(triangles)
    e = edges(triangles)
    order = np.argsort(e.of_side, kind="stable") % m
    same = e.of_side[np.argsort(e.of_side, kind="stable")]
    linked = same[1:] == same[:-1]
    label = connected(m, order[1:][linked], order[:-1][linked])
    shells = _shells(vertices, triangles, label)
    shells.sort(key=lambda shell: -abs(shell.volume))
    around = Surroundings(vertices, triangles, shells)
    found = Pieces([], [], [], [])
    for number, shell in enumerate(shells):
        if number == 0 and shell.volume > 0.0:
            found.bodies.append(shell)
            continue
        turns = sum(around.turns(number)) if number < MOST_SHELLS else 0.0
        if shell.volume < 0.0:
            (found.voids if turns > 0.5 else found.inside_out).append(shell)
        else:
            (found.nested if turns > 0.5 else found.bodies).append(shell)
    return found


class Surroundings:
    """The closed shells around each of some shells of a surface; those whose box does not hold it are not."""

    def __init__(self, vertices: Vertices, triangles: Triangles, shells: list[Shell]) -> None:
        self._vertices, self._triangles, self._shells = vertices, triangles, shells
        self._at = np.array([vertices[triangles[s.triangles[0]]].mean(axis=0) for s in shells]).reshape(-1, 3)
        self._low, self._high = np.empty_like(self._at), np.empty_like(self._at)
        if shells:
            begins = np.cumsum([0, *(len(s.triangles) for s in shells[:-1])])
            corners = vertices[triangles[np.concatenate([s.triangles for s in shells])]]
            self._low = np.minimum.reduceat(corners.min(axis=1), begins)
            self._high = np.maximum.reduceat(corners.max(axis=1), begins)

    def turns(self, number: int) -> list[float]:
        """Winding numbers, around a point of the shell of that number, of the others that may hold it."""
        at = self._at[number]
        holds = ((self._low <= at) & (at <= self._high)).all(axis=1)
        holds[number] = False
        others = (self._shells[k].triangles for k in np.flatnonzero(holds))
        return [
            float(winding_number(self._vertices, self._triangles[members], at[None])[0]) for members in others
        ]


def _shells(vertices: Vertices, triangles: Triangles, label: NDArray[np.integer]) -> list[Shell]:
    """The shells of a surface, from the triangles' labels (m,), 0 and up."""
    members = members_of(label)
    p, q, r = (vertices[corner] for corner in triangles.T)
    # Volumes of tetrahedra over a point of the shell, not over a far origin: small shells keep their digits.
    base = p[[part[0] for part in members]]
    of = base[label]
    share = np.einsum("ij,ij->i", p - of, np.cross(q - of, r - of)) / 6.0
    volumes = np.bincount(label, share)
    moments = [np.bincount(label, share * (p + q + r - 3.0 * of)[:, k]) for k in range(3)]
    middles = [np.bincount(label, (p + q + r)[:, k]) / (3.0 * np.bincount(label)) for k in range(3)]
    flat = np.abs(volumes) <= 1e-12
    centroids = base + np.stack(moments, axis=1) / np.where(flat, 1.0, 4.0 * volumes)[:, None]
    centroids[flat] = np.stack(middles, axis=1)[flat]
    return [Shell(*shell) for shell in zip(members, volumes.tolist(), centroids, strict=True)]


def members_of(label: NDArray[np.integer]) -> list[NDArray[np.int64]]:
    """Members (k,) of each label, of labels (m,) from 0 on."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.cumsum(np.bincount(label))[:-1])


def _graph(a: NDArray[np.int64], b: NDArray[np.int64], n: int) -> Any:
    """Links a (k,) to b (k,) among n as a sparse matrix."""
    from scipy.sparse import coo_matrix

    return coo_matrix((np.ones(len(a)), (a, b)), shape=(n, n)).tocsr()


def _area_vectors(vertices: Vertices, triangles: Triangles) -> Points:
    p, q, r = vertices[triangles.T]
    return np.asarray(0.5 * np.cross(q - p, r - p))
