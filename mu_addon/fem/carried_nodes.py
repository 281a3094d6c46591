"""Nodes that follow the cross-sections of beams: their positions, and the forces passed on to the beams."""

from __future__ import annotations

from typing import TYPE_CHECKING

import attrs
import numpy as np
from scipy import sparse

from ..arrays import Array, ranges
from .beams import turned_curvature, turned_slopes
from .rotations import rotation

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh


def following(mesh: Mesh, u: Array) -> Array:
    """Displacements u (n, 3) in mm with tied and carried nodes set to follow their masters, in place."""
    return mesh.following(Carried(mesh).follow(u) if len(mesh.carried) else u)


class Carried:
    """The carried nodes of a mesh with beams (`Mesh.carried`).

    A node at X moves by the mean, weighted by its two shares, of the motions by the sections at two beam
    nodes: u + (R - 1) a, with displacement u and rotation R of the beam node at X_b, and a = X - X_b for a
    node of one section. Between two sections, a is shorter by half the other's share of the distance (midway
    by a quarter): the axis is then the parabola with the sections as its normals, and their shear is the
    beam's.

    Attributes: nodes, the carried ones; turns (t,), nodes with the rotation vectors of what carries them.
    """

    def __init__(self, mesh: Mesh) -> None:
        node, turn = mesh.carriers[:, 0::2], mesh.carriers[:, 1::2]
        shares = np.stack([mesh.shares, 1 - mesh.shares], axis=1)
        # One row for each pair of a node and what carries it.
        own, side = np.nonzero(shares)
        self.count = len(mesh.nodes)
        self.nodes = mesh.carried
        self._own, self._node, self._turn = own, node[own, side], turn[own, side]
        self.turns, self._of = np.unique(self._turn, return_inverse=True)
        self._share = shares[own, side]
        # Shares of three places in each arm: the carried node's, the section's and the other section's.
        self._other = node[own, 1 - side]
        self._less = (0.5 * (1.0 - self._share))[:, None]
        x = mesh.nodes
        self._arm = x[mesh.carried[own]] - (1.0 - self._less) * x[self._node] - self._less * x[self._other]
        levers, three = self._share[:, None] * self._arm, np.arange(3)
        # Of each pair its arm by the three axes of its section, times its share; of each node their sum.
        self._levers = sparse.csr_matrix(
            (levers.ravel(), (3 * self._of[:, None] + three).ravel(), np.arange(0, 3 * len(own) + 1, 3)),
            shape=(len(own), 3 * len(self.turns)),
        )
        pairs = len(self.nodes), len(own)
        of_node = sparse.csr_matrix((np.ones(len(own)), (own, np.arange(len(own)))), shape=pairs)
        self._turned = sparse.csr_matrix(of_node @ self._levers)
        self._means = sparse.csr_matrix((self._share, (own, self._node)), shape=(len(self.nodes), self.count))
        # Operators that do not depend on the displacement, and the last rotation vectors with all of theirs.
        eye = np.eye(3)[None]
        self._moving = np.concatenate([eye, self._share[:, None, None] * eye])
        self._last: tuple[Array, Array] | None = None

    def follow(self, u: Array) -> Array:
        """Displacements u (n, 3) in mm with those of carried nodes set, in place."""
        turned = rotation(u[self.turns]) - np.eye(3)
        u[self.nodes] = self._turned @ turned.transpose(0, 2, 1).reshape(-1, 3) + self._means @ u
        return u

    def _by_turn(self, u: Array) -> Array:
        """Slopes (t, 3, 3, 3) of sections' turned axes, the second index, by their rotation vectors."""
        return np.stack([turned_slopes(u[self.turns], arm) for arm in self._axes()], axis=2)

    def _moments(self, forces: Array) -> Array:
        """Sums (t, 3, 3) in N mm, over the nodes of a section, of arms by axis times forces (n, 3) in N."""
        return np.asarray(self._turned.T @ forces[self.nodes]).reshape(-1, 3, 3)

    def by_places(self, u: Array, forces: Array, v: Array | None = None) -> Array:
        """Derivative (n, 3), by all nodes' positions, of forces (n, 3) times the motion of carried nodes.

        That is their displacement at u (n, 3) or, with a change v (n, 3) of u, its change. Arms alone depend
        on places.
        """
        acting = self._share[:, None] * forces[self.nodes[self._own]]
        if v is None:
            turned = rotation(u[self.turns])[self._of]
            by_arm = np.einsum("kij,ki->kj", turned, acting) - acting
        else:
            by_arm = np.einsum("kiaj,ki,kj->ka", self._by_turn(u)[self._of], acting, v[self._turn])
        found = np.zeros_like(u)
        np.add.at(found, self.nodes[self._own], by_arm)
        np.subtract.at(found, self._node, (1.0 - self._less) * by_arm)
        np.subtract.at(found, self._other, self._less * by_arm)
        return found

    def _axes(self) -> Array:
        """The three axes as arms of each turning section, (3, t, 3)."""
        return np.broadcast_to(np.eye(3)[:, None], (3, len(self.turns), 3))

    def fold(self, u: Array, forces: Array) -> Array:
        """Forces (n, 3) in N with those on carried nodes passed on to beams, in place; couples in N mm."""
        # Summed by section first: there are sixty times as many pairs.
        forces[self.turns] += np.einsum("tiaj,tai->tj", self._by_turn(u), self._moments(forces))
        forces += self._means.T @ forces[self.nodes]
        forces[self.nodes] = 0.0
        return forces

    def turning(self, u: Array, forces: Array, convex: bool = False) -> Array:
        """Stiffness (t, 3, 3) in N mm of `turns` under forces (n, 3) in N on carried nodes.

        It is that of forces of fixed direction as their arms rotate. convex: each without its negative
        eigenvalues. Contact on both sides of a strut otherwise turns it over, since its forces before
        equilibrium are far larger than there.
        """
        moments = self._moments(forces)
        found = np.zeros((len(self.turns), 3, 3))
        for axis, arm in enumerate(self._axes()):
            found += turned_curvature(u[self.turns], arm, moments[:, axis])
        if convex:
            values, axes = np.linalg.eigh(found)
            found = (axes * np.maximum(values, 0.0)[:, None, :]) @ axes.transpose(0, 2, 1)
        return found

    def operators(self, u: Array) -> Array:
        """Derivatives (1 + 2 k, 3, 3) of a node's displacement, by itself and by its beam nodes' unknowns.

        The k shares come first, then the k slopes by rotation vectors.
        """
        vectors = u[self.turns]
        if self._last is None or not np.array_equal(vectors, self._last[0]):
            by_axis = self._by_turn(u).transpose(0, 2, 1, 3).reshape(-1, 9)
            slopes = np.asarray(self._levers @ by_axis).reshape(-1, 3, 3)
            self._last = vectors, np.concatenate([self._moving, slopes])
        return self._last[1]

    def parts_of(self, nodes: Array) -> tuple[Array, Array, Array]:
        """Node, beam node and operator of every pair in which a beam node moves one of the nodes (j,)."""
        k = len(self._own)
        place = np.full(self.count, -1)
        place[self.nodes] = np.arange(len(self.nodes))
        at = place[nodes]
        start = np.searchsorted(self._own, np.arange(len(self.nodes) + 1))
        free = np.flatnonzero(at < 0)
        held = np.flatnonzero(at >= 0)
        many = (start[1:] - start[:-1])[at[held]]
        which, row = ranges(many, start[at[held]])
        which = held[which]
        number = np.concatenate([free, which, which])
        mover = np.concatenate([nodes[free], self._node[row], self._turn[row]])
        operator = np.concatenate([np.zeros(len(free), int), 1 + row, 1 + k + row])
        order = np.argsort(number, kind="stable")
        return number[order], mover[order], operator[order]

    def map(self, u: Array, nodes: Array) -> sparse.csr_matrix:
        """Derivative of displacements (3 j,) of some nodes (j,) by those (3 n,) of nodes not carried."""
        number, mover, operator = self.parts_of(nodes)
        axes = np.arange(3)
        rows = np.repeat(3 * number[:, None] + axes, 3, axis=1).ravel()
        columns = np.tile(3 * mover[:, None].astype(np.int64) + axes, 3).ravel()
        values = self.operators(u)[operator].ravel()
        return sparse.csr_matrix((values, (rows, columns)), shape=(3 * len(nodes), 3 * self.count))


