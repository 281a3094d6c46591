"""Weights of nearly parallel edges in ipctk's improved maximum, each by its own edge and vertex.

The improved maximum subtracts from the energy of two edges that of each vertex of one with the other,
smoothed in the same way if they are nearly parallel. ipctk 1.6 identifies such terms by their edges, in
either order, and by a name that depends on that order ("first edge, end of the second"). For two adjacent
edges one term therefore gets the weight of two. The energy then jumps where one of them leaves the gap, and
no search for an equilibrium passes the jump.
"""

from __future__ import annotations

import itertools
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Array


def reweigh(ipctk: Any, surface: Any, near: Any, candidates: Any, places: Array, reach_mm: float) -> None:
    """Correct, in place, the weights of nearly parallel edges of `near`, ipctk's pairs on its mesh `surface`.

    candidates: ipctk's, `near` holds those nearer than reach_mm; places (v, 3): positions in mm of the mesh's
    vertices.
    """
    ends, slopes = np.asarray(surface.edges), near.enable_shape_derivatives
    parallel = {}
    for a, b, threshold in _pairs(ipctk, surface, candidates, places, reach_mm):
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


def _pairs(
    ipctk: Any, surface: Any, candidates: Any, places: Array, reach_mm: float
) -> list[tuple[int, int, float]]:
    """Pairs of edges within reach whose terms are of two edges, with ipctk's threshold of being parallel.

    All that are nearly parallel are among them in the set without the improved maximum.
    """
    plain = ipctk.NormalCollisions()
    plain.collision_set_type = ipctk.NormalCollisions.IPC
    plain.build(candidates, surface, places, reach_mm)
    return [(one.edge0_id, one.edge1_id, one.eps_x) for one in plain.ee_collisions]


class _Term(NamedTuple):
    """One of ipctk's terms of two edges by value: its objects do not outlive their list."""

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
