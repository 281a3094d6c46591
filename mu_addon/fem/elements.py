"""Tetrahedra and triangles of order 1 and 2: shape functions, quadrature, reference gradients."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..arrays import Array
from ..errors import MeshingError
from ..meshing.mesh import TET_EDGES, TRIANGLE_EDGES
from ..meshing.quality import shapes

if TYPE_CHECKING:
    import warp as wp

    from ..meshing.mesh import Mesh


def tet_quadrature(order: int) -> tuple[Array, Array]:
    """Quadrature of a tetrahedron: barycentric points (q, 4) and weights (q,) that sum to 1/6.

    Exact to degree 1 for elements of order 1, to degree 2 for order 2.

    >>> points, weights = tet_quadrature(2)
    >>> points.shape, round(float(weights.sum()) * 6, 12)
    ((4, 4), 1.0)
    """
    if order == 1:
        return np.full((1, 4), 0.25), np.array([1 / 6])
    b = (5 - np.sqrt(5)) / 20
    return np.full((4, 4), b) + np.eye(4) * (1 - 4 * b), np.full(4, 1 / 24)


def triangle_quadrature(order: int) -> tuple[Array, Array]:
    """Barycentric points (q, 3) and weights (q,), summing to 1/2: degree 2 for order 1, 4 for order 2.

    These degrees integrate the enclosed volume of a (curved) face and its derivatives exactly, so that the
    assembled pressure stiffness of a closed cavity is symmetric. Source of the six-point rule: Dunavant, Int.
    J. Numer. Methods Eng. 21 (1985) 1129.
    """
    if order == 1:
        return np.full((3, 3), 1 / 6) + np.eye(3) * 0.5, np.full(3, 1 / 6)
    a, wa = 0.445948490915965, 0.223381589678011
    b, wb = 0.091576213509771, 0.109951743655322
    points = np.vstack([np.full((3, 3), s) + np.eye(3) * (1 - 3 * s) for s in (a, b)])
    return points, np.repeat([wa, wb], 3) / 2


def triangle_shapes(order: int) -> tuple[Array, Array, Array]:
    """Shape functions (q, n), their reference derivatives (q, n, 2) and weights (q,) of a face.

    n: 3 nodes for order 1, 6 for order 2; the q points are those of `triangle_quadrature`.
    """
    points, weights = triangle_quadrature(order)
    return (
        *shapes(points, TRIANGLE_EDGES, order),
        weights,
    )


@attrs.frozen(eq=False)
class ReferenceGradients:
    """Shape functions' gradients (m, q, n, 3) in 1/mm by the undeformed place, and volumes (m, q) in mm3.

    Of m elements with n nodes, at q quadrature points, each with its part of the volume.
    """

    gradients: Array
    volumes: Array


def reference_gradients(nodes: Array, tets: Array) -> ReferenceGradients:
    """Gradients of the shape functions at the quadrature points of the undeformed tetrahedra.

    nodes (n, 3) mm; tets (m, 4 or 10). Raises MeshingError where an element is inverted.
    """
    order = 1 if tets.shape[1] == 4 else 2
    points, weights = tet_quadrature(order)
    _, dn = shapes(points, TET_EDGES, order)
    jacobian = np.einsum("mni,qnj->mqij", nodes[tets], dn)
    det = np.linalg.det(jacobian)
    if (det <= 0).any():
        bad = np.unique(np.nonzero(det <= 0)[0])
        centre = nodes[tets[bad[0]]].mean(axis=0).round(2)
        raise MeshingError(
            f"{len(bad)} of {len(tets)} elements are inverted",
            f"the first is element {bad[0]} near {tuple(centre)} mm",
            "refine the mesh or smooth the surface there",
        )
    gradients = np.einsum("qnj,mqji->mqni", dn, np.linalg.inv(jacobian))
    return ReferenceGradients(np.ascontiguousarray(gradients), det * weights)


def even_points(steps: int) -> Array:
    """Barycentric centres (q, 4) of a tetrahedron's even subdivision, `steps` to an edge, all inside.

    >>> even_points(1).tolist(), len(even_points(4))
    ([[0.25, 0.25, 0.25, 0.25]], 20)
    """
    whole = np.array(
        [
            (a, b, c, steps - 1 - a - b - c)
            for a in range(steps)
            for b in range(steps - a)
            for c in range(steps - a - b)
        ]
    )
    return (whole + 0.25) / steps


def solid_volumes(mesh: Mesh) -> Array:
    """Filled volumes (m, q) in mm3 of the quadrature points of a mesh's elements.

    Raises MeshingError as `reference_gradients`.
    """
    volumes = reference_gradients(mesh.nodes, mesh.tets).volumes
    return volumes * mesh.filled if mesh.of_printed_body else volumes


def shape_functions(barycentric: Array, order: int) -> Array:
    """Shape functions (q, n) of a tetrahedron of order 1 or 2 at barycentric points (q, 4); n is 4 or 10.

    >>> shape_functions(np.array([[1.0, 0.0, 0.0, 0.0]]), 1).tolist()
    [[1.0, 0.0, 0.0, 0.0]]
    """
    return shapes(barycentric, TET_EDGES, order)[0]


def shape_gradients(barycentric: Array, order: int) -> Array:
    """Derivatives (q, n, 3) of a tetrahedron's shape functions by its three reference coordinates.

    barycentric: points (q, 4); n: 4 nodes for order 1, 10 for order 2.
    """
    return shapes(barycentric, TET_EDGES, order)[1]


class Reference:
    """Gradients and volumes of a mesh's undeformed elements, on a device of Warp as well.

    near: of a mesh of the same elements; only elements with moved nodes are computed again.
    """

    def __init__(self, mesh: Mesh, device: str, near: Reference | None = None) -> None:
        self.mesh, self.device = mesh, device
        self._near = near

    @cached_property
    def at(self) -> ReferenceGradients:
        """Gradients and volumes at the quadrature points; raises MeshingError for an inverted element."""
        mesh, near = self.mesh, self._near
        if near is None:
            return reference_gradients(mesh.nodes, mesh.tets)
        moved = (mesh.nodes != near.mesh.nodes).any(axis=1)[mesh.tets].any(axis=1)
        if not moved.any():
            return near.at
        gradients, volumes = near.at.gradients.copy(), near.at.volumes.copy()
        own = reference_gradients(mesh.nodes, mesh.tets[moved])
        gradients[moved], volumes[moved] = own.gradients, own.volumes
        return ReferenceGradients(gradients, volumes)

    @property
    def resisting_volumes(self) -> Array:
        """Volumes (m, q) in mm3 of the quadrature points, times `Mesh.resisting`."""
        volumes = self.at.volumes
        return np.asarray(volumes * self.mesh.resisting if self.mesh.of_printed_body else volumes)

    @cached_property
    def on_device(self) -> tuple[wp.array, wp.array]:
        """Gradients (m, q, k) and resisting volumes (m, q) as kernels take them."""
        # Imported late: the panels read motions in a Blender that may lack it.
        import warp as wp

        here = self.device == "cpu"
        volumes = np.ascontiguousarray(self.resisting_volumes)
        return (
            wp.array(self.at.gradients, dtype=wp.vec3d, device=self.device, copy=not here),
            wp.array(volumes, dtype=wp.float64, device=self.device, copy=not here),
        )
