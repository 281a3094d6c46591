"""Dead loads as nodal forces, for `Model.load`: weight and tractions."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..meshing.mesh import Mesh
from .elements import shape_functions, solid_volumes, tet_quadrature, triangle_shapes

STANDARD_GRAVITY = 9806.65  # mm/s2


def gravity(
    mesh: Mesh,
    density_tonne_per_mm3: float | Array,
    direction: Array,
    g_mm_per_s2: float = STANDARD_GRAVITY,
) -> Array:
    """Weight as consistent nodal forces (n, 3) in N, for `Model.load`.

    density_tonne_per_mm3: of the undeformed body, one number or one an element (m,); 1 g/ml is 1e-9.
    direction (3,): of gravity, of any length. g_mm_per_s2: standard gravity by default.
    """
    down = np.asarray(direction, float)
    return nodal_masses(mesh, density_tonne_per_mm3)[:, None] * (g_mm_per_s2 * down / np.linalg.norm(down))


def nodal_masses(mesh: Mesh, density: float | Array) -> Array:
    """Mass (n,) of each node, in units of density times mm3; density: one number or one an element (m,)."""
    points, _ = tet_quadrature(mesh.order)
    volumes = solid_volumes(mesh) @ shape_functions(points, mesh.order)
    mass = np.broadcast_to(density, len(mesh.tets))[:, None] * volumes
    return np.bincount(mesh.tets.ravel(), mass.ravel(), len(mesh.nodes))


def traction(mesh: Mesh, faces: Array, traction_MPa: Array) -> Array:
    """A traction (3,) in MPa of the undeformed faces (f, 3 | 6) as consistent nodal forces (n, 3) in N.

    The traction keeps its direction and its force as the body deforms.
    """
    shape, derivative, weight = triangle_shapes(mesh.order)
    tangents = np.einsum("fni,qnk->kfqi", mesh.nodes[faces], derivative)
    area = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=-1) * weight
    of_node = np.bincount(np.ravel(faces), (area @ shape).ravel(), len(mesh.nodes))
    return of_node[:, None] * np.asarray(traction_MPa, float)
