"""Quadratic tetrahedra of a grid of boxes, some of which may be left out."""

from __future__ import annotations

import itertools

import numpy as np

from ..meshing.mesh import LATTICE, Array, Mesh, edges_of, oriented, second_order

# A box as six tetrahedra around its diagonal (Kuhn): faces of neighbours are cut alike. A corner is numbered
# 4 i + 2 j + k.
_SIX = np.array([[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]])


def box_grid(points: Array, solid: Array) -> Mesh:
    """Straight quadratic tetrahedra of a grid's boxes, which may be oblique.

    points (a, b, c, 3): the grid in mm; solid (a - 1, b - 1, c - 1): mask of the boxes. Nothing is clamped.
    """
    number = np.arange(points[..., 0].size).reshape(points.shape[:3])
    points = points.reshape(-1, 3)
    i, j, k = np.nonzero(solid)
    corners = np.stack([number[i + a, j + b, k + c] for a in (0, 1) for b in (0, 1) for c in (0, 1)], axis=1)
    used, tets = np.unique(corners[:, _SIX].reshape(-1, 4), return_inverse=True)
    nodes, tets = points[used], np.reshape(tets, (-1, 4))
    tets = oriented(nodes, tets)
    edges, _ = edges_of(tets)
    nodes, tets, nothing = second_order(nodes, tets, tets[:0, :3], nodes[edges].mean(axis=1))
    return Mesh(nodes, tets, np.full(len(tets), LATTICE), nothing, tets[0, :0], tets[0, :0])


def cut_levels(low: float, high: float, longest: float, inner: Array) -> Array:
    """Ascending places from low to high, all of `inner` between them, no farther apart than `longest`.

    Places closer to each other than a tenth of `longest` count as one.

    >>> cut_levels(0.0, 2.0, 1.0, np.array([0.5])).tolist()
    [0.0, 0.5, 1.25, 2.0]
    """
    near = 0.1 * longest
    kept = [low]
    for place in np.sort(inner[(inner > low + near) & (inner < high - near)]).tolist():
        if place - kept[-1] > near:
            kept.append(place)
    kept.append(high)
    parts = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) / longest - 1e-9))) + 1)[:-1]
        for a, b in itertools.pairwise(kept)
    ]
    return np.append(np.concatenate(parts), high)
