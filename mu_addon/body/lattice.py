"""Struts of a unit: octants side by side in the envelope, as far as they lie outside the actuator."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from ..arrays import Array
from ..design import shapes
from ..design.body import Body, covering
from ..design.dimensions import Dimensions
from ..design.lattice import filled, lattice_of
from ..design.parameters import Unit
from ..design.profile import outer_polygon, outer_radius, outer_slope
from ..design.solid import QUALITY, lattice_solid
from ..design.strut_cell import StrutCell
from ..design.surface import winding_number
from ..fem.elements import even_points, reference_gradients, shape_functions, shape_gradients
from ..homogenize.cell_mesh import CellMeshSettings, mesh_cell
from ..meshing.mesh import FLIPPED_TET, TET_FACES, Mesh, mirror
from ..meshing.tiling import tiled
from .graph_axes import graded_about_axes
from .octants import graded_nodes
from .strut import is_half_diagonal, strut_mesh

Depth = Callable[[Array], Array]

# An element is divided this often along each edge to tell which part of it lies outside the actuator.
_STEPS = 6
# Elements filled by less are left out.
_LEAST = 1e-3
# Least share of a quadrature point of an element of which anything is filled.
FLOOR = 0.01
# A node of which less than this is filled has next to no stiffness: it is tied.
LEAST_SUPPORT = 0.02


def struts(
    d: Dimensions,
    rings: int,
    layers: int,
    full: bool = False,
    cache: Path | None = None,
    body: Body | None = None,
) -> Mesh:
    """Quadratic tetrahedra of a unit's struts at x >= 0, or with `full` of all, outside the wall.

    rings, layers: as in `strut_mesh`; for other kinds of lattice pytetwild meshes the octant (`mesh_cell`)
    with `rings` elements to half a strut's diameter, and the folder `cache` keeps it. body: a closed surface
    that cuts the lattice in place of its box. The mesh has `filled`, and no element that is all cut away.
    """
    d = covering(d, body)
    if is_half_diagonal(d):
        octant = strut_mesh(d, rings, layers)
    else:
        cell = StrutCell(d.kind, d.cell, d.junction_diameter / 2.0, d.midspan_diameter / 2.0)
        octant = mesh_cell(cell, CellMeshSettings(per_diameter=float(rings)), cache)
    half = d.cell / 2.0
    (_, x1), (y0, y1), (z0, z1) = d.bounds
    counts = (round(x1 / half), round((y1 - y0) / half), round((z1 - z0) / half))
    right = tiled(octant, counts, (half,) * 3)
    nodes = right.nodes * [-1.0, 1.0, 1.0] + [x1, y0, z0]
    tets = right.tets[:, FLIPPED_TET]
    for axis, planes in enumerate(((0.0, x1), (y0, y1), (z0, z1))):
        for plane in planes:
            nodes[np.abs(nodes[:, axis] - plane) < 1e-7 * half, axis] = plane
    mesh = attrs.evolve(right, nodes=nodes, tets=tets, symmetry=("x",))
    if full:
        mesh = mirror(mesh, "x")
    if d.grading is not None:
        if is_half_diagonal(d):
            mesh = attrs.evolve(mesh, nodes=graded_nodes(d, mesh.nodes))
        else:
            mesh = graded_about_axes(d, mesh)
    return filled_outside(mesh, cuts(d, body))


def strut_volume_mm3(unit: Unit, body: Body | None = None) -> float:
    """Volume in mm3 of a unit's struts outside its actuator, of the drawn solid by manifold3d."""
    from manifold3d import Manifold, OpType

    d = covering(unit.printed, body)
    facets, lattice, share = QUALITY["export"], lattice_of(d), 1.0
    profile = shapes.revolved(outer_polygon(d, facets.along_arc), facets.around_axis)
    if body is None and lattice.factors is None:
        # The cells that reach beyond x = 0, cut there: twice them is the whole, in two thirds of the time.
        right = lattice.cells[lattice.cells[:, 0] > -d.kind.divisions]
        lattice = filled(d.kind, right, d.cell, d.junction_diameter / 2.0, d.midspan_diameter / 2.0)
        low, high = np.array(d.bounds).T
        profile, share = profile + shapes.box(low - 1.0, high * [0.0, 1.0, 1.0] + [0.0, 1.0, 1.0]), 2.0
    solid = lattice_solid(d, lattice, facets)
    if body is not None:
        solid = solid ^ body.manifold
    return share * float(Manifold.batch_boolean([solid, profile], OpType.Subtract).volume())


def cuts(d: Dimensions, body: Body | None) -> list[Depth]:
    """Boundaries of the struts: functions of points (n, 3) in mm, positive (n,) where the struts remain."""
    found: list[Depth] = [lambda points: clearance(d, points)]
    if body is not None:
        low, high = body.bounds

        def inside(points: Array) -> Array:
            kept = np.full(len(points), -1.0)
            near = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
            kept[near] = winding_number(body.vertices, body.triangles, points[near]) - 0.5
            return kept

        found.append(inside)
    return found


