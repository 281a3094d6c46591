"""Mesh quality: counts, angles, Jacobians, and volumes compared with the design."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from ..design.profile import cavity_volume, membrane_volume
from ..errors import MeshingError
from .mesh import LATTICE, MEMBRANE, TET_EDGES, TRIANGLE_EDGES, Mesh

# Barycentric points and weights (summing to 1) of degree 3, which integrates a curved volume exactly,
# det J being cubic. Source: Keast, Comput. Methods Appl. Mech. Eng. 55 (1986) 339.
_KEAST = np.vstack([np.full((1, 4), 0.25), np.full((4, 4), 1 / 6) + np.eye(4) / 3])
_KEAST_WEIGHTS = np.array([-0.8, 0.45, 0.45, 0.45, 0.45])
# The four points stiffness is integrated at, degree 2.
GAUSS = np.full((4, 4), (5 - np.sqrt(5)) / 20) + np.eye(4) * np.sqrt(0.2)
# Six points of degree 4 on the triangle: Dunavant, Int. J. Numer. Methods Eng. 21 (1985) 1129.
_A, _B = 0.445948490915965, 0.091576213509771
_DUNAVANT = np.vstack([np.full((3, 3), s) + np.eye(3) * (1 - 3 * s) for s in (_A, _B)])
_DUNAVANT_WEIGHTS = np.repeat([0.223381589678011, 0.109951743655322], 3) / 2


@attrs.frozen
class Quality:
    """Quality of a mesh: counts, angles in degrees, Jacobians, volumes in mm3.

    Volumes are of the whole body, with errors relative to the design. min_scaled_jacobian: the least ratio,
    in one element, of the smallest to the largest det J at its four Gauss points: 1 for straight edges, 0 for
    a folded element. inverted: number of folded elements. min_corner_jacobian is that ratio at the corners,
    the worst points of a curved element.
    """

    nodes: int
    tets: int
    membrane_tets: int
    lattice_tets: int
    cavity_faces: int
    min_dihedral_deg: float
    membrane_min_dihedral_deg: float
    lattice_min_dihedral_deg: float
    min_scaled_jacobian: float
    min_corner_jacobian: float
    inverted: int
    membrane_volume_mm3: float
    lattice_volume_mm3: float
    cavity_volume_mm3: float
    membrane_volume_error: float
    lattice_volume_error: float
    cavity_volume_error: float


def mesh_quality(mesh: Mesh, unit: Unit, struts_mm3: float) -> Quality:
    """Counts, angles, Jacobians and volumes of a printed unit's mesh, with the exact volumes of the design.

    Half meshes count as the whole body. struts_mm3: volume of the struts outside the actuator. See `Quality`
    for units.
    """
    d = unit.printed
    exact = {"membrane": membrane_volume(d), "lattice": struts_mm3, "cavity": cavity_volume(d)}
    copies = 2 ** len(mesh.symmetry)
    at_points = _determinants(mesh, GAUSS)
    volumes = element_volumes(mesh) * (at_points * mesh.filled).sum(axis=1) / at_points.sum(axis=1)
    measured = {
        "membrane": copies * float(volumes[mesh.region == MEMBRANE].sum()),
        "lattice": copies * float(volumes[mesh.region == LATTICE].sum()),
        "cavity": copies * cavity_enclosed(mesh),
    }
    angles = dihedral_angles(mesh).min(axis=1)
    low, high = at_points.min(axis=1), at_points.max(axis=1)
    return Quality(
        nodes=len(mesh.nodes),
        tets=len(mesh.tets),
        membrane_tets=int(np.count_nonzero(mesh.region == MEMBRANE)),
        lattice_tets=int(np.count_nonzero(mesh.region == LATTICE)),
        cavity_faces=len(mesh.cavity),
        min_dihedral_deg=float(angles.min()),
        membrane_min_dihedral_deg=float(angles[mesh.region == MEMBRANE].min()),
        lattice_min_dihedral_deg=float(angles[mesh.region == LATTICE].min()),
        min_scaled_jacobian=float((low / np.abs(high)).min()),
        min_corner_jacobian=float(folded_corners(mesh).min()),
        inverted=len(inverted(mesh)),
        **{f"{name}_volume_mm3": value for name, value in measured.items()},
        **{f"{name}_volume_error": value / exact[name] - 1 for name, value in measured.items()},
    )


def inverted(mesh: Mesh) -> Array:
    """Numbers (k,) of the elements with det J <= 0, or not a number, at a Gauss point, the worst first."""
    determinants = _determinants(mesh, GAUSS).min(axis=1)
    bad = np.flatnonzero(~(determinants > 0))
    return np.asarray(bad[np.argsort(determinants[bad], kind="stable")])


def check_positive(mesh: Mesh) -> None:
    """Raise MeshingError, with number and place, if any element is inverted at a Gauss point."""
    bad = inverted(mesh)
    if len(bad):
        worst = bad[0]
        centre = mesh.nodes[mesh.corners[worst]].mean(axis=0)
        region = "membrane" if mesh.region[worst] == MEMBRANE else "lattice"
        raise MeshingError(
            f"{len(bad)} of {len(mesh.tets)} elements are inverted",
            f"the worst in the {region} at x, y, z = {centre[0]:.2f}, {centre[1]:.2f}, {centre[2]:.2f} mm",
            "refine the mesh",
        )


def folded_corners(mesh: Mesh) -> Array:
    """Least det J at a corner over the largest |det J| in the element, (m,).

    The largest is over corners and Gauss points. 1 for straight edges, 0 where two curved edges are tangent,
    negative for a folded element.
    """
    determinants = _determinants(mesh, np.vstack([np.eye(4), GAUSS]))
    return np.asarray(determinants[:, :4].min(axis=1) / np.abs(determinants).max(axis=1))


def element_volumes(mesh: Mesh) -> Array:
    """Volumes (m,) in mm3 of the elements, curved ones exactly."""
    return _determinants(mesh, _KEAST) @ _KEAST_WEIGHTS / 6


def cavity_enclosed(mesh: Mesh) -> float:
    """Volume in mm3 between the cavity surface and the mirror planes, by the divergence theorem.

    Mirror planes through the origin contribute 0, so the faces of a cavity in a half or quarter mesh suffice.
    """
    shape, gradient = shapes(_DUNAVANT, TRIANGLE_EDGES, mesh.order)
    x = mesh.nodes[mesh.cavity]
    at = np.einsum("qn,fnd->fqd", shape, x)
    tangents = np.einsum("qnr,fnd->fqrd", gradient, x)
    normal = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    # The faces' normals point into the cavity, against the outward normals of the theorem.
    return -float(np.einsum("fqd,fqd,q->", at, normal, _DUNAVANT_WEIGHTS)) / 3


def dihedral_angles(mesh: Mesh) -> Array:
    """The six dihedral angles (m, 6) in degrees of each element, taken as straight-sided.

    Column e, with corners i, j = TET_EDGES[e], is the angle between the faces opposite to i and j.
    """
    x = mesh.nodes[mesh.corners]
    # The gradient of a corner's barycentric coordinate is normal to the face opposite.
    inverse = np.linalg.inv(x[:, 1:] - x[:, :1])
    gradient = np.concatenate([-inverse.sum(axis=2)[:, None], inverse.transpose(0, 2, 1)], axis=1)
    gradient /= np.linalg.norm(gradient, axis=2, keepdims=True)
    i, j = TET_EDGES.T
    cosine = -np.einsum("med,med->me", gradient[:, i], gradient[:, j])
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def _determinants(mesh: Mesh, points: Array) -> Array:
    """det J (m, q), six times a volume in mm3, at barycentric points (q, 4)."""
    _, gradient = shapes(points, TET_EDGES, mesh.order)
    return np.asarray(np.linalg.det(np.einsum("mnd,qnr->mqdr", mesh.nodes[mesh.tets], gradient)))


def shapes(points: Array, edges: Array, order: int) -> tuple[Array, Array]:
    """Lagrange functions (q, n) of a simplex and their derivatives (q, n, d), at barycentrics (q, d + 1).

    edges (e, 2): in the order of the mid-edge nodes; order: 1 or 2. Derivatives are by barycentric
    coordinates 1 to d.
    """
    corner = np.vstack([-np.ones(points.shape[1] - 1), np.eye(points.shape[1] - 1)])
    if order == 1:
        return points, np.broadcast_to(corner, (len(points), *corner.shape))
    i, j = edges.T
    a, b = points[:, i, None], points[:, j, None]
    shape = np.hstack([points * (2 * points - 1), 4 * points[:, i] * points[:, j]])
    gradient = np.concatenate(
        [(4 * points[:, :, None] - 1) * corner, 4 * (a * corner[j] + b * corner[i])], axis=1
    )
    return shape, gradient
