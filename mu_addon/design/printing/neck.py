"""Shortest closed curves that separate two parts of a surface: finds holes too small for a grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..surface import Triangles, Vertices
from .faces import edges
from .finding import Points

_GRAIN = 1e-3
"""Unit in mm of an edge's length as a whole number."""


def necks(
    vertices: Vertices, triangles: Triangles, one: NDArray[np.bool_], other: NDArray[np.bool_]
) -> list[Points]:
    """Shortest closed curves that separate two parts of a surface, each as its edges' middles (k, 3) in mm.

    vertices (n, 3) in mm, triangles (m, 3); one (m,), other (m,): mark the triangles of either part. The
    curves are the minimum cut of the graph of triangles, whose links are as strong as the common edges are
    long. An empty list where nothing connects the parts, or one is empty.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_flow

    m = len(triangles)
    e = edges(triangles)
    order = np.argsort(e.of_side, kind="stable")
    pairs = np.flatnonzero(np.diff(e.of_side[order]) == 0)
    a, b = order[pairs] % m, order[pairs + 1] % m
    ends = e.ends[e.of_side[order[pairs]]]
    length = np.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)
    strength = np.maximum(np.rint(length / _GRAIN), 1).astype(np.int32)
    # Each side is drawn together into one node: 0 and 1, and the other triangles from 2 on.
    node = np.cumsum(~(one | other)) + 1
    node[one], node[other] = 0, 1
    rows, columns = np.concatenate([node[a], node[b]]), np.concatenate([node[b], node[a]])
    n = int(node.max(initial=1)) + 1
    kept = rows != columns
    graph = coo_matrix((np.tile(strength, 2)[kept], (rows[kept], columns[kept])), shape=(n, n)).tocsr()
    if one.any() and other.any():
        left = (graph - maximum_flow(graph, 0, 1).flow).tocsr()
        left.data[left.data < 0] = 0
        left.eliminate_zeros()
        reached = np.zeros(n, bool)
        reached[breadth_first_order(left, 0, return_predecessors=False)] = True
        cut = reached[node[a]] != reached[node[b]]
    else:
        cut = np.zeros(len(a), bool)
    if not cut.any():
        return []
    used, index = np.unique(ends[cut], return_inverse=True)
    first, second = index.reshape(-1, 2).T
    links = coo_matrix((np.ones(len(first)), (first, second)), shape=(len(used),) * 2)
    curve = connected_components(links, directed=False)[1][first]
    middle = vertices[ends[cut]].mean(axis=1)
    return [middle[curve == k] for k in range(int(curve.max()) + 1)]
