"""The mesh of a slightly different printed unit: same elements, with nodes, ties and shares moved.

The wall's grid moves to its exact new position. Struts stay, or are swept again with another radius, and
beams get the flexibility of their new sections. Tied nodes of struts keep their position in the wall, with
weights continued to first order. For an element that the wall's profile cuts, the share outside changes as
the profile moves through it.
"""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..design.body import Body, covering
from ..design.dimensions import Dimensions
from ..design.lattice import Lattice, graph_of, with_struts
from ..design.parameters import Unit
from ..errors import InputError
from ..fem.elements import even_points, shape_functions, shape_gradients
from ..fem.embedding import Footholds
from ..meshing.mesh import Mesh, mirror
from ..meshing.morph import shrunk, struts_alone_differ
from ..meshing.quality import check_positive
from ..meshing.settings import MeshSettings
from ..meshing.wall_and_cavity import unmovable
from .beams import Layers, rotation_nodes
from .joints import zones_of
from .lattice import clearance, cuts
from .octants import SweptNodes
from .printed_mesh import Sizes, beam_layers, wall_grid, wall_of
from .strut import is_half_diagonal

# An element that the wall cuts is divided this often along each edge to tell the share outside.
_STEPS = 8
# Half the width, in distances between those points, over which one passes from inside to outside. Narrower,
# the share goes in steps; wider, it reaches beyond the elements that are in the mesh.
_BLUR = 1.0
# Of a length in each of a beam's integrals (`fem.beams.sections_of`).
_POWERS = np.array([-1.0, -3.0, -3.0, -2.0, -1.0, -1.0])


