"""Quantities read from a deformed mesh: displacements at points, and the bending angle of the tip."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from ..meshing.mesh import AXES, TET_EDGES, Mesh, boundary_faces
from ..meshing.quality import shapes
from .elements import shape_functions, triangle_shapes

Array = np.ndarray[Any, Any]


SETTLED = 1e-9
"""A smaller Newton step in reference coordinates is not followed by another."""


@attrs.frozen(eq=False)
class Probe:
    """Points of a mesh, read in any of its states.

    nodes (p, n): of the element that each point lies in; weights (p, n): the element's shape functions there.
    """

    nodes: Array
    weights: Array

    def displacement(self, u: Array) -> Array:
        """Displacements (p, 3) in mm at the points, of nodal displacements (n, 3)."""
        return np.einsum("pn,pni->pi", self.weights, u[self.nodes])


def probe(mesh: Mesh, points: Array, tolerance: float = 1e-6) -> Probe:
    """Locate points (p, 3) in mm in a mesh; curved elements are inverted by Newton's method.

    tolerance in mm: of the boxes searched. Raises InputError, with its place, for a point that lies in no
    element.
    """
    corners = mesh.nodes[mesh.corners]
    low, high = mesh.nodes[mesh.tets].min(axis=1), mesh.nodes[mesh.tets].max(axis=1)
    found, weights = [], []
    for point in np.atleast_2d(points):
        near = np.nonzero(((point >= low - tolerance) & (point <= high + tolerance)).all(axis=1))[0]
        if len(near) == 0:
            raise _outside(point)
        edges = (corners[near, 1:] - corners[near, :1]).transpose(0, 2, 1)
        local = np.linalg.solve(edges, (point - corners[near, 0])[:, :, None])[:, :, 0]
        if mesh.order == 2:
            local = invert(mesh.nodes[mesh.tets[near]], np.broadcast_to(point, local.shape), local)
        bary = np.column_stack([1 - local.sum(axis=1), local])
        best = int(np.argmax(bary.min(axis=1)))
        if not bary[best].min() >= -1e-4:
            raise _outside(point)
        found.append(mesh.tets[near[best]])
        weights.append(shape_functions(bary[best : best + 1], mesh.order)[0])
    return Probe(np.array(found), np.array(weights))


def invert(nodes: Array, points: Array, local: Array) -> Array:
    """Reference coordinates (e, 3) of a point in each of e curved elements, by Newton's method.

    nodes (e, 10, 3) and points (e, 3) in mm. local (e, 3): where to begin, changed in place; -1 where the map
    is singular on its way.
    """
    left = np.arange(len(local))
    for _ in range(8):
        own = nodes[left]
        bary = np.column_stack([1 - local[left].sum(axis=1), local[left]])
        shape, slope = shapes(bary, TET_EDGES, 2)
        away = points[left] - np.einsum("en,eni->ei", shape, own)
        jacobian = np.einsum("eni,enj->eij", own, slope)
        # A point far outside an element may meet a singular map; such an element is not its home.
        good = np.abs(np.linalg.det(jacobian)) > 1e-12
        local[left[~good]] = -1.0
        left = left[good]
        step = np.clip(np.linalg.solve(jacobian[good], away[good][:, :, None])[:, :, 0], -1, 1)
        local[left] += step
        # The next step would be the square of this one, below the last digit.
        left = left[np.abs(step).max(axis=1, initial=0.0) > SETTLED]
        if not len(left):
            break
    return local


def _outside(point: Array) -> InputError:
    place = tuple(float(c) for c in np.round(point, 3))
    return InputError(
        "a monitored point lies outside the mesh", f"{place} mm", "move the anchor row inside the envelope"
    )


@attrs.frozen(eq=False)
class TipSection:
    """The end plane of a mesh's tip, whose rotation is the bending angle.

    nodes: (t,) that integrate over it. places: theirs (t, 3) at rest in mm. area: the share of the plane that
    each stands for, (t,) in mm2. symmetry: axes whose zero plane is a mirror of the body.
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


def cavity_volume_mm3(mesh: Mesh, u: Array) -> float:
    """Volume in mm3 of the whole body's cavity under displacements (n, 3) in mm; 0 without one."""
    if not len(mesh.cavity):
        return 0.0
    shape, slope, weight = triangle_shapes(mesh.order)
    corners = (mesh.nodes + u)[mesh.cavity]
    place = np.einsum("qn,fni->fqi", shape, corners)
    one, other = np.einsum("qnd,fni->dfqi", slope, corners)
    # Normals point out of the solid, into the cavity; nothing is enclosed by the mirror planes, through 0.
    half = -float(np.einsum("q,fqi,fqi->", weight, place, np.cross(one, other))) / 3.0
    return half * 2 ** len(mesh.symmetry)


def bending_angle_deg(mesh: Mesh, u: Array) -> float:
    """Rotation of the tip's cross-section against the fixed base, positive toward +y, in degrees.

    Area-weighted best-fit rotation (orthogonal Procrustes) of the end plane in the sagittal (y, z) plane: of
    cap and lattice, or of a resolved unit's cap and ends of struts.
    Toward +y because that is how the unit bends when pressure grows; as a right-hand rotation about x it is
    negative. u: (n, 3) in mm. For many states of one mesh, `TipSection` finds the plane once.
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
    if mesh.order == 1:
        return faces, owner, faces
    return (
        faces,
        owner,
        np.array([_middles(mesh.tets[e], face) for e, face in zip(owner, faces, strict=True)]),
    )


def _tip_areas(mesh: Mesh, found: tuple[Array, Array, Array] | None = None) -> tuple[Array, Array]:
    """Tip nodes with weights that integrate over what fills the end plane, a third of a triangle a node.

    On quadratic triangles these nodes are the mid-edge ones, which makes the rule exact to degree 2. found:
    the `tip_faces`.
    """
    faces, owner, carrying = tip_faces(mesh) if found is None else found
    a, b, c = (mesh.nodes[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    if mesh.resolved:
        # Struts end in the same plane beside the cap; what of them lies within it counts once.
        area *= mesh.filled[owner].mean(axis=1)
    weight = np.zeros(len(mesh.nodes))
    np.add.at(weight, carrying, area[:, None] / 3)
    nodes = np.nonzero(weight)[0]
    return nodes, weight[nodes]


def _middles(tet: Array, face: Array) -> Array:
    """Mid-edge nodes (3,) of a face of one ten-node tetrahedron."""
    inside = np.isin(tet[TET_EDGES], face).all(axis=1)
    return tet[4:][inside]
