"""Struts of a printed mesh as beams where they are whole: away from wall, waveguide and cuts.

A strut's mesh is swept in layers from its cell's corner to its centre. A layer clear of the parts that
support struts becomes one beam of `fem.beams`, whose sections carry the layer's nodes. Feet, cut struts and
their joints stay solid, so that struts act on the wall as solid ones do.
"""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice import Lattice, lattice_of
from ..meshing.mesh import LATTICE, Mesh
from .joints import Zones, zones_of
from .octants import SweptNodes

REACH = 0.3
"""Layers nearer than this share of a junction's diameter to the parts that support struts stay solid."""

_WHOLE = 1.0 - 1e-9
_GAUSS = np.polynomial.legendre.leggauss(6)
# Pieces of a layer that the flexibility is integrated over.
_PIECES = 8
# Rotation vectors stand at places of their own, which no other node has: this share of a beam from its end.
_OFF = 0.3


def without_beams(mesh: Mesh, solid: Array) -> Mesh:
    """The mesh with some elements (m,) bool solid again, with all of their beams and the joints of these.

    Rotation vectors that no beam uses any more stay as nodes, so that numbers do not change.
    """
    gone = np.zeros(len(mesh.beams), bool)
    gone[np.unique(mesh.beam_of[solid & (mesh.beam_of >= 0)])] = True
    if not gone.any():
        return mesh
    # A joint's beams all begin at it, or all end at it; between layers one begins where one ends.
    begins, stops = (np.bincount(mesh.beams[:, k], minlength=len(mesh.nodes)) > 0 for k in (0, 2))
    joint = begins != stops
    for end in (0, 2):
        at = np.unique(mesh.beams[gone, end])
        at = at[joint[at]]
        gone |= np.isin(mesh.beams[:, 0], at) | np.isin(mesh.beams[:, 2], at)
    number = np.where(gone, -1, np.cumsum(~gone) - 1)
    beam_of = np.append(number, -1)[mesh.beam_of]
    beams = mesh.beams[~gone]
    inside = np.zeros(len(mesh.nodes), bool)
    inside[mesh.tets[beam_of >= 0]] = True
    inside[beams] = False
    keep = inside[mesh.carried]
    return attrs.evolve(
        mesh,
        beams=beams,
        flexible=mesh.flexible[~gone],
        beam_of=beam_of,
        carried=mesh.carried[keep],
        carriers=mesh.carriers[keep],
        shares=mesh.shares[keep],
    )


def with_beams(mesh: Mesh, d: Dimensions, layers: int, clear: Array, reach_mm: float) -> Mesh:
    """A printed mesh of swept struts with beams in place of the layers that are whole and far from walls.

    layers: of a strut's mesh, as in `strut_mesh`; clear (n,): distance of the struts' nodes in mm from the
    parts that support struts; reach_mm: distance below which a layer stays solid. Rotation vectors are nodes
    added at the end.
    """
    parts = Layers(mesh, lattice_of(d), layers)
    whole = parts.whole(mesh, clear, reach_mm)
    return parts.replaced(mesh, whole, zones_of(d))


def rotation_nodes(beams: Array, nodes: Array) -> tuple[Array, Array]:
    """The axis nodes (b,) of beams (e, 4), ascending, and the places (b, 3) in mm of their rotation vectors.

    nodes (n, 3) in mm. Each rotation vector's node is placed on one of its beams, a share of the length away.
    """
    own = np.unique(beams[:, 0::2])
    other = np.empty(len(nodes), int)
    other[beams[:, 0]], other[beams[:, 2]] = beams[:, 2], beams[:, 0]
    return own, np.asarray(nodes[own] + _OFF * (nodes[other[own]] - nodes[own]))