def clearance(d: Dimensions, points: Array) -> Array:
    """Distance (n,) in mm of points (n, 3) in mm from the actuator's outer profile, negative inside it.

    To first order: along the profile's normal at the point's height.
    """
    z = np.clip(points[:, 2], 0.0, d.height)
    radius = np.hypot(points[:, 0], points[:, 1])
    return np.asarray((radius - outer_radius(d, z)) / np.hypot(1.0, outer_slope(d, z)))


def filled_outside(mesh: Mesh, kept: list[Depth], drop: bool = True) -> Mesh:
    """The mesh with the filled shares of its elements' volume: where every function of `kept` is positive.

    kept: of points (n, 3) in mm, (n,) each. Elements without a filled share are removed with their nodes,
    unless `drop` is off.
    """
    at = even_points(_STEPS)
    own = at.argmax(axis=1)  # the quadrature point that each is nearest to
    lies_in = np.min([depth(mesh.nodes) for depth in kept], axis=0) > 0
    filled = np.repeat(lies_in[mesh.tets].all(axis=1)[:, None].astype(float), own.max() + 1, axis=1)
    # An element may bulge over a side that its nodes do not cross, by less than it is long.
    reach = np.ptp(mesh.nodes[mesh.tets], axis=1).max(axis=1)
    middle = mesh.nodes[mesh.tets].mean(axis=1)
    near = np.abs(np.min([depth(middle) for depth in kept], axis=0)) < reach
    mixed = np.flatnonzero(near | (lies_in[mesh.tets].any(axis=1) & ~lies_in[mesh.tets].all(axis=1)))
    nodes = mesh.nodes[mesh.tets[mixed]]
    points = np.einsum("qn,mnd->mqd", shape_functions(at, mesh.order), nodes)
    volume = np.linalg.det(np.einsum("mnd,qnr->mqdr", nodes, shape_gradients(at, mesh.order)))
    flat = points.reshape(-1, 3)
    outside = np.min([depth(flat) for depth in kept], axis=0).reshape(volume.shape) > 0
    for point in range(filled.shape[1]):
        rows = own == point
        filled[mixed, point] = (volume[:, rows] * outside[:, rows]).sum(axis=1) / volume[:, rows].sum(axis=1)
    # Points without volume leave an element motions without stiffness.
    some = (filled > 0).any(axis=1)
    filled[some] = np.maximum(filled[some], FLOOR)
    if not drop:
        return attrs.evolve(mesh, filled=filled)
    return _with_elements(attrs.evolve(mesh, filled=filled), filled.mean(axis=1) > max(_LEAST, 1.01 * FLOOR))


def _with_elements(mesh: Mesh, keep: Array) -> Mesh:
    """Some elements (m,) bool of a mesh of struts alone, and their nodes."""
    used, tets = np.unique(mesh.tets[keep], return_inverse=True)
    return Mesh(
        mesh.nodes[used],
        np.reshape(tets, (-1, mesh.tets.shape[1])),
        mesh.region[keep],
        mesh.cavity[:0],
        mesh.base[:0],
        mesh.tip[:0],
        mesh.symmetry,
        mesh.filled[keep],
    )


def without_loose_parts(mesh: Mesh, held: Array) -> Mesh:
    """The mesh without parts that touch the rest by a node or an edge only, and so turn about it freely.

    held (n,): mask of nodes that something else holds; three of them hold a part.
    """
    faces = np.sort(mesh.tets[:, :4][:, TET_FACES], axis=2).reshape(-1, 3)
    _, face = np.unique(faces, axis=0, return_inverse=True)
    count = len(mesh.tets)
    of = np.repeat(np.arange(count), 4)
    link = sparse.coo_matrix((np.ones(len(of)), (of, np.ravel(face))))
    _, part = connected_components(link @ link.T, directed=False)
    pairs = np.unique(np.column_stack([np.repeat(part, mesh.tets.shape[1]), mesh.tets.ravel()]), axis=0)
    firm = np.bincount(pairs[:, 0], held[pairs[:, 1]]) >= 3
    return mesh if firm.all() else _with_elements(mesh, firm[part])


def support(mesh: Mesh, volumes: Array | None = None) -> Array:
    """Share (n,) of the elements' volume around each node that is filled.

    volumes (m, q): of the elements at their quadrature points, where they are known.
    """
    if volumes is None:
        volumes = reference_gradients(mesh.nodes, mesh.tets).volumes
    per = mesh.tets.shape[1]
    whole, solid = (
        np.bincount(mesh.tets.ravel(), np.repeat(v.sum(axis=1), per), len(mesh.nodes))
        for v in (volumes, volumes * mesh.filled)
    )
    # Nodes without elements are free.
    return np.divide(solid, whole, out=np.ones(len(whole)), where=whole > 0)
