"""The common test body: a thick-walled closed chamber of three stiffnesses, meshed by gmsh.

Cylinder of radius 10 and height 24 mm, clamped below, with a closed cavity of radius 7.5 and height 18 mm
in its middle; 50 kPa, within 1.25 mm of the cavity 100 kPa, within 4.5 mm of a point on the wall 400 kPa;
Poisson's ratio 0.45; 0 to 5 kPa in ten steps. Groups go by element centre, so that every code gets the
same arrays.
"""

from __future__ import annotations

import numpy as np

from mu_addon.meshing.mesh import MEMBRANE, Mesh, boundary_faces, edges_of, oriented, second_order

from .problem import Problem

RADIUS, HEIGHT = 10.0, 24.0
CAVITY_RADIUS, CAVITY_LOW, CAVITY_HIGH = 7.5, 3.0, 21.0
PATCH, PATCH_RADIUS, SKIN = np.array([0.0, 8.75, 12.0]), 4.5, 1.25
PRESSURES_MPA = np.linspace(0.0, 5e-3, 11)[1:]

# Element size in mm, by order, of about 21 000 unknowns.
SIZE_MM = {1: 0.9, 2: 1.85}


def chamber(order):
    """The problem with linear or quadratic elements; deterministic."""
    size_mm = SIZE_MM[order]
    mesh = _mesh(size_mm, order)
    modulus = _modulus(mesh)
    name = f"chamber, {size_mm:g} mm, order {order}"
    return Problem(name, mesh, modulus, np.full(len(modulus), 0.45), PRESSURES_MPA)


def _mesh(size_mm, order):
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Verbosity", 1)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size_mm)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size_mm)
        body = gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, HEIGHT, RADIUS)
        hole = gmsh.model.occ.addCylinder(0, 0, CAVITY_LOW, 0, 0, CAVITY_HIGH - CAVITY_LOW, CAVITY_RADIUS)
        gmsh.model.occ.cut([(3, body)], [(3, hole)])
        gmsh.model.occ.synchronize()
        gmsh.model.mesh.generate(3)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        _, tets = gmsh.model.mesh.getElementsByType(4)
    finally:
        gmsh.finalize()
    number = np.zeros(int(tags.max()) + 1, int)
    number[tags.astype(int)] = np.arange(len(tags))
    nodes = coordinates.reshape(-1, 3)
    used, tets = np.unique(number[tets.astype(int)], return_inverse=True)
    nodes, tets = nodes[used], tets.reshape(-1, 4)
    tets = oriented(nodes, tets)
    faces, _ = boundary_faces(tets)
    middle = nodes[faces].mean(axis=1)
    within = np.hypot(middle[:, 0], middle[:, 1]) < CAVITY_RADIUS + 1e-6
    between = (middle[:, 2] > CAVITY_LOW - 1e-6) & (middle[:, 2] < CAVITY_HIGH + 1e-6)
    cavity = faces[within & between]
    if order == 2:
        nodes, tets, cavity = second_order(nodes, tets, cavity, _middles(nodes, tets, faces))
    base, tip = (np.flatnonzero(np.abs(nodes[:, 2] - z) < 1e-9) for z in (0.0, HEIGHT))
    return Mesh(nodes, tets, np.full(len(tets), MEMBRANE), cavity, base, tip)


def _middles(nodes, tets, faces):
    """Middles (e, 3) of the edges, those of the two cylinders' walls on the cylinders."""
    edges, _ = edges_of(tets)
    middles = nodes[edges].mean(axis=1)
    radius = np.hypot(nodes[:, 0], nodes[:, 1])
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    count = len(nodes)
    of_surface = np.isin(edges[:, 0] * count + edges[:, 1], sides[:, 0] * count + sides[:, 1])
    for wall in (RADIUS, CAVITY_RADIUS):
        bent = of_surface & (np.abs(radius[edges] - wall) < 1e-6).all(axis=1)
        middles[bent, :2] *= wall / np.hypot(middles[bent, 0], middles[bent, 1])[:, None]
    return middles


def _modulus(mesh):
    centre = mesh.nodes[mesh.corners].mean(axis=1)
    outside = np.maximum(np.hypot(centre[:, 0], centre[:, 1]) - CAVITY_RADIUS, 0)
    beyond = np.maximum(np.maximum(CAVITY_LOW - centre[:, 2], centre[:, 2] - CAVITY_HIGH), 0)
    modulus = np.where(np.hypot(outside, beyond) < SKIN, 0.1, 0.05)
    modulus[np.linalg.norm(centre - PATCH, axis=1) < PATCH_RADIUS] = 0.4
    return modulus
