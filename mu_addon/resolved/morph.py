"""The mesh of a slightly different printed unit: the same elements, their nodes, ties and shares moved.

The wall's grid goes to its exact new place. Struts stay where they are, or are swept again with another
radius. Nodes of struts hold onto the wall at the same places of it, with weights continued to first order;
and of an element that the wall's profile cuts, the share outside changes as the profile moves through it.
"""

from __future__ import annotations

import attrs
import numpy as np

from ..design.body import Body, covering
from ..design.dimensions import Dimensions
from ..design.parameters import Unit
from ..errors import MeshingError
from ..fem.elements import even_points, shape_functions, shape_gradients
from ..fem.embedding import Footholds
from ..meshing.mesh import Array, Mesh, mirror
from ..meshing.morph import shrunk
from ..meshing.quality import check_positive
from ..meshing.settings import MeshSettings
from .lattice import clearance, cuts
from .octants import resized_nodes
from .unit import Sizes, wall_grid, wall_of

# An element that the wall cuts is divided this often along each edge to tell the share outside.
_STEPS = 8
# Half the width, in distances between those points, over which one passes from inside to outside. Narrower,
# the share goes in steps; wider, it reaches beyond the elements that are in the mesh.
_BLUR = 1.0


class PrintedMorph:
    """Moves the mesh that `mesh_printed` made of a unit to other units near to it.

    What depends on the mesh alone is done once.
    """

    def __init__(self, mesh: Mesh, drawn: Unit, settings: MeshSettings, body: Body | None = None) -> None:
        """body: as `mesh_printed` takes it. Raises MeshingError where the mesh is not that of the unit."""
        a = drawn.printed
        self.mesh, self.drawn, self._body = mesh, drawn, body
        self._full = body is not None or settings.fraction == "full"
        self._grid = wall_grid(a, Sizes().refined(settings.refine))
        wall = wall_of(self._grid.membrane, a)
        wall = mirror(wall, "x") if self._full else wall
        self._count = count = len(wall.nodes)
        if len(mesh.nodes) <= count or not np.array_equal(mesh.nodes[:count], wall.nodes):
            raise _failed("it is no printed unit's, or has other settings")
        self._struts = mesh.nodes[count:]
        self._footholds = Footholds.of(wall, mesh.nodes[mesh.tied])
        self._cut, self._outside = self._cut_elements(a)
        self._before = self._shares(mesh.nodes, a)

    def to(self, other: Unit, checked: bool = True) -> Mesh:
        """The mesh moved to the unit `other`, of as many chambers and cells of the same kind.

        Another cell or scale first scales all of it. checked: whether elements are looked at for inversion.
        Raises InputError for struts that cannot be swept again, and MeshingError otherwise.
        """
        mesh, a, b = self.mesh, self.drawn.printed, other.printed
        if a == b:
            return mesh
        if a.kind != b.kind:
            raise _failed("its lattice is of another kind")
        factor = b.cell / a.cell
        if factor != 1.0 and self._body is not None:
            raise _failed("a user-defined body does not grow with the cell")
        near = b if factor == 1.0 else shrunk(b, a.cell)
        wall = wall_of(self._grid.of(near), a)
        wall = mirror(wall, "x") if self._full else wall
        struts = resized_nodes(self._covering(a), self._covering(near), self._struts)
        nodes = np.vstack([wall.nodes, struts])
        filled = mesh.filled.copy()
        filled[self._cut] += self._shares(nodes, near) - self._before
        found = attrs.evolve(
            mesh,
            nodes=factor * nodes,
            filled=filled,
            tied_weights=self._footholds.moved(wall.nodes, nodes[mesh.tied]),
        )
        if checked:
            check_positive(found)
        return found

    def _covering(self, d: Dimensions) -> Dimensions:
        return d if self._body is None else covering(d, self._body)

    def _cut_elements(self, d: Dimensions) -> tuple[Array, Array]:
        """Elements (k,) that the wall's profile cuts, and which of their points a body leaves (k, p)."""
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
        return np.einsum("qn,mnd->mqd", shape, nodes[self.mesh.tets[elements]])

    def _shares(self, nodes: Array, d: Dimensions) -> Array:
        """Share (k, q) outside the profile of the volume at the cut elements' quadrature points."""
        at = even_points(_STEPS)
        own = at.argmax(axis=1)
        corners = nodes[self.mesh.tets[self._cut]]
        points = self._points(nodes, self._cut)
        volume = np.linalg.det(np.einsum("mnd,qnr->mqdr", corners, shape_gradients(at, 2)))
        width = np.cbrt(np.abs(volume).mean(axis=1) / 6.0) / _STEPS
        depth = clearance(d, points.reshape(-1, 3)).reshape(volume.shape) / width[:, None]
        way = np.clip(0.5 + 0.5 * depth / _BLUR, 0.0, 1.0)
        share = way**2 * (3.0 - 2.0 * way) * self._outside * volume
        columns = range(self.mesh.filled.shape[1])
        return np.stack(
            [share[:, own == q].sum(axis=1) / volume[:, own == q].sum(axis=1) for q in columns], axis=1
        )


def _failed(why: str) -> MeshingError:
    return MeshingError(
        f"the mesh of a printed unit cannot be moved: {why}", "unit", "mesh the other unit anew"
    )
