"""Meshes as the paper's may have been: the whole body, without a mirror plane, equally coarse everywhere.

The paper meshes with Gmsh and prints no size. Here the membrane is the grid of `meshing.wall_grid`, and the
lattice around it is filled by Gmsh's Delaunay without regard to anchors. A seed moves sizes by some per cent,
and with them every element: two seeds are two meshes that nobody would call different.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import attrs
import numpy as np

from mu_addon.design.dimensions import Dimensions
from mu_addon.design.parameters import Unit
from mu_addon.errors import MeshingError
from mu_addon.meshing.lattice_region import gmsh_model, load_gmsh
from mu_addon.meshing.mesh import LATTICE, MEMBRANE, Array, Mesh, edges_of, mirror, oriented, second_order
from mu_addon.meshing.quality import check_positive
from mu_addon.meshing.wall_grid import WallGrid

# The membrane's elements, along the meridian and around, in mm at a cell of 12.5 mm.
_MERIDIAN_MM, _HOOP_MM = 2.5, 5.0
_CELL_MM = 12.5


@attrs.frozen
class Recipe:
    """How to mesh: elements' size in mm in the lattice at a cell of 12.5 mm, order 1 or 2, spread of sizes.

    spread: sizes of one seed lie within this share of the recipe's.
    """

    size_mm: float = 5.0
    order: int = 1
    spread: float = 0.1


def unstructured_mesh(unit: Unit, recipe: Recipe, seed: int) -> Mesh:
    """The whole unit in mm, other elements for every seed. Raises MeshingError and GmshUnavailable."""
    d = unit.printed
    random = np.random.default_rng(seed)
    lattice, meridian_mm, hoop_mm = (
        size * d.cell / _CELL_MM * (1 + recipe.spread * random.uniform(-1, 1))
        for size in (recipe.size_mm, _MERIDIAN_MM, _HOOP_MM)
    )
    grid, outside = _whole_membrane(d, meridian_mm, hoop_mm)
    shift = random.uniform(-1, 1, (8, 1)) * recipe.spread
    added, tets = _fill(d, grid.nodes, outside, lattice * (1 + shift[:, 0]), int(random.integers(1, 2**31)))
    nodes = np.vstack([grid.nodes, added])
    every = np.vstack([grid.tets, oriented(nodes, tets)])
    cavity = grid.cavity
    if recipe.order == 2:
        edges, _ = edges_of(every)
        nodes, every, cavity = second_order(nodes, every, cavity, nodes[edges].mean(axis=1))
    region = np.repeat([MEMBRANE, LATTICE], [len(grid.tets), len(tets)])
    base, tip = (np.flatnonzero(np.abs(nodes[:, 2] - z) < 1e-7 * d.cell) for z in (0.0, d.height))
    mesh = Mesh(nodes, every, region, cavity, base, tip)
    check_positive(mesh)
    return mesh


def _whole_membrane(d: Dimensions, meridian_mm: float, hoop_mm: float) -> tuple[Mesh, Array]:
    """The membrane all around, straight-sided, and its outer triangles (f, 3), normals out of the solid."""
    half = WallGrid(d, meridian_mm, hoop_mm, 1).membrane
    ends = np.empty(0, np.int32)
    region = np.full(len(half.tets), MEMBRANE)
    mesh = Mesh(half.nodes, half.tets, region, half.cavity, ends, ends, ("x",))
    # Mirrored in place of the cavity, the outer side has the same nodes.
    outside = mirror(attrs.evolve(mesh, cavity=half.outside), "x").cavity
    return mirror(mesh, "x"), outside


def _fill(d: Dimensions, nodes: Array, outside: Array, sizes: Array, seed: int) -> tuple[Array, Array]:
    """Nodes (a, 3) and tets of the lattice; sizes (8,) in mm at the corners of its box."""
    used, dense = np.unique(outside, return_inverse=True)
    surface = np.reshape(dense, (-1, 3))
    points = nodes[used]
    with gmsh_model(load_gmsh()) as gmsh:
        gmsh.option.setNumber("Mesh.RandomSeed", seed)
        _profile(gmsh, points, surface, d.height)
        _box(gmsh, d, sizes)
        try:
            gmsh.model.mesh.generate(3)
        except Exception as error:
            raise MeshingError(
                f"gmsh could not fill the lattice region: {error}", f"seed {seed}", "take another seed"
            ) from error
        tags, flat, _ = gmsh.model.mesh.getNodes()
        kinds, _, connectivity = gmsh.model.mesh.getElements(3)
    if list(kinds) != [4]:
        raise MeshingError("gmsh returned no tetrahedra", "lattice region", "take another seed")
    number = np.full(int(tags.max()) + 1, -1)
    number[1 : len(used) + 1] = used
    fresh = np.sort(tags[tags > len(used)]).astype(np.int64)
    number[fresh] = len(nodes) + np.arange(len(fresh))
    where = np.empty(int(tags.max()) + 1, np.int64)
    where[tags.astype(np.int64)] = np.arange(len(tags))
    return flat.reshape(-1, 3)[where[fresh]], number[connectivity[0].astype(np.int64).reshape(-1, 4)]


def _profile(gmsh: Any, nodes: Array, outside: Array, height: float) -> None:
    """The membrane's outer side as discrete surface 1, its rims at base and top as closed curves 1 and 2."""
    rims = []
    for z in (0.0, height):
        rim = np.flatnonzero(nodes[:, 2] == z)
        rims.append(rim[np.argsort(np.arctan2(nodes[rim, 0], nodes[rim, 1]))])
    for curve, rim in enumerate(rims, 1):
        first = rim[0]
        gmsh.model.addDiscreteEntity(0, curve)
        gmsh.model.setCoordinates(curve, *nodes[first])
        gmsh.model.mesh.addNodes(0, curve, [first + 1], nodes[first])
        gmsh.model.mesh.addElementsByType(curve, 15, [], [first + 1])
        gmsh.model.addDiscreteEntity(1, curve, [curve, curve])
        gmsh.model.mesh.addNodes(1, curve, rim[1:] + 1, nodes[rim[1:]].ravel())
        pairs = np.column_stack([rim, np.roll(rim, -1)]) + 1
        gmsh.model.mesh.addElementsByType(curve, 1, [], pairs.ravel())
    gmsh.model.addDiscreteEntity(2, 1, [1, 2])
    inside = np.setdiff1d(np.arange(len(nodes)), np.concatenate(rims))
    gmsh.model.mesh.addNodes(2, 1, inside + 1, nodes[inside].ravel())
    gmsh.model.mesh.addElementsByType(1, 2, [], (outside + 1).ravel())


