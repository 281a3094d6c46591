"""The labelled analysis mesh of a parametric unit."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..design.body import Body, half
from ..design.dimensions import Dimensions
from ..design.parameters import Unit
from ..errors import InputError, MeshingError
from .lattice_region import GmshUnavailable, Sizes, lattice_mesh
from .mesh import (
    LATTICE,
    MEMBRANE,
    TET_EDGES,
    Array,
    Mesh,
    bisected,
    edge_keys,
    edges_of,
    mirror,
    oriented,
    second_order,
)
from .morph import Harmonic
from .quality import GAUSS, check_positive, folded_corners, shapes
from .revolved import region_at, unit_surfaces
from .settings import CELL_MM, MeshSettings
from .surface import Surface, mesh_surface
from .wall_grid import Membrane, WallGrid

Progress = Callable[[str, float], None]

MESHERS = ("auto", "gmsh", "pytetwild")

# Corners flatter than this, as a share of the element's largest det J, open to nearly 180 degrees.
_FLAT = 0.05
# Corners flatter than this, as a share of the element's largest det J, are relieved.
_BENT = 0.25


class MeshingWarning(UserWarning):
    """A mesh was made, but not in the way that was asked for."""


def mesh_unit(
    unit: Unit,
    settings: MeshSettings | None = None,
    progress: Progress | None = None,
    mesher: str = "auto",
    cache: Path | None = None,
    body: Body | None = None,
) -> Mesh:
    """Analysis mesh of a unit as printed: labelled tetrahedra of membrane and lattice region.

    The membrane is a structured grid revolved about z; gmsh fills the lattice region around it. The base is
    clamped, the inlet is left out. settings: sizes and order. mesher: "gmsh", "pytetwild" (meshes all from
    surfaces instead, straight-sided, coarser in shape and slower, and cached in the folder `cache`), or
    "auto": pytetwild, with a MeshingWarning, only where gmsh cannot be loaded. body: a closed surface in
    place of the envelope's box (`design.body.envelope`), which pytetwild meshes; half of it if it is
    symmetric about x = 0. progress: called with a stage and the share done.

    Raises InputError and MeshingError. A coarse mesh takes about a second: `mesh_unit(load_preset("mu-1.0x"),
    MeshSettings(order=1, refine=0.5))`.
    """
    settings = settings or MeshSettings()
    report = progress or (lambda stage, share: None)
    if mesher not in MESHERS:
        raise InputError(f"mesher {mesher!r} is not known", "mesher", f"one of: {', '.join(MESHERS)}")
    d = unit.printed
    if body is not None:
        return _within(body, d, settings, report, mesher, cache)
    if mesher == "pytetwild":
        mesh = _from_surfaces(d, settings, report, cache)
    else:
        try:
            mesh = _structured(d, settings, report)
        except GmshUnavailable as error:
            if mesher == "gmsh":
                raise
            warnings.warn(
                f"{error.what}. pytetwild meshes the unit instead: slower, with more elements and a "
                f"less accurate wall. To install gmsh: {error.remedy}",
                MeshingWarning,
                stacklevel=2,
            )
            mesh = _from_surfaces(d, settings, report, cache)
    check_positive(mesh)
    if settings.fraction == "full":
        mesh = mirror(mesh, "x")
    report("mesh", 1.0)
    return mesh


def _structured(d: Dimensions, settings: MeshSettings, report: Progress) -> Mesh:
    """Half mesh: a revolved membrane in a lattice region filled by gmsh."""
    report("mesh of the membrane", 0.0)
    membrane = WallGrid.under(settings, d).membrane
    report("mesh of the lattice", 0.2)
    added, tets = _lattice(d, settings, membrane)
    nodes = np.vstack([membrane.nodes, added])
    for column, planes in enumerate(d.bounds):
        for plane in (0.0, *planes):
            nodes[np.abs(nodes[:, column] - plane) < 1e-7 * d.cell, column] = plane
    report("mesh of the lattice", 0.9)
    mesh = _joined(membrane, nodes, oriented(nodes, tets), d.height, settings.order)
    for _ in range(3):
        chords = _flattening_chords(mesh, membrane.outside)
        if not len(chords):
            break
        nodes, tets = bisected(nodes, tets, chords)
        mesh = _joined(membrane, nodes, oriented(nodes, tets), d.height, settings.order)
    return relieved(mesh, d.bounds)


def _lattice(d: Dimensions, settings: MeshSettings, membrane: Membrane) -> tuple[Array, Array]:
    """Nodes (a, 3) and tets of the lattice region, as `lattice_mesh` gives them."""
    # A mesher's decisions hang on the last digit: told in one cell's size and rounded, a unit gets the
    # same mesh at every scale, so that scales compare without its noise.
    to_cell = CELL_MM / d.cell
    (_, x1), (y0, y1), (_, height) = np.round(np.array(d.bounds) * to_cell, 9).tolist()
    plan = np.array([[0.0, y1], [x1, y1], [x1, y0], [0.0, y0]])
    sizes = Sizes(
        envelope=settings.envelope_mm / settings.refine,
        anchor=settings.anchor_mm / settings.refine,
        row=d.row * CELL_MM,
        neck=settings.meridian_mm / settings.refine,
        neck_radius=round(d.r * to_cell, 9),
    )
    surface = np.round(membrane.nodes * to_cell, 9)
    added, tets = lattice_mesh(surface, membrane.outside, plan, height, sizes)
    return added / to_cell, tets


def _joined(membrane: Membrane, nodes: Array, lattice: Array, height: float, order: int) -> Mesh:
    """Join the membrane and the linear lattice tets around it, curved where they meet."""
    region = np.repeat([MEMBRANE, LATTICE], [len(membrane.tets), len(lattice)])
    tets, cavity = np.vstack([membrane.tets, lattice]), membrane.cavity
    if order == 2:
        edges, _ = edges_of(tets)
        middles = nodes[edges].mean(axis=1)
        curved, _ = edges_of(membrane.tets)
        rows = np.searchsorted(edge_keys(edges, len(nodes)), edge_keys(curved, len(nodes)))
        middles[rows] = membrane.middles
        nodes, tets, cavity = second_order(nodes, tets, cavity, middles)
    base, tip = (np.flatnonzero(nodes[:, 2] == z) for z in (0.0, height))
    return Mesh(nodes, tets, region, cavity, base, tip, ("x",))


def _flattening_chords(mesh: Mesh, outside: Array) -> Array:
    """Straight edges (k, 2) between profile nodes, in lattice elements that the curved profile flattens.

    An element with two sides on the smooth profile has an angle of 180 degrees between them. Splitting the
    opposite edge gives two elements of half the angle. No two chords share an element.
    """
    flat = np.flatnonzero((folded_corners(mesh) < _FLAT) & (mesh.region == LATTICE))
    on_profile = np.zeros(len(mesh.nodes), bool)
    on_profile[outside] = True
    sides = np.sort(outside[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1)
    of_profile = set(map(tuple, sides.tolist()))
    edges, of_tet = edges_of(mesh.tets)
    chosen: list[int] = []
    taken = np.zeros(len(mesh.tets), bool)
    for tet in flat:
        for edge in of_tet[tet]:
            ends = edges[edge]
            around = (of_tet == edge).any(axis=1)
            if on_profile[ends].all() and tuple(ends.tolist()) not in of_profile and not taken[around].any():
                chosen.append(edge)
                taken |= around
    return edges[chosen]


def _within(
    body: Body, d: Dimensions, settings: MeshSettings, report: Progress, mesher: str, cache: Path | None
) -> Mesh:
    """Mesh of a unit with a closed surface in place of its envelope."""
    if mesher == "gmsh":
        raise InputError(
            "a user-defined body is meshed by pytetwild", "mesher", 'choose mesher "auto" or "pytetwild"'
        )
    right = half(body)
    envelope = body if right is None else right
    surface = Surface(envelope.vertices, envelope.triangles.astype(np.int32), LATTICE)
    mesh = _from_surfaces(d, settings, report, cache, surface, whole=right is None)
    check_positive(mesh)
    if settings.fraction == "full" and mesh.symmetry:
        mesh = mirror(mesh, "x")
    report("mesh", 1.0)
    return mesh


def _from_surfaces(
    d: Dimensions,
    settings: MeshSettings,
    report: Progress,
    cache: Path | None,
    envelope: Surface | None = None,
    whole: bool = False,
) -> Mesh:
    """A unit's half at x >= 0, or the whole, by pytetwild, tagged by the exact profile."""
    size = d.cell / CELL_MM / settings.refine
    box, profile, cavity = unit_surfaces(d, (2 if whole else 1) * math.pi, settings.meridian_mm * size)
    envelope = envelope or box
    report("mesh by pytetwild", 0.0)
    mesh = mesh_surface(
        envelope.vertices,
        envelope.triangles,
        settings.envelope_mm * size,
        inside=(profile, cavity),
        classify=lambda points: region_at(d, points),
        epsilon_mm=d.thinnest_wall / 5,
        order=settings.order,
        symmetry=() if whole else ("x",),
        cache=cache,
    )
    if set(np.unique(mesh.region)) != {MEMBRANE, LATTICE}:
        raise MeshingError("pytetwild lost a region of the unit", "membrane or lattice", "install gmsh")
    return mesh


