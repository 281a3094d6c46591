"""The mesh of a slightly different unit by moving nodes: the two compare without a mesher's noise."""

from __future__ import annotations

import math

import attrs
import numpy as np

from ..design.dimensions import Dimensions
from ..design.parameters import Unit
from ..errors import MeshingError
from .harmonic import harmonic
from .membrane import Membrane, Meridian, division, membrane_mesh, stations
from .mesh import LATTICE, MEMBRANE, TET_EDGES, Array, Mesh, edge_keys, edges_of
from .quality import check_positive
from .settings import CELL_MM, MeshSettings


def morphed(mesh: Mesh, drawn: Unit, other: Unit, settings: MeshSettings) -> Mesh:
    """The half or quarter mesh that gmsh made of `drawn` under `settings`, moved to the unit `other`.

    Both share cell, count, scale and envelope. The membrane goes to its exact place; what is between it and
    the envelope follows harmonically. Raises MeshingError where that cannot be done.
    """
    a, b = drawn.printed, other.printed
    if a == b:
        return mesh
    before, after = _membranes(a, b, settings)
    count = len(before.nodes)
    close = 1e-6 * a.cell
    if len(mesh.nodes) < count or np.abs(mesh.nodes[:count] - before.nodes).max() > close:
        raise _failed("its mesh is not by gmsh, or has other settings")
    corner = np.zeros(len(mesh.nodes), bool)
    corner[mesh.corners] = True
    known = np.zeros(len(mesh.nodes), bool)
    moved = np.zeros_like(mesh.nodes)
    known[:count] = True
    moved[:count] = after.nodes - before.nodes
    inside = mesh.region == LATTICE
    if mesh.order == 2:
        middles = _middles(mesh, before)
        known[middles] = True
        moved[middles] = after.middles - before.middles
    prescribed = known[:, None] | np.any(
        [mesh.nodes == planes for planes in (0.0, *np.transpose(np.array(a.bounds)))], axis=0
    )
    moved = _moved_along(mesh.nodes, mesh.corners[inside], moved, prescribed)
    if mesh.order == 2:
        rest = ~known & ~corner
        moved[rest] = moved[_ends(mesh)[rest]].mean(axis=1)
    found = attrs.evolve(mesh, nodes=mesh.nodes + moved)
    check_positive(found)
    return found


def _membranes(a: Dimensions, b: Dimensions, settings: MeshSettings) -> tuple[Membrane, Membrane]:
    """The grids of two membranes, alike node by node, the first as `mesh_unit` makes it."""
    size = a.cell / CELL_MM / settings.refine
    quarters = 1 if settings.fraction == "quarter" else 2
    first, second = Meridian.of(a), Meridian.of(b)
    if (a.height, a.count, a.bounds) != (b.height, b.count, b.bounds):
        raise _failed("its envelope differs")
    breaks = [_breaks(m) for m in (first, second)]
    order = np.argsort(breaks[0])
    from_, to = (x[order] for x in breaks)
    if not (np.diff(to) > 0).all():
        raise _failed("its profile differs")
    p = stations(first, settings.meridian_mm * size)
    turn, edge = quarters * math.pi / 2, settings.hoop_mm * size
    sectors, rings = quarters * division(a.R * math.pi / 2, edge), division(a.r, edge)
    layers = max(1, int(settings.through_wall * settings.refine + 0.5))
    made = [
        membrane_mesh(meridian, turn, heights, sectors, layers, rings)
        for meridian, heights in ((first, p), (second, np.interp(p, from_, to)))
    ]
    if not np.array_equal(made[0].tets, made[1].tets):
        raise _failed("its membrane folds")
    return made[0], made[1]


def _breaks(meridian: Meridian) -> Array:
    """Heights on the profile where something ends: cuts, arcs, ends."""
    d = meridian.d
    joints = np.arange(d.count)[:, None] * d.cell + np.array([0.0, d.b, d.cell / 2, d.cell - d.b])
    return np.concatenate([joints.ravel(), [d.height], meridian.cuts])


def _ends(mesh: Mesh) -> Array:
    """The corners (n, 2) that every middle node is between."""
    ends = np.zeros((len(mesh.nodes), 2), int)
    ends[mesh.tets[:, 4:].ravel()] = mesh.tets[:, TET_EDGES].reshape(-1, 2)
    return ends


def _middles(mesh: Mesh, membrane: Membrane) -> Array:
    """Node (e,) of the mesh at the middle of each edge of the membrane's grid."""
    wall = mesh.tets[mesh.region == MEMBRANE]
    edges, of_tet = edges_of(wall)
    node = np.empty(len(edges), int)
    node[of_tet.ravel()] = wall[:, 4:].ravel()
    count = len(mesh.nodes)
    rows = np.searchsorted(edge_keys(edges, count), edge_keys(edges_of(membrane.tets)[0], count))
    return node[rows]


def _moved_along(nodes: Array, tets: Array, moved: Array, prescribed: Array) -> Array:
    """Displacements (n, 3): `moved` where `prescribed`, harmonic in linear tets (m, 4), small ones stiff."""
    x = nodes[tets]
    inverse = np.linalg.inv(x[:, 1:] - x[:, :1]).transpose(0, 2, 1)
    slopes = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    local = np.einsum("mad,mbd->mab", slopes, slopes)
    return harmonic(len(nodes), tets, local, moved, prescribed)


def _failed(why: str) -> MeshingError:
    return MeshingError(f"the mesh of a unit cannot be moved: {why}", "unit", "mesh the other unit anew")
