"""Isotropic remeshing of a closed surface: triangles of one size that keep its shape and its sharp edges.

Edges are split, collapsed and flipped and vertices moved along the surface until all are about as long as
asked for: Botsch and Kobbelt, A remeshing approach to multiresolution modeling, Symp. Geometry Processing
(2004) 185. Here every pass changes all places that do not touch each other at once, in an order that depends
on lengths and numbers alone, so that the same surface always gets the same mesh.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
from scipy.sparse import coo_matrix
from scipy.spatial import cKDTree

Array = np.ndarray[Any, Any]

SHARP_DEG = 50.0
"""Edges whose faces turn by more are sharp and kept. Facets of round parts must turn by less."""

# Longest and shortest edge, as shares of the target: of two halves of a long edge none is short, and the
# longest made by collapsing short ones is not long.
_LONG, _SHORT = 4 / 3, 4 / 5
# Candidates for the nearest facet, by the distance of their centres.
_NEAREST = 16
# A share of all edges that is left for the next round.
_FEW = 1e-3
# Triangles of a better shape (`_shape`) are not flipped, nor any for a smaller gain.
_FAIR, _GAIN = 0.9, 0.01
# A vertex with two sharp edges that turn by more is a corner.
_CORNER_DEG = 50.0


@attrs.frozen(eq=False)
class Reference:
    """The shape to keep to: small facets and the segments of its sharp edges.

    corners (f, 3, 3) and segments (s, 2, 3), in mm; both of about one size, since the nearest are looked
    for by their centres.
    """

    corners: Array
    segments: Array

    @classmethod
    def of(cls, vertices: Array, triangles: Array, sharp_deg: float = SHARP_DEG) -> Reference:
        """Of a closed surface, vertices (n, 3) in mm and triangles (f, 3)."""
        ends, faces = _edges(triangles)[:2]
        sharp = _turns(vertices, triangles, faces) > np.radians(sharp_deg)
        return cls(vertices[triangles], vertices[ends[sharp]])

    def on_surface(self, points: Array) -> Array:
        """Nearest points (p, 3) of the surface."""
        return _nearest(points, self.corners, closest_on_triangles)

    def on_sharp(self, points: Array) -> Array:
        """Nearest points (p, 3) of the sharp edges."""
        return _nearest(points, self.segments, _closest_on_segments)


@attrs.define(eq=False)
class _Surface:
    """A closed surface that is being remeshed.

    vertices (n, 3), triangles (f, 3); sharp: keys of sharp edges, ascending; fixed (n,): corners.
    """

    vertices: Array
    triangles: Array
    sharp: Array
    fixed: Array

    def sharp_at(self, ends: Array) -> Array:
        """Whether edges (e, 2) are sharp, (e,)."""
        return _contains(self.sharp, _keys(ends))

    def on_sharp(self) -> Array:
        """Whether a vertex lies on a sharp edge, (n,)."""
        result = np.zeros(len(self.vertices), bool)
        result[_ends(self.sharp)] = True
        return result


def remesh(
    vertices: Array, triangles: Array, edge_mm: float, reference: Reference, rounds: int = 6
) -> tuple[Array, Array]:
    """Triangles with edges of about `edge_mm` in place of a closed surface's: vertices (n, 3), triangles.

    vertices (n, 3) in mm and triangles (f, 3), facing outward; reference: the shape that vertices are moved
    onto, at least as fine. Sharp edges (`SHARP_DEG`) and their corners stay; each of `rounds` splits,
    collapses, flips and moves.
    """
    surface = _begin(vertices, triangles)
    for _ in range(rounds):
        _split(surface, _LONG * edge_mm)
        _collapse(surface, _SHORT * edge_mm, _LONG * edge_mm)
        _flip(surface)
        _relax(surface, reference)
    _flip(surface)
    used, dense = np.unique(surface.triangles, return_inverse=True)
    return surface.vertices[used], np.reshape(dense, (-1, 3))


def _begin(vertices: Array, triangles: Array) -> _Surface:
    ends, faces, _ = _edges(triangles)
    sharp = _turns(vertices, triangles, faces) > np.radians(SHARP_DEG)
    lines = ends[sharp]
    count = np.bincount(lines.ravel(), minlength=len(vertices))
    fixed = (count > 0) & (count != 2)
    along = vertices[lines[:, 1]] - vertices[lines[:, 0]]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # Directions away from a vertex: straight on they cancel, at a corner they do not.
    total = np.zeros_like(vertices)
    np.add.at(total, lines[:, 0], along)
    np.add.at(total, lines[:, 1], -along)
    fixed |= (count == 2) & (np.linalg.norm(total, axis=1) > 2 * np.sin(np.radians(_CORNER_DEG) / 2))
    return _Surface(vertices.copy(), triangles.astype(np.int64), np.sort(_keys(lines)), fixed)


def _split(s: _Surface, longest: float) -> None:
    """Halve edges longer than `longest` mm, the longest of its two triangles first."""
    while True:
        ends, faces, of_side = _edges(s.triangles)
        length = np.linalg.norm(s.vertices[ends[:, 0]] - s.vertices[ends[:, 1]], axis=1)
        rank = _ranks(-length)
        first = rank[of_side].min(axis=1)
        chosen = (length > longest) & (first[faces] == rank[:, None]).all(axis=1)
        if not chosen.any():
            return
        number = np.full(len(ends), -1)
        number[chosen] = len(s.vertices) + np.arange(np.count_nonzero(chosen))
        was_sharp = s.sharp_at(ends) & chosen
        face, side = np.nonzero(number[of_side] >= 0)
        middle = number[of_side[face, side]]
        a, b, c = (s.triangles[face, (side + k) % 3] for k in range(3))
        s.triangles[face] = np.stack([a, middle, c], axis=1)
        s.triangles = np.vstack([s.triangles, np.stack([middle, b, c], axis=1)])
        s.vertices = np.vstack([s.vertices, s.vertices[ends[chosen]].mean(axis=1)])
        s.fixed = np.append(s.fixed, np.zeros(np.count_nonzero(chosen), bool))
        kept = s.sharp[~_contains(np.sort(_keys(ends[was_sharp])), s.sharp)]
        halves = [np.stack([ends[was_sharp, k], number[was_sharp]], axis=1) for k in range(2)]
        s.sharp = np.sort(np.concatenate([kept, *(_keys(half) for half in halves)]))


def _collapse(s: _Surface, shortest: float, longest: float) -> None:
    """Pull the ends of edges shorter than `shortest` mm together, where no edge beyond `longest` results."""
    refused = np.zeros(0, np.int64)
    while True:
        ends, _, _ = _edges(s.triangles)
        length = np.linalg.norm(s.vertices[ends[:, 0]] - s.vertices[ends[:, 1]], axis=1)
        keys = _keys(ends)
        on_sharp = s.on_sharp()
        # A vertex may go where it keeps its sharp edge: a corner nowhere, one on an edge along that.
        is_sharp = s.sharp_at(ends)
        may = [~s.fixed[ends[:, k]] & (~on_sharp[ends[:, k]] | is_sharp) for k in range(2)]
        short = (length < shortest) & (may[0] | may[1]) & ~_contains(refused, keys)
        if np.count_nonzero(short) <= _FEW * len(ends):
            return
        # The one on fewer sharp things goes; of equals the one of the higher number.
        bound = on_sharp.astype(int) + s.fixed
        second_goes = may[1] & (~may[0] | (bound[ends[:, 1]] <= bound[ends[:, 0]]))
        gone = np.where(second_goes, ends[:, 1], ends[:, 0])
        kept = np.where(second_goes, ends[:, 0], ends[:, 1])
        chosen = np.flatnonzero(short)[_apart(ends[short], ends, len(s.vertices))]
        allowed = _may_collapse(s, ends, gone[chosen], kept[chosen], longest)
        refused = np.sort(np.concatenate([refused, keys[chosen[~allowed]]]))
        chosen = chosen[allowed]
        if not len(chosen):
            continue
        onto = np.arange(len(s.vertices))
        onto[gone[chosen]] = kept[chosen]
        triangles = onto[s.triangles]
        s.triangles = triangles[
            (triangles[:, 0] != triangles[:, 1])
            & (triangles[:, 1] != triangles[:, 2])
            & (triangles[:, 2] != triangles[:, 0])
        ]
        lines = onto[_ends(s.sharp)]
        s.sharp = np.unique(_keys(lines[lines[:, 0] != lines[:, 1]]))


def _apart(edges: Array, ends: Array, count: int) -> Array:
    """Numbers of edges (k, 2), of which no two have neighbours in common.

    Shuffled, so that many are found at once: by length, long rows of edges would wait for each other.
    """
    rank = _ranks(_keys(edges).astype(np.uint64) * _SHUFFLE)
    least = np.full(count, len(edges))
    for k in range(2):
        np.minimum.at(least, edges[:, k], rank)
    for _ in range(2):
        wider = least.copy()
        np.minimum.at(wider, ends[:, 0], least[ends[:, 1]])
        np.minimum.at(wider, ends[:, 1], least[ends[:, 0]])
        least = wider
    return np.flatnonzero((least[edges] == rank[:, None]).all(axis=1))


def _may_collapse(s: _Surface, ends: Array, gone: Array, kept: Array, longest: float) -> Array:
    """Whether vertices `gone` (k,) may be drawn onto their neighbours `kept` (k,)."""
    n = len(s.vertices)
    both = np.vstack([ends, ends[:, ::-1]])
    near = coo_matrix((np.ones(len(both)), (both[:, 0], both[:, 1])), (n, n)).tocsr()
    # Two common neighbours: else the surface would pinch.
    allowed = np.asarray(near[gone].multiply(near[kept]).sum(axis=1)).ravel() == 2
    # Every collapse is apart from the others, so a vertex or triangle belongs to one at most.
    which = np.full(n, -1)
    which[gone] = np.arange(len(gone))
    moving = which[both[:, 0]] >= 0
    own, other = which[both[moving, 0]], both[moving, 1]
    far = np.linalg.norm(s.vertices[other] - s.vertices[kept[own]], axis=1) > longest
    allowed[own[far]] = False
    own = which[s.triangles].max(axis=1)
    around = (own >= 0) & (s.triangles != kept[own][:, None]).all(axis=1)
    before = s.vertices[s.triangles[around]]
    after = np.where(
        (which[s.triangles[around]] >= 0)[:, :, None], s.vertices[kept[own[around]]][:, None], before
    )
    allowed[own[around][_spoiled(before, after)]] = False
    return allowed


def _spoiled(before: Array, after: Array) -> Array:
    """Whether triangles (t, 3, 3) turn over or become slivers that they were not, (t,)."""
    old, new = _normals(before), _normals(after)
    turned = np.einsum("td,td->t", old, new) < 0.5 * _length(old) * _length(new)
    worse = (_shape(after) < 0.2) & (_shape(after) < _shape(before))
    return np.asarray(turned | worse)


def _flip(s: _Surface) -> None:
    """Exchange the diagonal of two triangles where that opens their smallest angle, edge after edge."""
    while True:
        ends, faces, of_side = _edges(s.triangles)
        x, shape = s.vertices, _shape(s.vertices[s.triangles])
        worst = shape[faces].min(axis=1)
        poor = np.flatnonzero((worst < _FAIR) & ~s.sharp_at(ends))
        side = np.argmax(of_side[faces[poor]] == poor[:, None, None], axis=2)
        c, d = s.triangles[faces[poor], (side + 2) % 3].T
        a, b = (s.triangles[faces[poor, 0], (side[:, 0] + k) % 3] for k in range(2))
        pair = [np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)]
        new = [x[triangle] for triangle in pair]
        gain = np.minimum(*map(_shape, new)) - worst[poor]
        way = _normals(x[s.triangles[faces[poor]]].reshape(-1, 3, 3)).reshape(-1, 2, 3).sum(axis=1)
        could = (gain > _GAIN) & ~_contains(_keys(ends), _keys(np.stack([c, d], axis=1)))
        for normal in map(_normals, new):
            could &= np.einsum("ed,ed->e", way, normal) > 0.8 * _length(way) * _length(normal)
        if np.count_nonzero(could) <= _FEW * len(ends):
            return
        rank = np.full(len(ends), len(ends))
        rank[poor[could]] = _ranks(-gain[could])
        # Neither of its triangles nor their neighbours change otherwise.
        first = rank[of_side].min(axis=1)
        wide = first[faces[of_side]].reshape(len(first), 6).min(axis=1)
        chosen = could & (wide[faces[poor]] == rank[poor][:, None]).all(axis=1)
        for k in range(2):
            s.triangles[faces[poor[chosen], k]] = pair[k][chosen]


def _relax(s: _Surface, reference: Reference) -> None:
    """Move vertices to the middle of their neighbours, along the surface or along their sharp edge."""
    ends, _, _ = _edges(s.triangles)
    on_sharp = s.on_sharp()
    target = s.vertices.copy()
    inside = np.zeros(len(target), bool)
    inside[s.triangles] = True
    smooth = inside & ~on_sharp & ~s.fixed
    normal = np.zeros_like(target)
    for k in range(3):
        np.add.at(normal, s.triangles[:, k], _normals(s.vertices[s.triangles]))
    normal /= np.maximum(_length(normal), 1e-30)[:, None]
    step = _middles(ends, s.vertices) - s.vertices
    step -= (step * normal).sum(axis=1, keepdims=True) * normal
    target[smooth] = reference.on_surface((s.vertices + step)[smooth])
    line = on_sharp & ~s.fixed & inside
    if line.any():
        target[line] = reference.on_sharp(_middles(_ends(s.sharp), s.vertices)[line])
    for _ in range(10):
        before, after = s.vertices[s.triangles], target[s.triangles]
        bad = np.unique(s.triangles[_spoiled(before, after)])
        if not (target[bad] != s.vertices[bad]).any():
            break
        target[bad] = s.vertices[bad]
    else:
        return
    s.vertices = target


def _middles(ends: Array, vertices: Array) -> Array:
    """Mean (n, 3) of each vertex's neighbours along edges (e, 2); its own place without any."""
    total, count = np.zeros_like(vertices), np.bincount(ends.ravel(), minlength=len(vertices))
    np.add.at(total, ends[:, 0], vertices[ends[:, 1]])
    np.add.at(total, ends[:, 1], vertices[ends[:, 0]])
    return np.where(count[:, None] > 0, total / np.maximum(count, 1)[:, None], vertices)