class PrintedMorph:
    """Moves the mesh that `mesh_printed` made of a unit to similar units.

    Work that depends on the mesh alone is done once.
    """

    def __init__(self, mesh: Mesh, drawn: Unit, settings: MeshSettings, body: Body | None = None) -> None:
        """body: as `mesh_printed` takes it. Raises MeshingError where the mesh is not that of the unit."""
        a = drawn.printed
        self.mesh, self.drawn, self._body = mesh, drawn, body
        self._full = body is not None or settings.fraction == "full"
        sizes = Sizes().refined(settings.refine)
        self._grid = wall_grid(a, sizes)
        wall = wall_of(self._grid.membrane, a)
        wall = mirror(wall, "x") if self._full else wall
        self._count = count = len(wall.nodes)
        if len(mesh.nodes) <= count or not np.array_equal(mesh.nodes[:count], wall.nodes):
            raise unmovable("it is not of a printed unit, or has other settings")
        turns = np.unique(mesh.beams[:, 1::2])
        # Rotation vectors of beams are the last nodes, and follow the others.
        self._struts = mesh.nodes[count : len(mesh.nodes) - len(turns)]
        covered = covering(a, body)
        self._graph = graph_of(covered)
        self._lattice = with_struts(self._graph, covered)
        self._swept = SweptNodes(self._lattice, self._struts) if is_half_diagonal(a) else None
        swept = self._swept is not None and len(turns) > 0
        self._layers = Layers(mesh, self._lattice, beam_layers(sizes)) if swept else None
        self._beams = None if self._layers is None else self._layers.of_beams(mesh)
        self._footholds = Footholds.of(wall, mesh.nodes[mesh.tied])
        self._cut, self._outside = self._cut_elements(a)
        self._before = self._shares(mesh.nodes, a, np.arange(len(self._cut)))

    def to(self, other: Unit, checked: bool = True) -> Mesh:
        """The mesh moved to the unit `other`, of as many chambers and cells of the same kind.

        A change of cell or scale first scales the whole mesh. checked: test elements for inversion. Raises
        InputError for struts that cannot be swept again, and MeshingError otherwise.
        """
        mesh, a, b = self.mesh, self.drawn.printed, other.printed
        if a == b:
            return mesh
        if a.kind != b.kind:
            raise unmovable("its lattice is of another kind")
        factor = b.cell / a.cell
        if factor != 1.0 and self._body is not None:
            raise unmovable("a user-defined body does not grow with the cell")
        near = b if factor == 1.0 else shrunk(b, a.cell)
        same_wall = struts_alone_differ(a, near)
        wall = mesh.nodes[: self._count]
        if not same_wall:
            half = wall_of(self._grid.of(near), a)
            wall = (mirror(half, "x") if self._full else half).nodes
        nodes, flexible = self._with_struts(wall, near)
        moved = (nodes != mesh.nodes).any(axis=1)
        filled, weights = mesh.filled, mesh.tied_weights
        rows = np.flatnonzero(moved[mesh.tets[self._cut]].any(axis=1) | (not same_wall))
        if len(rows):
            filled = filled.copy()
            filled[self._cut[rows]] += self._shares(nodes, near, rows) - self._before[rows]
        rows = np.flatnonzero(moved[mesh.tied] | moved[mesh.tied_to].any(axis=1))
        if len(rows):
            weights = weights.copy()
            weights[rows] = self._footholds.moved(wall, nodes[mesh.tied], rows)
        if factor != 1.0 and len(flexible):
            flexible = flexible * factor**_POWERS
        found = attrs.evolve(
            mesh, nodes=factor * nodes, filled=filled, tied_weights=weights, flexible=flexible
        )
        if checked:
            check_positive(found)
        return found

    def _with_struts(self, wall: Array, d: Dimensions) -> tuple[Array, Array]:
        """Nodes (n, 3) in mm of a wall (w, 3) and the struts of other dimensions, and the flexibility (e, 6)
        of beams; raises InputError."""
        mesh, other = self.mesh, with_struts(self._graph, covering(d, self._body))
        struts = self._struts_of(d, other)
        nodes = np.vstack([wall, struts])
        if len(mesh.beams):
            nodes = np.vstack([nodes, rotation_nodes(mesh.beams, nodes)[1]])
        if self._layers is None or self._beams is None or struts is self._struts:
            return nodes, mesh.flexible
        return nodes, self._layers.flexible(other, *self._beams, zones_of(d))

    def _struts_of(self, d: Dimensions, other: Lattice) -> Array:
        """The struts' nodes (n, 3) in mm of another lattice of other dimensions; raises InputError."""
        if self._swept is not None:
            return self._swept.of(other)
        own, sizes = self._lattice, ("junction_radius", "midspan_radius", "growth")
        alike = all(getattr(own, name) == getattr(other, name) for name in sizes)
        if not alike or not np.array_equal(own.node_factors, other.node_factors):
            raise InputError(
                f"the mesh of struts of lattice {d.kind.name!r} cannot be moved to other diameters",
                "[lattice] kind",
                "choose body-centred or body-centred-straight",
            )
        return self._struts

    def _cut_elements(self, d: Dimensions) -> tuple[Array, Array]:
        """Elements (k,) that the wall's profile cuts, and a mask (k, p) of their points outside a body."""
        mesh = self.mesh
        of_struts = np.flatnonzero((mesh.tets >= self._count).any(axis=1))
        at = mesh.nodes[mesh.tets[of_struts]]
        reach = np.ptp(at, axis=1).max(axis=1)
        cut = of_struts[np.abs(clearance(d, at.mean(axis=1))) < reach]
        points = self._points(mesh.nodes, cut)
        outside = np.ones(points.shape[:2], bool)
        for depth in cuts(d, self._body)[1:]:
            outside &= depth(points.reshape(-1, 3)).reshape(outside.shape) > 0
        return cut, outside

    def _points(self, nodes: Array, elements: Array) -> Array:
        shape = shape_functions(even_points(_STEPS), 2)
        return np.asarray(shape @ nodes[self.mesh.tets[elements]])

    def _shares(self, nodes: Array, d: Dimensions, rows: Array) -> Array:
        """Share (k, q) outside the profile of the volume at some cut elements' (k,) quadrature points."""
        at = even_points(_STEPS)
        own = at.argmax(axis=1)
        elements = self._cut[rows]
        points = self._points(nodes, elements)
        slopes = shape_gradients(at, 2).transpose(1, 0, 2).reshape(10, -1)
        edges = nodes[self.mesh.tets[elements]].swapaxes(1, 2) @ slopes
        r, s, t = np.moveaxis(edges.reshape(len(rows), 3, len(at), 3), (3, 1), (0, 3))
        volume = (np.cross(r, s) * t).sum(axis=-1)
        width = np.cbrt(np.abs(volume).mean(axis=1) / 6.0) / _STEPS
        depth = clearance(d, points.reshape(-1, 3)).reshape(volume.shape) / width[:, None]
        way = np.clip(0.5 + 0.5 * depth / _BLUR, 0.0, 1.0)
        share = way**2 * (3.0 - 2.0 * way) * self._outside[rows] * volume
        columns = range(self.mesh.filled.shape[1])
        return np.stack(
            [share[:, own == q].sum(axis=1) / volume[:, own == q].sum(axis=1) for q in columns], axis=1
        )