def relieved(mesh: Mesh, bounds: Any) -> Mesh:
    """The mesh with lattice elements bent along with the membrane, where its curvature would fold one.

    bounds (3, 2): the envelope's box, (low, high) in mm for x, y and z; its faces and the mirror planes keep
    their nodes in plane, and the membrane keeps all its nodes. Meshes of order 1 are returned as they are.
    """
    lattice = mesh.region == LATTICE
    if mesh.order == 1 or folded_corners(mesh)[lattice].min() > _BENT:
        return mesh
    tets = mesh.tets[lattice]
    straight = mesh.nodes.copy()
    straight[tets[:, 4:]] = straight[tets[:, :4][:, TET_EDGES]].mean(axis=2)
    of_membrane = np.zeros(len(mesh.nodes), bool)
    of_membrane[mesh.tets[mesh.region == MEMBRANE]] = True
    prescribed = of_membrane[:, None] | np.any(
        [straight == planes for planes in (0.0, *np.transpose(bounds))], axis=0
    )
    moved = np.where(of_membrane[:, None], mesh.nodes - straight, 0.0)
    bent = straight + _harmonic(straight, tets, moved, prescribed)
    return attrs.evolve(mesh, nodes=np.where(of_membrane[:, None], mesh.nodes, bent))


def _harmonic(nodes: Array, tets: Array, moved: Array, prescribed: Array) -> Array:
    """Displacements (n, 3) in mm, prescribed as `moved` where `prescribed` (n, 3) and harmonic elsewhere.

    tets (m, 10) are straight-sided. The medium is stiffer where elements are small, as in Persson and
    Peraire, AIAA 2009-949.
    """
    _, gradient = shapes(GAUSS, TET_EDGES, 2)
    x = nodes[tets[:, :4]]
    slopes = np.einsum("qnr,mrd->mqnd", gradient, np.linalg.inv((x[:, 1:] - x[:, :1]).transpose(0, 2, 1)))
    # Not weighed by the elements' volumes, so that small ones are the stiff ones.
    local = np.einsum("mqad,mqbd->mab", slopes, slopes)
    return Harmonic(len(nodes), tets, local, prescribed).between(moved)
