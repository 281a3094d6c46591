"""Ties of several parts joined into one table, each to nodes that are not tied themselves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from ..fem.embedding import embed
from ..meshing.mesh import Array, Mesh


class Ties(NamedTuple):
    """Nodes (t,) that move as weighted sums of others: their numbers and weights (t, k)."""

    nodes: Array
    to: Array
    weights: Array


def tie(rows: Array, points: Array, to: Mesh, first: int = 0) -> Ties:
    """Nodes (t,), at points (t, 3) in mm, that follow a mesh whose own nodes are numbered from `first` on."""
    follows = embed(to, points)
    return Ties(rows, follows.nodes + first, follows.weights)


def joined(parts: list[Ties], count: int) -> Ties:
    """All ties of a body of `count` nodes, each node tied once at most.

    A node that follows tied ones follows their nodes: weights multiply. Chains are two ties long at most.
    """
    width = max(part.to.shape[1] for part in parts)
    padded = [(part, width - part.to.shape[1]) for part in parts]
    nodes = np.concatenate([part.nodes for part in parts])
    to = np.vstack([np.pad(part.to, ((0, 0), (0, more)), "edge") for part, more in padded])
    weights = np.vstack([np.pad(part.weights, ((0, 0), (0, more))) for part, more in padded])
    if not np.isin(to, nodes).any():
        return Ties(nodes, to, weights)
    free = np.setdiff1d(np.arange(count), nodes)
    rows = np.concatenate([free, np.repeat(nodes, width)])
    columns = np.concatenate([free, to.ravel()])
    values = np.concatenate([np.ones(len(free)), weights.ravel()])
    follows = sparse.csr_matrix((values, (rows, columns)), shape=(count, count))
    follows = (follows[nodes] @ follows).tocsr()
    follows.eliminate_zeros()
    each = np.diff(follows.indptr)
    place = np.arange(follows.nnz) - np.repeat(follows.indptr[:-1], each)
    row = np.repeat(np.arange(len(nodes)), each)
    to = np.repeat(follows.indices[follows.indptr[:-1], None], each.max(), axis=1)
    weights = np.zeros(to.shape)
    to[row, place], weights[row, place] = follows.indices, follows.data
    return Ties(nodes, to, weights)
