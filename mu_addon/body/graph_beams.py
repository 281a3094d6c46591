"""Struts of a lattice of any kind as beams, where they are whole and away from the walls.

The struts' mesh is not swept. An element is assigned to the strut whose axis is nearest, in radii, and its
volume to the layers that it reaches. A whole layer clear of the parts that support struts becomes a beam
between two sections. Of elements that reach into such a layer only the part outside it resists; their nodes
inside move with the sections. Struts on the envelope's faces, which the box halves, stay solid, and so do
their joints.
"""

from __future__ import annotations

from weakref import WeakKeyDictionary

import attrs
import numpy as np

from ..arrays import Array
from ..design.lattice import Lattice
from ..fem.elements import even_points, reference_gradients, shape_functions
from ..meshing.mesh import LATTICE, Mesh, part
from .beams import free_joints, integrals, rotation_nodes, whole_and_clear
from .graph_axes import Axes
from .joints import Zones
from .lattice import FLOOR, LEAST_SUPPORT, support

# Steps along each edge of the points that tell which part of an element lies in which layer.
_STEPS = 4
# Part of a layer that a rigid zone may take.
_BEYOND = 0.8


class GraphLayers:
    """Layers of the struts in a printed mesh of a lattice of any kind; see `with_graph_beams`.

    elements (k,): those of struts; strut (k,): of each; inside (k, p): layer of each of p points in it.
    """

    def __init__(self, mesh: Mesh, lattice: Lattice, layers: int) -> None:
        self.lattice, self.count = lattice, layers
        self.elements = np.flatnonzero(mesh.region == LATTICE)
        self.axes = Axes(lattice)
        corners = mesh.nodes[mesh.tets[self.elements, :4]]
        self.strut = self.axes.nearest(corners.mean(axis=1))
        shape = shape_functions(even_points(_STEPS), 1)
        self.inside = np.empty((len(corners), len(shape)), np.int8)
        for p, weights in enumerate(shape):
            at = self.axes.distances(weights @ corners, self.strut)[1]
            self.inside[:, p] = np.clip((layers * at).astype(int), 0, layers - 1)
        self.volumes = reference_gradients(mesh.nodes, mesh.tets[self.elements]).volumes
        self.halved = ("x" in mesh.symmetry) & (lattice.nodes[lattice.struts][:, :, 0] == 0.0).all(axis=1)

    def whole(self, mesh: Mesh, clear: Array, reach_mm: float) -> Array:
        """Mask (struts, layers) of the layers that can be a beam."""
        lattice = self.lattice
        there, spoilt = np.zeros((2, len(lattice.struts), self.count), bool)
        there[self.strut[:, None], self.inside] = True
        bad = ~whole_and_clear(mesh, self.elements, clear, reach_mm)
        spoilt[self.strut[bad, None], self.inside[bad]] = True
        # The box cuts struts in its faces in half.
        ends = lattice.nodes[lattice.struts]
        faces = lattice.nodes.min(axis=0), lattice.nodes.max(axis=0)
        cut = np.any([(ends == face).all(axis=1).any(axis=1) for face in faces], axis=0)
        found = there & ~spoilt & ~cut[:, None]
        return free_joints(found, there.any(axis=1), lattice.struts, len(lattice.nodes))

    def replaced(self, mesh: Mesh, whole: Array, zones: Zones) -> Mesh:
        """The mesh with beams in place of the whole layers (struts, layers)."""
        strut, layer = np.nonzero(whole)
        if not len(strut):
            return mesh
        section, places = self._sections(strut, layer)
        first, second = (len(mesh.nodes) + section[strut, layer + end] for end in (0, 1))
        nodes = np.vstack([mesh.nodes, places])
        own, turns = rotation_nodes(np.column_stack([first, first, second, second]), nodes)
        turn = np.full(len(nodes), -1)
        turn[own] = len(nodes) + np.arange(len(own))
        # Struts in the plane of the base are clamped with it.
        floor = len(mesh.nodes) + np.flatnonzero(places[:, 2] == mesh.nodes[mesh.base[0], 2])
        found = attrs.evolve(mesh, nodes=np.vstack([nodes, turns]), base=np.concatenate([mesh.base, floor]))
        beams = np.column_stack([first, turn[first], second, turn[second]])
        return self._fitted(found, whole, beams, self._flexible(strut, layer, zones))

    def without(self, mesh: Mesh, solid: Array) -> Mesh:
        """A mesh of `replaced` with some elements (m,) bool solid again.

        With all layers that these reach into, and the joints of these. Sections that no beam uses any more
        stay as nodes, so that numbers do not change.
        """
        before = self._whole_in(mesh)
        spoilt = np.zeros(before.shape, bool)
        reached = solid[self.elements]
        spoilt[self.strut[reached, None], self.inside[reached]] = True
        present = np.zeros(len(before), bool)
        present[self.strut] = True
        whole = before & ~spoilt
        whole = free_joints(whole, present, self.lattice.struts, len(self.lattice.nodes))
        keep = whole[np.nonzero(before)]
        return self._fitted(mesh, whole, mesh.beams[keep], mesh.flexible[keep])

    def _whole_in(self, mesh: Mesh) -> Array:
        """Mask (struts, layers) of the beams of a mesh of `replaced`, which are in the order of its rows."""
        ends = mesh.nodes[mesh.beams[:, 0::2]]
        strut = self.axes.nearest(ends.mean(axis=1))
        at = self.axes.distances(ends.mean(axis=1), strut)[1]
        found = np.zeros((len(self.axes.way), self.count), bool)
        found[strut, (self.count * at).astype(int)] = True
        return found

    def _fitted(self, mesh: Mesh, whole: Array, beams: Array, flexible: Array) -> Mesh:
        """The mesh with the beams (e, 4) of the whole layers (struts, layers), in the order of its rows."""
        strut, layer = np.nonzero(whole)
        number = np.full(whole.shape, -1)
        number[strut, layer] = np.arange(len(strut))
        taken = whole[self.strut[:, None], self.inside]
        every, some = taken.all(axis=1), taken.any(axis=1)
        beam_of, in_beams = np.full(len(mesh.tets), -1), np.zeros(mesh.filled.shape)
        middle = self.inside[:, self.inside.shape[1] // 2]
        beam_of[self.elements[every]] = number[self.strut, middle][every]
        cut = some & ~every
        own = even_points(_STEPS).argmax(axis=1)  # the quadrature point that each is nearest to
        for q in range(in_beams.shape[1]):
            share = taken[cut][:, own == q].mean(axis=1)
            in_beams[self.elements[cut], q] = np.minimum(share, 1.0 - FLOOR)
        found = attrs.evolve(mesh, in_beams=in_beams, beam_of=beam_of, beams=beams, flexible=flexible)
        node, turn = np.full((len(whole), self.count + 1), -1), np.full(len(mesh.nodes), -1)
        node[strut, layer], node[strut, layer + 1] = beams[:, 0], beams[:, 2]
        turn[beams[:, 0::2]] = beams[:, 1::2]
        carried, at, shares = self._carried(found, whole, node)
        carriers = np.column_stack([at[:, 0], turn[at[:, 0]], at[:, 1], turn[at[:, 1]]])
        return attrs.evolve(found, carried=carried, carriers=carriers, shares=shares)

    def _sections(self, strut: Array, layer: Array) -> tuple[Array, Array]:
        """Numbers (struts, layers + 1) of the sections between beams, -1 for none, and places (s, 3) in mm.

        strut, layer (e,): of each beam. Struts that meet have one section at their joint.
        """
        count, joints = self.count, len(self.lattice.nodes)
        every = np.empty((len(self.axes.way), count + 1), np.int64)
        every[:, 0], every[:, -1] = self.lattice.struts.T
        every[:, 1:-1] = joints + np.arange(len(self.axes.way) * (count - 1)).reshape(len(self.axes.way), -1)
        used = np.unique(np.concatenate([every[strut, layer], every[strut, layer + 1]]))
        number = np.full(every.max() + 1, -1)
        number[used] = np.arange(len(used))
        at = self.axes.start[:, None] + np.linspace(0.0, 1.0, count + 1)[:, None] * self.axes.way[:, None]
        places = np.empty((len(number), 3))
        places[every] = at
        places[:joints] = self.lattice.nodes
        return number[every], np.asarray(places[used])

    def _carried(self, mesh: Mesh, whole: Array, node: Array) -> tuple[Array, Array, Array]:
        """Carried nodes (c,), the nodes (c, 2) of each one's sections, and the first one's shares (c,).

        Those within whole layers, and those that no solid element supports. node (struts, layers + 1): the
        sections' nodes.
        """
        reached = np.flatnonzero(whole[self.strut[:, None], self.inside].any(axis=1))
        of = mesh.tets[self.elements[reached]]
        pairs = np.unique(np.column_stack([of.ravel(), np.repeat(self.strut[reached], of.shape[1])]), axis=0)
        away, t = self.axes.distances(mesh.nodes[pairs[:, 0]], pairs[:, 1])
        # Of the struts whose elements a node is part of, the one whose axis is nearest carries it.
        order = np.lexsort((away, pairs[:, 0]))
        rows = order[np.unique(pairs[order, 0], return_index=True)[1]]
        carried, strut, at = pairs[rows, 0], pairs[rows, 1], t[rows] * self.count
        if "x" in mesh.symmetry:
            # Nodes in the mirror plane move with a section there, or else they would leave it.
            on = (mesh.nodes[carried, 0] == 0.0) & ~self.halved[strut]
            for end, level in ((0, 0.0), (1, float(self.count))):
                at[on & (self.lattice.nodes[self.lattice.struts[strut, end], 0] == 0.0)] = level
        layer = np.clip(at.astype(int), 0, self.count - 1)
        solid = np.where(mesh.solid[:, None], mesh.resisting, 0.0)[self.elements]
        struts = attrs.evolve(part(mesh, self.elements), filled=solid)
        keep = whole[strut, layer] | (support(struts, self.volumes)[carried] < LEAST_SUPPORT)
        carried, strut, at, layer = carried[keep], strut[keep], at[keep], layer[keep]
        # A node beyond the last beam of its strut moves with that beam's end.
        gap = np.abs(np.arange(self.count) - layer[:, None]) + np.where(whole[strut], 0, 2 * self.count)
        own = gap.argmin(axis=1)
        share = 1.0 - np.clip(at - own, 0.0, 1.0)
        return carried, np.column_stack([node[strut, own], node[strut, own + 1]]), share

    def _flexible(self, strut: Array, layer: Array, zones: Zones) -> Array:
        """Integrals (e, 6) over the layers' sections, see `fem.beams.sections_of`.

        Struts in the mirror plane of a half mesh count twice, as the mesh has half of them.
        """
        found = integrals(self.lattice, strut, self.lattice.struts[strut], layer, self.count, zones)
        return np.asarray(found * np.where(self.halved[strut], 2.0, 1.0)[:, None])


# Layers of meshes that are still in use: all candidates of a unit ask for the same.
_LAYERS: WeakKeyDictionary[Mesh, GraphLayers] = WeakKeyDictionary()


def graph_layers_of(mesh: Mesh, lattice: Lattice) -> GraphLayers:
    """The layers of a mesh that `with_graph_beams` made, of struts of this lattice; kept with the mesh."""
    if mesh not in _LAYERS:
        ends = mesh.nodes[mesh.beams[0, 0::2]]
        joints = lattice.nodes[lattice.struts]
        # A beam is part of the one strut that is no longer by way of its ends.
        length = np.linalg.norm(joints[:, 1] - joints[:, 0], axis=1)
        by_way = np.linalg.norm(joints - ends.mean(axis=0), axis=2).sum(axis=1)
        strut = (by_way / length).argmin()
        layers = round(float(length[strut] / np.linalg.norm(ends[1] - ends[0])))
        _LAYERS[mesh] = GraphLayers(mesh, lattice, layers)
    return _LAYERS[mesh]


def with_graph_beams(
    mesh: Mesh, lattice: Lattice, layers: int, clear: Array, reach_mm: float, zones: Zones
) -> Mesh:
    """A printed mesh with beams in place of the layers of struts that are whole and far from walls.

    layers: at most, of a strut; fewer if a layer would be hardly longer than a rigid zone. clear (n,):
    distance of the nodes in mm from the parts that support struts; reach_mm: distance below which a layer
    stays solid. Sections and then their rotation vectors are nodes added at the end.
    """
    shortest = np.linalg.norm(np.diff(lattice.nodes[lattice.struts], axis=1), axis=2).min()
    rigid = max(zones.stretch, zones.bend) * 2.0 * lattice.node_radii.max()
    parts = GraphLayers(mesh, lattice, max(1, min(layers, int(_BEYOND * shortest / rigid))))
    return parts.replaced(mesh, parts.whole(mesh, clear, reach_mm), zones)
