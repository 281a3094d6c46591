"""Tied nodes in the tangent: its blocks mapped to blocks between nodes that are not tied."""

from __future__ import annotations

import copy
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
import warp as wp
from scipy import sparse

from ..arrays import Array
from ..errors import InputError

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh


NEGLIGIBLE = 1e-12
"""Weight up to which a moved node does not follow another: 0 to rounding."""


class TiedBlocks:
    """Map of the tangent's blocks (b, 3, 3) onto the nodes that tied ones follow: to blocks (c, 3, 3).

    keys (b,): of the lower triangle's blocks, column n + row of n nodes, row >= column. A node tied to others
    by weights w gives them w times its force, so that its blocks are spread over theirs by products of
    weights. device: of Warp. Attribute keys (c,): of the folded blocks, ascending.
    """

    def __init__(self, mesh: Mesh, keys: Array, device: str) -> None:
        self._device = device
        n = len(mesh.nodes)
        free = np.ones(n, bool)
        free[mesh.tied] = False
        own = np.flatnonzero(free)
        self._own = len(own)
        self.weights = self._weights_of(mesh)
        self._follows = np.flatnonzero(self.weights)
        to = sparse.csr_matrix(
            (
                self._follows.astype(np.int32),
                (
                    np.concatenate([own, np.repeat(mesh.tied, mesh.tied_to.shape[1])])[self._follows],
                    np.concatenate([own, mesh.tied_to.ravel()])[self._follows],
                ),
            ),
            shape=(n, n),
        )
        rows, columns = keys % n, keys // n
        per_row = np.diff(to.indptr)
        many = per_row[rows] * per_row[columns]
        # Some millions of pairs: of 32 bits where that will do.
        block = np.repeat(np.arange(len(keys), dtype=np.int32), many)
        start = (np.cumsum(many) - many).astype(np.int32)
        place = np.arange(len(block), dtype=np.int32) - start[block]
        before, after = np.divmod(place, per_row[columns][block])
        first, second = to.indptr[rows][block] + before, to.indptr[columns][block] + after
        row, column = to.indices[first].astype(np.int64), to.indices[second].astype(np.int64)
        # A block off the diagonal stands for its transpose, too: where both its nodes follow one, both fall
        # on that one's diagonal. One on the diagonal stands for itself, its own other half lies above.
        off = (rows != columns)[block]
        straight, turned = np.flatnonzero(row >= column), np.flatnonzero(off & (row <= column))
        found, target = np.unique(
            np.concatenate([column[straight] * n + row[straight], row[turned] * n + column[turned]]),
            return_inverse=True,
        )
        order = np.argsort(target, kind="stable")
        chosen = np.concatenate([straight, turned])[order]
        self.keys = found
        self._pairs = to.data[first[chosen]], to.data[second[chosen]]
        self._start = np.append(0, np.cumsum(np.bincount(target))).astype(np.int32)
        self._index = np.where(order < len(straight), block[chosen], -block[chosen] - 1)

    def _weights_of(self, mesh: Mesh) -> Array:
        return np.concatenate([np.ones(self._own), mesh.tied_weights.ravel()])

    def of(self, mesh: Mesh) -> TiedBlocks:
        """The same map with the weights of a mesh whose nodes have moved.

        Raises InputError, once it is used, where a node follows one that it did not follow before.
        """
        found = copy.copy(self)
        found.__dict__.pop("lists", None)
        found.weights = self._weights_of(mesh)
        return found

    @cached_property
    def lists(self) -> tuple[wp.array, wp.array, wp.array]:
        """On the device, for `kernels.spread_blocks`: start (c + 1,), index (k,) and weight (k,)."""
        left = np.ones(len(self.weights), bool)
        left[self._follows] = False
        if np.abs(self.weights[left]).max(initial=0.0) > NEGLIGIBLE:
            raise InputError(
                "a relocated body with other ties has no tangent", "mesh", "make a new model of the mesh"
            )
        weight = self.weights[self._pairs[0]] * self.weights[self._pairs[1]]
        put = partial(wp.array, device=self._device)
        return put(self._start, int), put(self._index, int), put(weight, wp.float64)
