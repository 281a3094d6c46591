"""Bending angle of a deformed mesh: the rotation of the end plane of its tip."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..meshing.mesh import AXES, Mesh, boundary_faces
from .self_intersection import with_middles


@attrs.frozen(eq=False)
class TipSection:
    """The end plane of a mesh's tip, whose rotation is the bending angle.

    nodes: (t,) that integrate over it. places: their positions (t, 3) at rest in mm. area: the part of the
    plane of each node, (t,) in mm2. symmetry: axes whose zero plane is a mirror of the body.
    """

    nodes: Array
    places: Array
    area: Array
    symmetry: tuple[str, ...] = ()

    @classmethod
    def of(cls, mesh: Mesh, faces: tuple[Array, Array, Array] | None = None) -> TipSection:
        """The end plane of a mesh, at the height of its first `tip` node; faces: its `tip_faces`, if
        known."""
        nodes, area = _tip_areas(mesh, faces)
        return cls(nodes, mesh.nodes[nodes], area, mesh.symmetry)

    def angle_deg(self, u: Array) -> float:
        """Bending angle in degrees under nodal displacements (n, 3) in mm, see `bending_angle_deg`."""
        area, before = self.area, self.places[:, 1:]
        after = before + u[self.nodes, 1:]
        before = before - np.average(before, axis=0, weights=area)
        after = after - np.average(after, axis=0, weights=area)
        sine = (area * (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])).sum()
        cosine = (area[:, None] * before * after).sum()
        return float(-np.degrees(np.arctan2(sine, cosine)))

    def middle_mm(self, u: Array) -> Array:
        """The area's middle (3,) in mm of the whole body's end plane under displacements (n, 3) in mm."""
        middle = np.average(self.places + u[self.nodes], axis=0, weights=self.area)
        middle[[AXES.index(axis) for axis in self.symmetry]] = 0.0
        return middle


def bending_angle_deg(mesh: Mesh, u: Array) -> float:
    """Rotation of the tip's cross-section against the fixed base, positive toward +y, in degrees.

    Area-weighted best-fit rotation (orthogonal Procrustes) of the end plane in the plane of bending (y, z):
    of cap and lattice, or of a printed unit's cap and ends of struts. Positive toward +y, to which the unit
    bends under growing pressure; as a right-hand rotation about x it is negative. u: (n, 3) in mm. For many
    states of one mesh, `TipSection` finds the plane once.
    """
    return TipSection.of(mesh).angle_deg(u)


def tip_faces(mesh: Mesh) -> tuple[Array, Array, Array]:
    """Faces of the tip's end plane: corners (f, 3), elements (f,), and the nodes (f, 3) that integrate.

    They depend on the elements alone, and not on where exactly the nodes are: found once for a mesh and those
    morphed from it.
    """
    height = mesh.nodes[mesh.tip[0], 2]
    faces, owner = boundary_faces(mesh.tets)
    on_tip = (mesh.nodes[faces][:, :, 2] == height).all(axis=1)
    faces, owner = faces[on_tip], owner[on_tip]
    return faces, owner, faces if mesh.order == 1 else with_middles(faces, mesh.tets[owner])[:, 3:]


def _tip_areas(mesh: Mesh, found: tuple[Array, Array, Array] | None = None) -> tuple[Array, Array]:
    """Tip nodes with weights that integrate over the end plane's solid part, a third of a triangle each.

    On quadratic triangles these nodes are the mid-edge ones, which makes the rule exact to degree 2. found:
    the `tip_faces`.
    """
    faces, owner, carrying = tip_faces(mesh) if found is None else found
    a, b, c = (mesh.nodes[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    if mesh.of_printed_body:
        # Struts end in the same plane beside the cap; what of them lies within it counts once.
        area *= mesh.filled[owner].mean(axis=1)
    weight = np.zeros(len(mesh.nodes))
    np.add.at(weight, carrying, area[:, None] / 3)
    nodes = np.nonzero(weight)[0]
    return nodes, weight[nodes]
