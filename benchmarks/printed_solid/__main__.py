"""The printed solid of a unit as its own model, without homogenisation: mesh, its quality, bending angles.

    python -m benchmarks.printed_solid --chambers 3 --edge 1.0 --pressure -10 -5 5 10 [--printed]

Half of the solid as drawn, its inlet left out, one resin. Its surface is remeshed to triangles of one size
(`remesh`), filled by gmsh (HXT), and mid-edge nodes are moved onto a finer surface. The angle of the tip's
cap and that of all that lies in its plane, struts as well, are not the same. Fails where the remeshed surface
crosses itself (two of five settings). --printed: the same unit and resin as `mesh_printed` meshes it, too.
"""

from __future__ import annotations

import time

import attrs
import numpy as np
from manifold3d import Manifold, OpType

from benchmarks.table import options_of
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design import shapes
from mu_addon.design.dimensions import Dimensions
from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import load_preset
from mu_addon.design.profile import cavity_polygon, cavity_radius, outer_polygon
from mu_addon.design.solid import QUALITY, Facets, lattice_solid
from mu_addon.meshing.gmsh_model import load_gmsh
from mu_addon.meshing.mesh import (
    LATTICE,
    TRIANGLE_EDGES,
    Mesh,
    boundary_faces,
    edge_keys,
    edges_of,
    oriented,
    second_order,
)
from mu_addon.meshing.quality import dihedral_angles, element_volumes, folded_corners

from ..body.convergence import angles, resin
from .remesh import Reference, remesh

COARSE = Facets(around_axis=64, along_arc=4, around_strut=8, along_strut=8)
# Of two faces of one element: less is a round surface, more a real edge.
ROUND_DEG = 75.0


def bisected(nodes, tets, edges):
    """Linear tets with some edges halved, together with all elements around them: new nodes and tets.

    nodes (n, 3) in mm, tets (m, 4); edges (k, 2), no two of them in one element.
    """
    for a, b in edges:
        around = (tets == a).any(axis=1) & (tets == b).any(axis=1)
        first, second = tets[around].copy(), tets[around].copy()
        first[first == b] = len(nodes)
        second[second == a] = len(nodes)
        nodes = np.vstack([nodes, nodes[[a, b]].mean(axis=0)])
        tets = np.vstack([tets[~around], first, second])
    return nodes, tets


def solid(d: Dimensions, facets: Facets) -> Manifold:
    """Lattice and actuator without inlet, half of them: x >= 0."""
    whole = Manifold.batch_boolean(
        [
            lattice_solid(d, lattice_of(d), facets),
            shapes.revolved(outer_polygon(d, facets.along_arc), facets.around_axis),
        ],
        OpType.Add,
    )
    hollow = whole - shapes.revolved(cavity_polygon(d, facets.along_arc), facets.around_axis)
    return hollow.trim_by_plane([1, 0, 0], 0.0).simplify(1e-3)


def arrays(body: Manifold):
    mesh = body.to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3].copy(), np.asarray(mesh.tri_verts).astype(np.int64)


def filled(vertices, triangles, edge_mm: float):
    """Tetrahedra inside a closed surface, which they keep."""
    gmsh = load_gmsh()
    gmsh.initialize(interruptible=False)
    try:
        for name, value in (
            ("General.Verbosity", 1),
            ("General.NumThreads", 1),
            ("Mesh.Algorithm3D", 10),
            ("Mesh.MeshSizeMax", 1.6 * edge_mm),
            ("Mesh.Optimize", 1),
        ):
            gmsh.option.setNumber(name, value)
        tag = gmsh.model.addDiscreteEntity(2)
        gmsh.model.mesh.addNodes(2, tag, np.arange(1, len(vertices) + 1), vertices.ravel())
        gmsh.model.mesh.addElementsByType(tag, 2, [], (triangles + 1).ravel().astype(np.uint64))
        gmsh.model.geo.addVolume([gmsh.model.geo.addSurfaceLoop([tag])])
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(3)
        tags, places, _ = gmsh.model.mesh.getNodes()
        _, tets = gmsh.model.mesh.getElementsByType(4)
    finally:
        gmsh.finalize()
    number = np.zeros(int(tags.max()) + 1, int)
    number[tags.astype(int)] = np.arange(len(tags))
    nodes = places.reshape(-1, 3).copy()
    return nodes, oriented(nodes, number[tets.astype(int).reshape(-1, 4)])


