"""Repair of a triangle surface where there is only one way: doubled and flipped faces, tiny gaps.

Ambiguous faults, such as a larger hole, a self-intersection or an edge of three faces, are left and reported.
Every change is counted and measured.
"""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from ...arrays import connected
from ..surface import Triangles, Vertices, bad_edges, volume
from . import faces
from .crossing import MOST_CROSSINGS, crossings

GAP_MM = 0.02
"""Vertices of open edges this close are merged: a fifth of a layer, less than a printer resolves."""

MOST_NEAR = 50_000_000
"""Limit on pairs of vertices of open edges within a gap's width; with more, as in dust, no gap is closed."""

MOST_IN_GROUP = 1000
"""Limit on vertices of open edges merged into one: at a gap's end there are a few."""


@attrs.frozen
class Change:
    """One kind of change, and how often it was made."""

    what: str
    count: int


@attrs.frozen(eq=False)
class Repair:
    """A repaired surface, vertices (n, 3) in mm and triangles (m, 3), and its changes.

    largest_move_mm: of a vertex. volume_before_mm3, volume_after_mm3: sums over the triangles, no volumes for
    an open or flipped surface. remains: faults with more than one remedy, which are left.
    """

    vertices: Vertices
    triangles: Triangles
    changes: list[Change]
    largest_move_mm: float
    volume_before_mm3: float
    volume_after_mm3: float
    remains: list[str]

    @property
    def is_whole(self) -> bool:
        """True if no fault remains."""
        return not self.remains

    def plain(self) -> dict[str, Any]:
        """Its figures by name, for a file."""
        return attrs.asdict(self, filter=attrs.filters.exclude("vertices", "triangles"))

    def lines(self) -> list[str]:
        """Repairs done and faults left, a sentence each."""
        lines = [f"{change.count} {change.what}" for change in self.changes] or ["nothing was changed"]
        before, after = self.volume_before_mm3, self.volume_after_mm3
        lines.append(
            f"volume {before:.6g} mm3 before and {after:.6g} mm3 after; no vertex moved by more than "
            f"{self.largest_move_mm:.2g} mm"
        )
        return lines + [f"remains: {what}" for what in self.remains]


def repaired(vertices: Vertices, triangles: Triangles, gap_mm: float = GAP_MM) -> Repair:
    """Repair of a surface of vertices (n, 3) in mm and triangles (m, 3), where there is only one way to.

    gap_mm: largest distance of vertices of open edges that become one. In this order: remove triangles
    without three corners, close gaps, remove doubled triangles, fill holes of one triangle, flip patches
    oriented against their neighbours, flip shells that are inside out.
    """
    before = volume(vertices, triangles)
    changes: list[Change] = []

    def note(what: str, count: int) -> None:
        if count:
            changes.append(Change(what, count))

    vertices, index, merged = _merged(vertices, np.arange(len(vertices)))
    triangles = index[triangles]
    note("vertices at the same place as others were merged", merged)
    triangles, flat = _without_flat(triangles)
    note("triangles of fewer than three corners were removed", flat)
    triangles, doubled = _without_doubled(triangles)
    note("doubled triangles were removed", doubled)
    points, index, closed, move = _closed_gaps(vertices, triangles, gap_mm)
    if closed:
        vertices, triangles = points, index[triangles]
        note(f"vertices of open edges were merged with others within {gap_mm:g} mm", closed)
        triangles, flat = _without_flat(triangles)
        note("triangles that collapsed in a gap were removed", flat)
        triangles, doubled = _without_doubled(triangles)
        note("triangles that then lay on others were removed", doubled)
    filled = _single_holes(triangles)
    note("holes of one triangle were filled", len(filled))
    triangles = np.concatenate([triangles, filled])
    turned = faces.turned(vertices, triangles)
    note("flipped triangles were turned", int(turned.sum()))
    triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
    if not bad_edges(triangles):
        over = _inside_out(vertices, triangles)
        for members in over:
            triangles[members] = triangles[members][:, ::-1]
        note("shells that were inside out were turned", len(over))
    used, index = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used], np.ravel(index).reshape(-1, 3)
    return Repair(
        vertices,
        triangles,
        changes,
        move,
        before,
        volume(vertices, triangles),
        _remaining(vertices, triangles),
    )


def _merged(vertices: Vertices, names: NDArray[np.int64]) -> tuple[Vertices, NDArray[np.int64], int]:
    """Distinct vertices (k, 3), the number there of each given one (n,), and how many were merged."""
    distinct, index = np.unique(vertices, axis=0, return_inverse=True)
    return distinct, np.ravel(index)[names], len(vertices) - len(distinct)


def _without_flat(triangles: Triangles) -> tuple[Triangles, int]:
    whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return triangles[whole], int((~whole).sum())


def _without_doubled(triangles: Triangles) -> tuple[Triangles, int]:
    """Triangles without doubled ones: one of a set or none, whichever closes the surface, else all."""
    key = np.sort(triangles, axis=1)
    _, group, count = np.unique(key, axis=0, return_inverse=True, return_counts=True)
    group = np.ravel(group)
    several = count[group] > 1
    if not several.any():
        return triangles, 0
    e = faces.edges(triangles)
    m = len(triangles)
    # How many triangles of no such set each edge has.
    others = np.bincount(e.of_side, np.tile(~several, 3), len(e.ends))
    kept = np.ones(m, bool)
    for members in faces.members_of(group):
        if len(members) == 1:
            continue
        beside = others[e.of_side[members[0] + m * np.arange(3)]]
        if (beside == 2).all():
            kept[members] = False
        elif (beside <= 1).all():
            kept[members[1:]] = False
    return triangles[kept], int((~kept).sum())


