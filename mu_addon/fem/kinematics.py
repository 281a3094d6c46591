"""Quantities read from a deformed mesh: displacements at points, and the volume of its cavity."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from ..meshing.mesh import TET_EDGES, Mesh
from ..meshing.quality import shapes
from .elements import reference_gradients, shape_functions, triangle_shapes

Array = np.ndarray[Any, Any]


MIRROR = np.array([-1.0, 1.0, 1.0])
"""Factors on a vector mirrored in the plane x = 0."""
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


def numbers_of(mesh: Mesh, points: Array) -> Array:
    """Numbers (p,) of a resolved mesh's nodes at points (p, 3) in mm; raises InputError where none is."""
    from scipy.spatial import cKDTree

    away, found = cKDTree(mesh.nodes).query(points)
    if away.max() > 1e-6 * np.ptp(mesh.nodes[:, 2]):
        x, y, z = points[away.argmax()].round(3).tolist()
        raise InputError(
            f"({x:g}, {y:g}, {z:g}) mm is not a node of the lattice's mesh",
            "path, [waveguide] row",
            "choose nodes within the envelope, and a lattice with a node at the cells' centres",
        )
    return np.asarray(found)


def mean_gradients(mesh: Mesh, u: Array, nodes: Array) -> Array:
    """Mean deformation gradient (k, 3, 3) of the elements around each of some different nodes (k,).

    u: displacements (n, 3) in mm. In the mirror plane of a half mesh the image's elements count, too.
    """
    place = np.full(len(mesh.nodes), -1)
    place[nodes] = np.arange(len(nodes))
    rows = np.flatnonzero((place[mesh.tets] >= 0).any(axis=1))
    reference = reference_gradients(mesh.nodes, mesh.tets[rows])
    volume = reference.volumes * mesh.filled[rows] if mesh.resolved else reference.volumes
    weighted = np.einsum("eai,eqaj,eq->eij", u[mesh.tets[rows]], reference.gradients, volume)
    row, corner = np.nonzero(place[mesh.tets[rows]] >= 0)
    at = place[mesh.tets[rows]][row, corner]
    found, total = np.zeros((len(nodes), 3, 3)), np.zeros(len(nodes))
    np.add.at(found, at, weighted[row])
    np.add.at(total, at, volume.sum(axis=1)[row])
    found /= np.maximum(total, 1e-300)[:, None, None]
    if "x" in mesh.symmetry:
        on = mesh.nodes[nodes, 0] == 0.0
        found[on] = (found[on] + MIRROR[:, None] * found[on] * MIRROR) / 2.0
    return np.asarray(found + np.eye(3))


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

    nodes (e, 10, 3) and points (e, 3) in mm. local (e, 3): start, changed in place; -1 if the map becomes
    singular.
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