def _edges(triangles: Array) -> tuple[Array, Array, Array]:
    """Edges (e, 2) of a closed surface, ascending; their two triangles (e, 2); of each triangle's sides."""
    directed = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    keys, of_side = np.unique(_keys(directed), return_inverse=True)
    order = np.argsort(of_side, kind="stable")
    return _ends(keys), (order // 3).reshape(-1, 2), of_side.reshape(-1, 3)


_BASE = np.int64(1) << 31
# An odd number with no pattern in its bits: Knuth's 2^64 over the golden ratio.
_SHUFFLE = np.uint64(0x9E3779B97F4A7C15)


def _keys(ends: Array) -> Array:
    low, high = ends.min(axis=1).astype(np.int64), ends.max(axis=1).astype(np.int64)
    return low * _BASE + high


def _ends(keys: Array) -> Array:
    return np.stack([keys // _BASE, keys % _BASE], axis=1)


def _contains(ascending: Array, keys: Array) -> Array:
    """Whether keys (k,) are among those, (k,)."""
    if not len(ascending):
        return np.zeros(len(keys), bool)
    place = np.minimum(np.searchsorted(ascending, keys), len(ascending) - 1)
    return np.asarray(ascending[place] == keys)


def _ranks(values: Array) -> Array:
    """Place of each of values (k,) in their order, by number where they are equal."""
    result = np.empty(len(values), np.int64)
    result[np.argsort(values, kind="stable")] = np.arange(len(values))
    return result


def _turns(vertices: Array, triangles: Array, faces: Array) -> Array:
    """Angle in radians between the normals of two triangles (e, 2)."""
    normal = _normals(vertices[triangles])
    one, two = (normal[faces[:, k]] for k in range(2))
    sine = np.linalg.norm(np.cross(one, two), axis=1)
    return np.asarray(np.arctan2(sine, (one * two).sum(axis=1)))


def _normals(corners: Array) -> Array:
    """Normals (t, 3) of triangles (t, 3, 3), twice their area long."""
    # numpy's own cross takes three times as long.
    (ax, ay, az), (bx, by, bz) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _length(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def _shape(corners: Array) -> Array:
    """Area over the sum of squared sides, 1 for an equilateral triangle, 0 for a sliver; (t, 3, 3)."""
    sides = corners - np.roll(corners, 1, axis=1)
    square = (sides**2).sum(axis=(1, 2))
    return np.asarray(2 * np.sqrt(3) * _length(_normals(corners)) / np.maximum(square, 1e-30))


def _nearest(points: Array, shapes: Array, closest: Callable[[Array, Array], Array]) -> Array:
    """Nearest points (p, 3) on any of shapes (s, k, 3)."""
    if not len(shapes):
        return points.copy()
    count = min(_NEAREST, len(shapes))
    _, near = cKDTree(shapes.mean(axis=1)).query(points, k=count)
    near = near.reshape(len(points), count)
    found, least = points.copy(), np.full(len(points), np.inf)
    for k in range(count):
        at = closest(points, shapes[near[:, k]])
        distance = ((at - points) ** 2).sum(axis=1)
        better = distance < least
        found[better], least[better] = at[better], distance[better]
    return found


def _closest_on_segments(points: Array, segments: Array) -> Array:
    """Nearest point (p, 3) of each point's own segment (p, 2, 3)."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    share = ((points - start) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30)
    return np.asarray(start + np.clip(share, 0.0, 1.0)[:, None] * along)


def closest_on_triangles(points: Array, corners: Array) -> Array:
    """Nearest point (p, 3) of each point's own triangle (p, 3, 3)."""
    a, b, c = np.moveaxis(corners, 1, 0)
    u, v, w = b - a, c - a, points - a
    uu, uv, vv = ((p * q).sum(axis=1) for p, q in ((u, u), (u, v), (v, v)))
    wu, wv = (w * u).sum(axis=1), (w * v).sum(axis=1)
    area = np.maximum(uu * vv - uv**2, 1e-30)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    result = a + s[:, None] * u + t[:, None] * v
    outside = (s < 0) | (t < 0) | (s + t > 1)
    if outside.any():
        sides = [corners[outside][:, [k, (k + 1) % 3]] for k in range(3)]
        found = np.stack([_closest_on_segments(points[outside], side) for side in sides])
        distance = ((found - points[outside]) ** 2).sum(axis=2)
        result[outside] = np.take_along_axis(found, distance.argmin(axis=0)[None, :, None], axis=0)[0]
    return np.asarray(result)
