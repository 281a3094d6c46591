"""Faces of a mesh that outside bodies can touch, and the exposed part of each."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..meshing.mesh import AXES, Mesh, boundary_faces
from .self_intersection import with_middles

# Parts filled by less are cut away: a printed mesh keeps this much of them, so that no motion is without
# stiffness.
_CUT_AWAY = 0.02


@attrs.frozen(eq=False)
class OuterFaces:
    """Faces that can be touched: their nodes (f, 3 | 6), and the exposed share (f, 3) of each third.

    A third of a face is nearest to one of its corners. All is exposed in a mesh whose parts do not overlap;
    the part of a strut inside a wall or a waveguide is not.
    """

    nodes: Array
    bare: Array

    def of(self, rows: Array) -> OuterFaces:
        """Some of the faces, by number or by a mask (f,)."""
        return OuterFaces(self.nodes[rows], self.bare[rows])


def outer_faces(mesh: Mesh) -> OuterFaces:
    """The boundary faces of a mesh without those of cavity, base and mirror planes.

    Of a printed mesh they count as far as the elements behind them do: `filled` at the quadrature point that
    is nearest to a face's corner is the bare share of that third. Faces with all nodes tied lie inside the
    part they are tied to.
    """
    faces, owner = free_boundary(mesh)
    cavity = {tuple(f) for f in np.sort(mesh.cavity_corners, axis=1).tolist()}
    keep = np.array([tuple(f) not in cavity for f in np.sort(faces[:, :3], axis=1).tolist()])
    bare = np.ones((len(faces), 3))
    if mesh.of_printed_body:
        # Each quadrature point is nearest to one corner of its element.
        corner = (mesh.tets[owner][:, None, :4] == faces[:, :3, None]).argmax(axis=2)
        bare = np.take_along_axis(mesh.filled[owner], corner, axis=1)
        bare[bare < _CUT_AWAY] = 0.0
        keep &= bare.any(axis=1) & ~np.isin(faces, mesh.tied).all(axis=1)
    return OuterFaces(faces[keep], bare[keep])


def free_boundary(mesh: Mesh) -> tuple[Array, Array]:
    """Boundary faces (f, 3 | 6) that lie neither in the base nor in a mirror plane, and their elements (f,).

    They have six nodes where the mesh is quadratic.
    """
    faces, owner = boundary_faces(mesh.tets)
    keep = ~np.isin(faces, mesh.base).all(axis=1)
    for axis in mesh.symmetry:
        keep &= ~(mesh.nodes[faces, AXES.index(axis)] == 0.0).all(axis=1)
    faces, owner = faces[keep], owner[keep]
    return (with_middles(faces, mesh.tets[owner]) if mesh.order == 2 else faces), owner
