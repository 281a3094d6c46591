"""Tied nodes in the tangent: its blocks mapped to blocks between nodes that are not tied."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import sparse

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh

Array = np.ndarray[Any, Any]


def folded_blocks(mesh: Mesh, keys: Array) -> tuple[Callable[[Array], Array], Array]:
    """Map of the tangent's blocks (b, 3, 3) onto the nodes that tied ones follow, and the folded blocks'
    keys.

    keys (b,): of the lower triangle's blocks, column n + row of n nodes, row >= column. Returns the map from
    those blocks to the folded ones, and the keys (c,) of these, ascending. A node tied to others by weights w
    gives them w times its force, so that its blocks are spread over theirs by products of weights.
    """
    n = len(mesh.nodes)
    free = np.ones(n, bool)
    free[mesh.tied] = False
    own = np.flatnonzero(free)
    to = sparse.csr_matrix(
        (
            np.concatenate([np.ones(len(own)), mesh.tied_weights.ravel()]),
            (
                np.concatenate([own, np.repeat(mesh.tied, mesh.tied_to.shape[1])]),
                np.concatenate([own, mesh.tied_to.ravel()]),
            ),
        ),
        shape=(n, n),
    )
    to.eliminate_zeros()
    rows, columns = keys % n, keys // n
    per_row = np.diff(to.indptr)
    many = per_row[rows] * per_row[columns]
    block = np.repeat(np.arange(len(keys)), many)
    place = np.arange(len(block)) - np.repeat(np.cumsum(many) - many, many)
    first = to.indptr[rows][block] + place // per_row[columns][block]
    second = to.indptr[columns][block] + place % per_row[columns][block]
    row, column = to.indices[first].astype(np.int64), to.indices[second].astype(np.int64)
    weight = to.data[first] * to.data[second]
    # A block off the diagonal stands for its transpose, too: where both its nodes follow one, both fall on
    # that one's diagonal. One on the diagonal stands for itself, its own other half lies above.
    off = (rows != columns)[block]
    straight = row >= column
    turned = off & (row <= column)
    found = np.unique(np.concatenate([(column * n + row)[straight], (row * n + column)[turned]]))

    def spread(chosen: Array, key: Array) -> sparse.csr_matrix:
        where = np.searchsorted(found, key[chosen])
        return sparse.csr_matrix((weight[chosen], (where, block[chosen])), shape=(len(found), len(keys)))

    direct, transposed = spread(straight, column * n + row), spread(turned, row * n + column)

    def fold(blocks: Array) -> Array:
        across = np.ascontiguousarray(blocks.transpose(0, 2, 1)).reshape(-1, 9)
        total = direct @ blocks.reshape(-1, 9) + transposed @ across
        return np.asarray(total).reshape(-1, 3, 3)

    return fold, found