def _closed_gaps(
    vertices: Vertices, triangles: Triangles, gap_mm: float
) -> tuple[Vertices, NDArray[np.int64], int, float]:
    """Merge vertices of open edges across gaps: vertices, new number of each, number merged, largest move.

    A group of vertices wider than the gap is left: the pairs to merge are ambiguous. So are the ends of one
    edge: merging them would remove a face without closing a gap.
    """
    from scipy.spatial import cKDTree

    index = np.arange(len(vertices))
    e = faces.edges(triangles)
    rim = np.unique(e.ends[np.bincount(e.of_side) == 1])
    if not len(rim):
        return vertices, index, 0, 0.0
    # Counted before they are listed, which may take more memory than there is: first those within a cube of
    # half that size, at once, then all.
    cells = np.floor((vertices[rim] - vertices[rim].min(axis=0)) / (0.5 * gap_mm))
    together = np.unique(cells, axis=0, return_counts=True)[1].astype(float)
    tree = cKDTree(vertices[rim])
    if (together**2).sum() > MOST_NEAR or tree.count_neighbors(tree, gap_mm) > MOST_NEAR:
        return vertices, index, 0, 0.0
    pairs = tree.query_pairs(gap_mm, output_type="ndarray")
    if not len(pairs):
        return vertices, index, 0, 0.0
    group = connected(len(rim), *pairs.T)
    linked = {tuple(pair) for pair in e.ends.tolist()}
    points = vertices.copy()
    merged, move = 0, 0.0
    for one in faces.members_of(group):
        members = rim[one]
        here = vertices[members]
        if len(one) == 1 or len(one) > MOST_IN_GROUP or np.ptp(here, axis=0).max() > gap_mm:
            continue
        wide = float(np.linalg.norm(here[:, None] - here[None], axis=2).max())
        joined = any((a, b) in linked for a in members.tolist() for b in members.tolist() if a < b)
        if wide > gap_mm or joined:
            continue
        middle = here.mean(axis=0)
        move = max(move, float(np.linalg.norm(here - middle, axis=1).max()))
        points[members[0]] = middle
        index[members] = members[0]
        merged += len(members) - 1
    return points, index, merged, move


def _single_holes(triangles: Triangles) -> Triangles:
    """Triangles (k, 3) that fill the holes which three open edges bound, turned like their neighbours."""
    e = faces.edges(triangles)
    count = np.bincount(e.of_side)
    m = len(triangles)
    is_open = count[e.of_side] == 1
    # A triangle on its own is not a hole, though three open edges bound it.
    open_sides = np.flatnonzero(is_open & ~np.tile(is_open.reshape(3, m).all(axis=0), 3))
    a = triangles[open_sides % m, open_sides // m]
    b = triangles[open_sides % m, (open_sides // m + 1) % 3]
    onward: dict[int, list[int]] = {}
    # A new face runs along its neighbours' edges the other way.
    for start, end in zip(b.tolist(), a.tolist(), strict=True):
        onward.setdefault(start, []).append(end)
    found = set()
    for first, ends in onward.items():
        if len(ends) != 1 or len(onward.get(ends[0], [])) != 1:
            continue
        second = ends[0]
        third = onward[second][0]
        if third != first and onward.get(third) == [first]:
            loop = (first, second, third)
            k = loop.index(min(loop))
            found.add(loop[k:] + loop[:k])
    return np.array(sorted(found), np.int64).reshape(-1, 3)


def _inside_out(vertices: Vertices, triangles: Triangles) -> list[NDArray[np.int64]]:
    """Triangles of each shell of a closed surface that must turn: the outer ones that face inward, or all.

    A shell within another may be a void or a separate solid. It is flipped only if every shell is, as in a
    file that is inside out.
    """
    found = faces.pieces(vertices, triangles)
    shells = [*found.bodies, *found.voids, *found.nested, *found.inside_out]
    if not found.inside_out or len(shells) > faces.MOST_SHELLS:
        return []
    around = faces.Surroundings(vertices, triangles, shells)
    deep = [sum(abs(turns) > 0.5 for turns in around.turns(number)) for number in range(len(shells))]
    wrong = [(shell.volume < 0.0) != bool(depth % 2) for shell, depth in zip(shells, deep, strict=True)]
    every = all(wrong)
    return [
        shell.triangles
        for shell, depth, bad in zip(shells, deep, wrong, strict=True)
        if bad and (every or depth == 0)
    ]


def _remaining(vertices: Vertices, triangles: Triangles) -> list[str]:
    """Faults of a surface that have more than one remedy."""
    e = faces.edges(triangles)
    count = np.bincount(e.of_side)
    agree = np.bincount(e.of_side, np.where(e.forward, 1, -1)) != 0
    found = []
    if holes := int((count == 1).sum()):
        found.append(f"{holes} open edges, of holes of more than one triangle: fill them by hand")
    if crowded := int((count > 2).sum()):
        found.append(f"{crowded} edges of more than two faces: remove inner faces, or unite the parts")
    if against := int((agree & (count == 2)).sum()):
        found.append(
            f"{against} edges whose faces cannot all be turned the same way: the surface has one side"
        )
    if cut := len(crossings(vertices, triangles)):
        more = " or more" if cut == MOST_CROSSINGS else ""
        found.append(f"{cut}{more} edges that pass through other triangles: unite the parts")
    if not len(triangles):
        found.append("no triangle")
    return found
