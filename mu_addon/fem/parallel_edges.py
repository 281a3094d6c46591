"""Weights of nearly parallel edges in ipctk's improved maximum, each by its own edge and vertex.

The improved maximum takes from the energy of two edges that of each vertex of one with the other, smoothed
like theirs where they are nearly parallel. ipctk 1.6 tells such terms apart by their edges, in either order,
and by a name that depends on that order ("first edge, end of the second"), so that of two edges beside each
other one term gets the weight of two. The energy then jumps where one of them leaves the gap, and no search
for an equilibrium passes the jump.
"""

from __future__ import annotations

import itertools
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, Any]

# ipctk smooths edges whose cross product is below this share of the product of their lengths as drawn; a
# little more, so that none is missed: ipctk's own functions decide.
_PARALLEL = 1.005 * np.sqrt(1e-3)


def pairs_of(surface: Any, candidates: Any, places: Array, reach_mm: float, moves_mm: float) -> Array:
    """Edges (c, 2) of candidates that may be nearly parallel within reach while no vertex moves any farther.

    surface: ipctk's collision mesh; candidates: a superset of the pairs within reach meanwhile; places (v, 3)
    in mm of its vertices.
    """
    found = candidates.ee_candidates
    pairs = np.empty((len(found), 2), int)
    for column, name in enumerate(("edge0_id", "edge1_id")):
        pairs[:, column] = np.fromiter(map(attrgetter(name), found), int, len(found))
    way, drawn = _ways(surface, places)
    length = np.linalg.norm(way, axis=1)
    # An edge's vector changes by twice the moves at most.
    slack = 2.0 * moves_mm * (length[pairs].sum(axis=1) + 2.0 * moves_mm)
    pairs = pairs[_across(way, pairs) < _PARALLEL * drawn[pairs].prod(axis=1) + slack]
    # From where edges are nearest an end of one lies within half the shorter edge.
    near = (reach_mm + 2.0 * moves_mm) ** 2 + 0.25 * length[pairs].min(axis=1) ** 2
    return pairs[_to_ends(surface, places, pairs) < near]


def _ways(surface: Any, places: Array) -> tuple[Array, Array]:
    """Vectors (e, 3) of the edges in mm, and lengths (e,) as drawn."""
    ends, rest = np.asarray(surface.edges), np.asarray(surface.rest_positions)
    way, drawn = (at[ends[:, 1]] - at[ends[:, 0]] for at in (places, rest))
    return way, np.linalg.norm(drawn, axis=1)