class Layers:
    """The layers of the struts in a printed mesh.

    elements (k,): those of struts; strut, layer (k,): of each. Of each pair of a node and its strut: node,
    strut, twice its level in layers, and True if it is on the axis.
    """

    def __init__(self, mesh: Mesh, lattice: Lattice, layers: int) -> None:
        self.lattice, self.count = lattice, layers
        self.elements = np.flatnonzero(mesh.region == LATTICE)
        rows = np.unique(mesh.tets[self.elements])
        swept = SweptNodes(lattice, mesh.nodes[rows])
        middles = mesh.nodes[mesh.tets[self.elements, :4]].mean(axis=1)
        self.strut = swept.strut_of(middles)
        pairs = swept.places
        keep = np.isin(pairs.strut, self.strut)
        self.node, self.node_strut = rows[pairs.node[keep]], pairs.strut[keep]
        self.level = np.rint(2 * layers * pairs.at[keep, 2]).astype(int)
        self.on_axis = (np.abs(pairs.at[keep, :2]) < 1e-6).all(axis=1)
        # The pair of each node of each element with the element's strut, (k, 10).
        keys = self.node_strut.astype(np.int64) * len(mesh.nodes) + self.node
        wanted = self.strut.astype(np.int64)[:, None] * len(mesh.nodes) + mesh.tets[self.elements]
        order = np.argsort(keys)
        self.of_element = order[np.searchsorted(keys[order], wanted)]
        self.layer = self.level[self.of_element].min(axis=1) // 2
        # Joints (s, 2) of the struts, the cell's corner first.
        ends = lattice.struts
        self.ends = np.where(lattice.is_corner[ends[:, 0]][:, None], ends, ends[:, ::-1])

    def whole(self, mesh: Mesh, clear: Array, reach_mm: float) -> Array:
        """Mask (struts, layers) of the layers that can be a beam."""
        shape = len(self.lattice.struts), self.count
        there = np.zeros(shape, int)
        np.add.at(there, (self.strut, self.layer), 1)
        spoilt = np.zeros(shape, int)
        np.add.at(spoilt, (self.strut, self.layer), ~whole_and_clear(mesh, self.elements, clear, reach_mm))
        found = (there == there.max()) & (spoilt == 0)
        return free_joints(found, (there > 0).any(axis=1), self.ends, len(self.lattice.nodes))

    def replaced(self, mesh: Mesh, whole: Array, zones: Zones) -> Mesh:
        """The mesh with beams in place of the whole layers (struts, layers)."""
        count = self.count
        beam = np.full(whole.shape, -1)
        beam[whole] = np.arange(np.count_nonzero(whole))
        strut, layer = np.nonzero(whole)
        if not len(strut):
            return mesh
        beam_of = np.full(len(mesh.tets), -1)
        beam_of[self.elements] = beam[self.strut, self.layer]
        # Nodes of beams on the axes, by strut and level; those at joints belong to several struts.
        axis = np.full((len(whole), count + 1), -1)
        at = np.flatnonzero(self.on_axis & (self.level % 2 == 0))
        axis[self.node_strut[at], self.level[at] // 2] = self.node[at]
        first, second = axis[strut, layer], axis[strut, layer + 1]
        own, places = rotation_nodes(np.column_stack([first, first, second, second]), mesh.nodes)
        turn = np.full(len(mesh.nodes), -1)
        turn[own] = len(mesh.nodes) + np.arange(len(own))
        beams = np.column_stack([first, turn[first], second, turn[second]])
        carried = self._carried(whole, axis, turn)
        return attrs.evolve(
            mesh,
            nodes=np.vstack([mesh.nodes, places]),
            beams=beams,
            flexible=self.flexible(self.lattice, strut, layer, zones),
            beam_of=beam_of,
            carried=carried[0],
            carriers=carried[1],
            shares=carried[2],
        )

    def of_beams(self, mesh: Mesh) -> tuple[Array, Array]:
        """Strut (e,) and layer (e,) of each beam of the mesh that `replaced` made."""
        beam = mesh.beam_of[self.elements]
        first = np.unique(beam, return_index=True)[1][-len(mesh.beams) :]
        return self.strut[first], self.layer[first]

    def _carried(self, whole: Array, axis: Array, turn: Array) -> tuple[Array, Array, Array]:
        """Carried nodes (c,), their carriers (c, 4) and the first one's shares (c,)."""
        used = whole[self.strut, self.layer]
        pairs = np.unique(self.of_element[used])
        node, strut, level = self.node[pairs], self.node_strut[pairs], self.level[pairs]
        _, once = np.unique(node, return_index=True)
        node, strut, level = node[once], strut[once], level[once]
        apart = turn[node] < 0
        node, strut, level = node[apart], strut[apart], level[apart]
        low, high = axis[strut, level // 2], axis[strut, (level + 1) // 2]
        carriers = np.column_stack([low, turn[low], high, turn[high]])
        return node, carriers, np.where(level % 2 == 0, 1.0, 0.5)

    def flexible(self, lattice: Lattice, strut: Array, layer: Array, zones: Zones) -> Array:
        """Integrals (e, 6) over the layers' sections, see `fem.beams.sections_of`.

        lattice: this one, or one of as many struts with other radii.
        """
        return integrals(lattice, strut, self.ends[strut], layer, self.count, zones)


def whole_and_clear(mesh: Mesh, elements: Array, clear: Array, reach_mm: float) -> Array:
    """Mask (k,) of elements (k,) that are whole, without tied nodes, and no nearer than reach_mm to walls.

    clear (n,): distance of the nodes in mm from the parts that support struts.
    """
    tied = np.zeros(len(mesh.nodes), bool)
    tied[mesh.tied] = True
    nodes = mesh.tets[elements]
    bad = (mesh.filled[elements] < _WHOLE).any(axis=1) | tied[nodes].any(axis=1)
    return np.asarray(~(bad | (clear[nodes] < reach_mm).any(axis=1)))


def free_joints(whole: Array, present: Array, ends: Array, count: int) -> Array:
    """Whole layers (s, l), without those at joints within reach of a solid part.

    present (s,): struts that exist; ends (s, 2): their joints, of `count`. A joint is one of beams if all
    struts that are there are beams at it.
    """
    found, free = whole.copy(), np.ones(count, bool)
    for end, layer in ((0, 0), (1, -1)):
        free[ends[present & ~found[:, layer], end]] = False
    for end, layer in ((0, 0), (1, -1)):
        found[~free[ends[:, end]], layer] = False
    return found


def integrals(lattice: Lattice, strut: Array, ends: Array, layer: Array, count: int, zones: Zones) -> Array:
    """Integrals (e, 6) over the sections of some layers, see `fem.beams.sections_of`.

    strut, layer (e,): of each, of `count` layers that run from the first of two ends (e, 2) to the second.
    """
    way = lattice.nodes[ends[:, 1]] - lattice.nodes[ends[:, 0]]
    length = np.linalg.norm(way, axis=1)
    start, stop = layer / count * length, (layer + 1) / count * length
    middle = (start + stop) / 2
    meeting = np.bincount(lattice.struts.ravel(), minlength=len(lattice.nodes))
    junction = 2 * lattice.node_radii[ends]
    flipped = lattice.struts[strut, 0] != ends[:, 0]
    found = np.empty((len(strut), 6))
    stretch, bend = zones.lengths(junction, meeting[ends])
    for zone, columns in ((stretch, (0,)), (bend, (1, 2, 3, 4, 5))):
        low = np.where(layer == 0, np.maximum(start, zone[:, 0]), start)
        high = np.where(layer == count - 1, np.minimum(stop, length - zone[:, 1]), stop)
        s, weight = _stations(low, high)
        t = s / length[:, None]
        radius = lattice.radii(np.where(flipped[:, None], 1 - t, t), strut)
        area, inertia = np.pi * radius**2, np.pi * radius**4 / 4
        off = s - middle[:, None]
        integrands = (1 / area, 0.5 / inertia, 1 / inertia, off / inertia, off**2 / inertia, 1 / area)
        for column in columns:
            found[:, column] = (weight * integrands[column]).sum(axis=1)
    return found


def _stations(low: Array, high: Array) -> tuple[Array, Array]:
    """Places (e, q) between two ends (e,) each, and the weights (e, q) that integrate over them."""
    x, w = _GAUSS
    cuts = np.linspace(0.0, 1.0, _PIECES + 1)
    half = 0.5 / _PIECES
    at = (cuts[:-1, None] + half * (1 + x)).ravel()
    span = (high - low)[:, None]
    return low[:, None] + span * at, span * np.tile(w * half, _PIECES)