def divided(nodes, tets):
    """Elements with two faces on a round surface halved across the edge that joins these faces' far ends."""
    while True:
        faces, owner = boundary_faces(tets)
        order = np.argsort(owner, kind="stable")
        first = np.flatnonzero(owner[order][1:] == owner[order][:-1])
        pairs = np.stack([order[first], order[first + 1]], axis=1)
        corners = nodes[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        cosine = (normal[pairs[:, 0]] * normal[pairs[:, 1]]).sum(axis=1)
        edges, of_tet = edges_of(tets)
        keys = edge_keys(edges, len(nodes))
        around = np.argsort(of_tet.ravel(), kind="stable")
        start = np.searchsorted(of_tet.ravel()[around], np.arange(len(edges) + 1))
        taken, chosen = np.zeros(len(tets), bool), []
        for one, two in pairs[cosine > np.cos(np.radians(ROUND_DEG))]:
            ends = np.setxor1d(faces[one], faces[two])
            edge = int(np.searchsorted(keys, edge_keys(ends[None], len(nodes)))[0])
            elements = around[start[edge] : start[edge + 1]] // 6
            if not taken[elements].any():
                chosen.append(edge)
                taken[elements] = True
        if not chosen:
            return nodes, tets
        nodes, tets = bisected(nodes, tets, edges[np.array(chosen)])
        tets = oriented(nodes, tets)


def curved(nodes, tets, d: Dimensions, reference: Reference, planes=()) -> Mesh:
    """Second-order elements whose mid-edge nodes lie on the surface, as far as no element folds.

    planes: (axis, place) of flat sides, those of the half unit if not given.
    """
    planes = planes or [(0, 0.0), *((axis, plane) for axis in range(3) for plane in d.bounds[axis])]
    for axis, plane in planes:
        nodes[np.abs(nodes[:, axis] - plane) < 1e-6, axis] = plane
    faces, _ = boundary_faces(tets)
    corners = nodes[faces]
    cut = (corners[:, :, 0] == 0.0).all(axis=1)
    radius, z = np.hypot(corners[..., 0], corners[..., 1]), corners[..., 2]
    within = radius < cavity_radius(d, np.clip(z, 0, d.height)) + 0.3 * d.wall
    cavity = faces[~cut & (within & (z > 0.5 * d.base_cap) & (z < d.height - 0.5 * d.tip_cap)).all(axis=1)]
    edges, of_tet = edges_of(tets)
    straight = nodes[edges].mean(axis=1)
    outer = np.unique(np.sort(faces[~cut][:, TRIANGLE_EDGES].reshape(-1, 2), axis=1), axis=0)
    rows = np.searchsorted(edge_keys(edges, len(nodes)), edge_keys(outer, len(nodes)))
    onto, ends = reference.on_surface(straight[rows]), nodes[outer]
    for axis, plane in planes:
        onto[(ends[:, :, axis] == plane).all(axis=1), axis] = plane
    near = np.linalg.norm(onto - straight[rows], axis=1) < 0.3 * np.linalg.norm(
        ends[:, 0] - ends[:, 1], axis=1
    )
    bent = straight.copy()
    bent[rows[near]] = onto[near]
    share = np.ones(len(edges))
    for halvings in range(12):
        middles = straight + share[:, None] * (bent - straight)
        all_nodes, all_tets, all_cavity = second_order(nodes, tets, cavity, middles)
        base, tip = (np.flatnonzero(all_nodes[:, 2] == plane) for plane in d.bounds[2])
        region = np.full(len(tets), LATTICE)
        mesh = Mesh(all_nodes, all_tets, region, all_cavity, base, tip, ("x",))
        folded = folded_corners(mesh) < 0.05
        if not folded.any():
            break
        share[of_tet[folded]] *= 0.5 if halvings < 8 else 0.0
    return mesh


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("--preset", default="mu-1.0x")
    parser.add_argument("--chambers", type=int, default=3)
    parser.add_argument("--edge", type=float, default=1.0, help="Edge length in mm.")
    parser.add_argument("--modulus", type=float, default=2.5, help="Young's modulus of the resin in MPa.")
    parser.add_argument("--poisson", type=float, default=0.45)
    parser.add_argument("--wall", type=float, help="Wall in mm in place of the preset's.")
    parser.add_argument("--pressure", type=float, nargs="*", default=[], metavar="kPa")
    parser.add_argument("--printed", action="store_true", help="Solve the printed mesh, too.")
    options = parser.parse_args()
    unit = load_preset(options.preset)
    chambers = attrs.evolve(unit.chambers, count=options.chambers)
    if options.wall:
        chambers = attrs.evolve(chambers, wall_mm=options.wall)
    unit = attrs.evolve(unit, chambers=chambers)
    d = unit.dimensions

    began = time.perf_counter()

    def told(what: str) -> None:
        nonlocal began
        print(f"{what}: {time.perf_counter() - began:.1f} s", flush=True)
        began = time.perf_counter()

    drawn, fine = solid(d, COARSE), solid(d, QUALITY["interactive"])
    reference = Reference.of(*arrays(fine.refine_to_length(0.6)))
    told(f"solid of {fine.volume():.1f} mm3")
    vertices, triangles = remesh(*arrays(drawn), options.edge, reference)
    told(f"{len(triangles)} triangles")
    nodes, tets = filled(vertices, triangles, options.edge)
    told(f"{len(tets)} tetrahedra")
    nodes, tets = divided(nodes, tets)
    mesh = curved(nodes, tets, d, reference)
    angle = dihedral_angles(mesh).min(axis=1)
    told(
        f"{len(tets)} of second order, volume {element_volumes(mesh).sum():.1f} mm3, smallest angle "
        f"{angle.min():.1f} deg, {np.count_nonzero(angle < 10)} below 10, {3 * len(mesh.nodes)} unknowns, "
        f"{np.count_nonzero(folded_corners(mesh) <= 0)} folded"
    )
    meshes = {"printed solid": mesh}
    if options.printed:
        meshes["printed"] = mesh_printed(unit)
        told(f"printed mesh, {3 * (len(meshes['printed'].nodes) - len(meshes['printed'].tied))} unknowns")
    for name, mesh in meshes.items():
        for pressure, read in angles(
            mesh, d, options.pressure, resin(mesh, options.modulus, options.poisson), ("cap", "plane")
        ).items():
            print(
                f"{name}, {pressure:g} kPa: tip's cap {read['cap']:.3f} deg, with the struts in its plane "
                f"{read['plane']:.3f}; {read['s']:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