def _across(way: Array, pairs: Array) -> Array:
    """Lengths (c,) of the cross products of pairs of edges."""
    (ax, ay, az), (bx, by, bz) = (way[column].T for column in pairs.T)
    return np.asarray(np.sqrt((ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2))


def _to_ends(surface: Any, places: Array, pairs: Array) -> Array:
    """Least squared distances (c,) in mm2 of an end of one edge from the other."""
    ends = np.asarray(surface.edges)[pairs]
    least = np.full(len(pairs), np.inf)
    for side in (0, 1):
        start, stop = (places[ends[:, side, end]] for end in (0, 1))
        way = stop - start
        square = np.einsum("ij,ij->i", way, way)
        for end in (0, 1):
            off = places[ends[:, 1 - side, end]] - start
            along = np.clip(np.einsum("ij,ij->i", off, way) / square, 0.0, 1.0)
            off = off - along[:, None] * way
            least = np.minimum(least, np.einsum("ij,ij->i", off, off))
    return least


def reweigh(ipctk: Any, surface: Any, near: Any, pairs: Array, places: Array, reach_mm: float) -> None:
    """Weigh nearly parallel edges of `near`, ipctk's pairs on its mesh `surface`, anew and in place.

    pairs (c, 2): a superset of its nearly parallel edges, see `pairs_of`; places (v, 3) in mm of the mesh's
    vertices; reach_mm: `near` holds what is nearer.
    """
    way, drawn = _ways(surface, places)
    pairs = pairs[_across(way, pairs) < _PARALLEL * drawn[pairs].prod(axis=1)]
    # Nearly parallel edges are no nearer than their ends, but for what they turn towards each other.
    turned = (_PARALLEL * drawn[pairs].max(axis=1)) ** 2
    pairs = pairs[_to_ends(surface, places, pairs) < reach_mm**2 + turned]
    ends, rest = np.asarray(surface.edges), np.asarray(surface.rest_positions)
    parallel, slopes = {}, near.enable_shape_derivatives
    for a, b in pairs.tolist():
        threshold = ipctk.edge_edge_mollifier_threshold(*rest[ends[a]], *rest[ends[b]])
        at = places[ends[a]], places[ends[b]]
        if ipctk.edge_edge_cross_squarednorm(*at[0], *at[1]) < threshold:
            parallel[frozenset((a, b))] = [
                _Term((a, b), threshold, name, *_weight(surface, (a, b), share, slopes))
                for name, share in _shares(ipctk, at, reach_mm**2).items()
            ]
    if not parallel:
        return
    terms = [_term(one, slopes) for one in near.ee_collisions]
    terms = [one for one in terms if frozenset(one.edges) not in parallel]
    terms += itertools.chain(*parallel.values())
    near.ee_collisions = [one.made(ipctk) for one in terms if one.weight]


class _Term(NamedTuple):
    """One of ipctk's terms of two edges by value: its own objects end with the list that they are in."""

    edges: tuple[int, int]
    threshold: float
    name: Any
    weight: float
    gradient: Any

    def made(self, ipctk: Any) -> Any:
        """The term as ipctk has it."""
        made = ipctk.EdgeEdgeNormalCollision(*self.edges, self.threshold, self.name)
        made.weight = self.weight
        if self.gradient is not None:
            made.weight_gradient = self.gradient
        return made


def _term(of: Any, with_gradient: bool) -> _Term:
    gradient = of.weight_gradient.copy() if with_gradient else None
    return _Term((of.edge0_id, of.edge1_id), of.eps_x, of.dtype, of.weight, gradient)


def _weight(surface: Any, edges: tuple[int, int], share: Array, with_gradient: bool) -> tuple[float, Any]:
    """Weight of a share (2,) of the areas of two edges, and its gradient by the places as drawn, if asked."""
    weight = float(share @ [surface.edge_area(edge) for edge in edges])
    if not with_gradient:
        return weight, None
    first, second = (surface.edge_area_gradient(edge) for edge in edges)
    return weight, share[0] * first + share[1] * second


def _shares(ipctk: Any, at: tuple[Array, Array], reach: float) -> dict[Any, Array]:
    """Shares (2,) of the areas of two nearly parallel edges, ends at (2, 3) in mm each, by term.

    reach: squared distance in mm2 below which pairs count.
    """
    names, nearest = ipctk.EdgeEdgeDistanceType, ipctk.PointEdgeDistanceType
    found: dict[Any, Array] = {}
    name = ipctk.edge_edge_distance_type(*at[0], *at[1])
    if ipctk.edge_edge_distance(*at[0], *at[1], name) < reach:
        found[name] = np.array([0.25, 0.25])
    for side in (0, 1):
        own, other = at[side], at[1 - side]
        less = -0.25 * np.eye(2)[side]
        for number, vertex in enumerate(other):
            kind = ipctk.point_edge_distance_type(vertex, *own)
            if ipctk.point_edge_distance(vertex, *own, kind) >= reach:
                continue
            end = {nearest.P_E0: "0", nearest.P_E1: "1", nearest.P_E: ""}[kind]
            first, second = (end, number) if side == 0 else (number, end)
            name = getattr(names, f"EA{first}_EB{second}")
            found[name] = found.get(name, np.zeros(2)) + less
    return found
