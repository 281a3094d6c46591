"""Quantities read from a deformed mesh: displacements at points, and the volume of its cavity."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..meshing.mesh import Mesh
from .elements import reference_gradients, triangle_shapes
from .embedding import Probe, embed

MIRROR = np.array([-1.0, 1.0, 1.0])
"""Factors on a vector mirrored in the plane x = 0."""
# A point nearer to the mesh than that lies in it.
_ON_SURFACE_MM = 1e-4


def numbers_of(mesh: Mesh, points: Array) -> Array:
    """Numbers (p,) of a printed body's nodes at points (p, 3) in mm; raises InputError where none is."""
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
    volume = reference.volumes * mesh.filled[rows] if mesh.of_printed_body else reference.volumes
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


def probe(mesh: Mesh, points: Array) -> Probe:
    """Locate points (p, 3), or one (3,), in mm in a mesh.

    Raises InputError, with its place, for a point that lies in no element.
    """
    points = np.atleast_2d(points)
    found = embed(mesh, points)
    for point in points[(found.outside_mm > _ON_SURFACE_MM) | found.mirrored]:
        place = tuple(float(c) for c in np.round(point, 3))
        raise InputError(
            "a monitored point lies outside the mesh",
            f"{place} mm",
            "move the anchor row inside the envelope",
        )
    return Probe(found.nodes, found.weights)


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