def _box(gmsh: Any, d: Dimensions, sizes: Array) -> None:
    """Close the space between the profile and the envelope's box, whose ends have the rims for holes."""
    geo = gmsh.model.geo
    (x0, x1), (y0, y1), _ = d.bounds
    plan = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    low = [geo.addPoint(x, y, 0.0, h) for (x, y), h in zip(plan, sizes[:4], strict=True)]
    high = [geo.addPoint(x, y, d.height, h) for (x, y), h in zip(plan, sizes[4:], strict=True)]
    rise = [geo.addLine(a, b) for a, b in zip(low, high, strict=True)]
    floor, roof = (
        [geo.addLine(a, b) for a, b in pairwise([*corners, corners[0]])] for corners in (low, high)
    )
    planes = [
        geo.addPlaneSurface([geo.addCurveLoop(floor), geo.addCurveLoop([1])]),
        geo.addPlaneSurface([geo.addCurveLoop(roof), geo.addCurveLoop([2])]),
    ]
    for i in range(4):
        loop = [floor[i], rise[(i + 1) % 4], -roof[i], -rise[i]]
        planes.append(geo.addPlaneSurface([geo.addCurveLoop(loop)]))
    geo.addVolume([geo.addSurfaceLoop([1, *planes])])
    geo.synchronize()
    # One size everywhere, as a mesh of one size has it; near the membrane its own triangles go on growing.
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
