"""An eighth of a printed lattice cell as tetrahedra; its mirror images are the whole lattice."""

from __future__ import annotations

from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import described
from ..design.strut_cell import Facets, StrutCell, depth_below_surface, octant_surface
from ..errors import MeshingError
from ..fem.elements import even_points, shape_functions
from ..fem.laws import NeoHooke
from ..fem.materials import Materials
from ..meshing.mesh import Mesh, pieces
from ..meshing.surface import mesh_surface

# Points of an element at which it is asked whether it lies in the skin: a corner's share of barycentric
# coordinates in steps of a quarter, which makes 20.
_STEPS = 4

# About one mesh in thirty has an element that is turned over as its side is pressed flat; a tighter
# tolerance, tried next, makes another.
_TRIES = (1.0, 0.8, 0.6, 0.4)


@attrs.frozen
class CellMeshSettings:
    """Element sizes of a cell's mesh; raises InputError for a value out of bounds. facets: of the surface."""

    order: int = described("order", 2, "order of the elements", low=1, high=2).field()
    per_diameter: float = described(
        "per_diameter", 4.0, "elements across the thinnest printed strut", low=0.5, high=20.0
    ).field()
    facets: Facets = attrs.field(factory=lambda: Facets(around=16, along=20))
    tolerance: float = described(
        "tolerance", 0.02, "distance from the cell's surface as a share of an element", low=1e-4, high=0.2
    ).field()


def mesh_cell(cell: StrutCell, settings: CellMeshSettings | None = None, cache: Path | None = None) -> Mesh:
    """Tetrahedra of one eighth of a printed cell, [0, size/2]^3 mm; nothing is clamped.

    Nodes of its flat sides lie exactly on the six planes. Cells that differ in size only have the same
    mesh, scaled, and with a folder `cache` it is made once. Raises InputError and MeshingError.
    """
    s = settings or CellMeshSettings()
    half = cell.half_mm
    vertices, triangles = octant_surface(cell, s.facets)
    edge = round(2 * _thinnest(cell) / half / s.per_diameter, 9)
    for share in _TRIES:
        try:
            mesh = mesh_surface(
                # Rounded so that scaled cells are one input.
                np.round(vertices / half, 12),
                triangles,
                edge,
                epsilon_mm=round(share * s.tolerance * edge, 12),
                order=s.order,
                cache=cache,
            )
            break
        except MeshingError as error:
            failed = error
    else:
        raise MeshingError(failed.what, f"cell mesh, in halves of its size: {failed.where}", failed.remedy)
    _require_faces(mesh)
    return attrs.evolve(mesh, nodes=mesh.nodes * half)


def cell_materials(cell: StrutCell, mesh: Mesh, modulus_MPa: float, poisson: float) -> Materials:
    """Neo-Hookean resin in every element of a cell's mesh, stiffer in the cell's skin.

    modulus_MPa: Young's modulus of the core; poisson: Poisson's ratio of both. Elements partly in the skin
    get both by volume. Raises InputError for moduli that are not admissible.
    """
    count = len(mesh.tets)
    core = Materials.neo_hooke(np.full(count, modulus_MPa), np.full(count, poisson))
    if cell.skin_depth_mm == 0.0 or cell.skin_factor == 1.0:
        return core
    skin = NeoHooke.parameters(np.array([modulus_MPa * cell.skin_factor]), np.array([poisson]))
    return core.blended(skin_share(cell, mesh), NeoHooke, skin)


def skin_share(cell: StrutCell, mesh: Mesh) -> Array:
    """Share (m,), 0 to 1, of each element's volume within the skin depth of the printed surface.

    By 20 points in each element, so in steps of a twentieth.
    """
    at = even_points(_STEPS)
    points = np.einsum("qn,mnd->mqd", shape_functions(at, mesh.order), mesh.nodes[mesh.tets])
    depth = depth_below_surface(cell, points.reshape(-1, 3)).reshape(points.shape[:2])
    return np.asarray((depth < cell.skin_depth_mm).mean(axis=1))


def _thinnest(cell: StrutCell) -> float:
    """Least radius in mm of the printed struts."""
    radii = cell.radius(np.linspace(0.0, 1.0, 33))
    return float(radii.min()) + min(cell.offset_xy_mm, cell.offset_z_mm)


def _require_faces(mesh: Mesh) -> None:
    """Raise MeshingError unless a mesh is in one piece and reaches the six planes of its unit cube."""
    count = len(np.unique(pieces(mesh)))
    if count > 1:
        raise MeshingError(f"the mesh of a cell falls into {count} pieces", "cell mesh", "refine it")
    for axis, name in enumerate("xyz"):
        for plane in (0.0, 1.0):
            if not (mesh.nodes[:, axis] == plane).any():
                raise MeshingError(
                    f"the mesh of a cell does not reach its side {name} = {plane:g} size/2",
                    "cell mesh",
                    "refine it",
                )