@attrs.frozen(eq=False)
class Folding:
    """Map of blocks with a carried node on either side to blocks between beam nodes.

    block (e,): which of the given; left, right (e,): operators of its row and column, see
    `Carried.operators`; row, column (e,): nodes of the lower triangle, turned (e,): True if the block is
    transposed there; both (e,): True if its transpose is there, too.
    """

    block: Array
    left: Array
    right: Array
    row: Array
    column: Array
    turned: Array
    both: Array

    @classmethod
    def of(cls, carried: Carried, rows: Array, columns: Array) -> Folding:
        """Map of blocks between nodes, rows (b,) >= columns (b,), to blocks between beam nodes."""
        nodes, number = np.unique(np.concatenate([rows, columns]), return_inverse=True)
        at, mover, operator = carried.parts_of(nodes)
        start = np.searchsorted(at, np.arange(len(nodes) + 1))
        first, second = number[: len(rows)], number[len(rows) :]
        many = np.diff(start)
        each = many[first] * many[second]
        block, place = ranges(each)
        i = start[first][block] + place // many[second][block]
        j = start[second][block] + place % many[second][block]
        p, q, same = mover[i], mover[j], (rows == columns)[block]
        # A block on the diagonal holds both halves of what it gives: the upper one is not needed.
        keep = ~same | (p >= q)
        block, i, j, p, q, same = (a[keep] for a in (block, i, j, p, q, same))
        turned = p < q
        return cls(
            block, operator[i], operator[j], np.maximum(p, q), np.minimum(p, q), turned, (p == q) & ~same
        )

    def __call__(self, blocks: Array, operators: Array) -> Array:
        """Return the blocks (e, 3, 3) in the lower triangle that blocks (b, 3, 3) contribute."""
        found = operators[self.left].transpose(0, 2, 1) @ blocks[self.block] @ operators[self.right]
        other = found.transpose(0, 2, 1)
        found = np.where(self.turned[:, None, None], other, found)
        return np.asarray(found + np.where(self.both[:, None, None], other, 0.0))
