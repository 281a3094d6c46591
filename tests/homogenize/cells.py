"""Octants whose answers are known: boxes of several materials, a void in a block, slender struts."""

from __future__ import annotations

import attrs
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from mu_addon.fem.model import Model
from mu_addon.homogenize.specimen import repeated
from mu_addon.meshing.mesh import boundary_faces
from mu_addon.meshing.tiling import tiled
from tests.design import kinds
from tests.fem import bodies

SIMPLE_CUBIC = kinds.simple_cubic()


def isotropic(bulk, shear):
    """Stiffness (6, 6) of an isotropic material."""
    C = np.diag([2 * shear] * 3 + [shear] * 3).astype(float)
    C[:3, :3] += bulk - 2 / 3 * shear
    return C


def bulk_and_shear(young, poisson):
    return young / (3 * (1 - 2 * poisson)), young / (2 * (1 + poisson))


def ties(nodes, period):
    """Which node (n,) each node of a periodic cell [0, period] moves with, beside the mean strain."""
    folded = np.where(np.isclose(nodes, period, atol=1e-12), 0.0, nodes)
    _, first, inverse = np.unique(folded.round(9), axis=0, return_index=True, return_inverse=True)
    return first[np.reshape(inverse, -1)]


def periodic_tensor(octant, materials, box):
    """Effective tensor (6, 6) of the cell of eight images, with its opposite sides tied node by node."""
    whole = tiled(octant, (2, 2, 2), box)
    whole = attrs.evolve(whole, base=whole.base[:0])
    model = Model(whole)
    parameters = model.parameters(repeated(materials, len(octant.tets), 8))
    K = model.matrix(model.tangent(np.zeros_like(whole.nodes), 0.0, parameters))
    masters, number = np.unique(ties(whole.nodes, 2 * np.array(box)), return_inverse=True)
    rows = np.arange(3 * len(whole.nodes))
    columns = (3 * number[:, None] + np.arange(3)).ravel()
    T = sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(len(rows), 3 * len(masters)))
    # One node is held against rigid motion.
    T = T[:, 3:]
    strains = []
    for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)):
        e = np.zeros((3, 3))
        e[a, b] += 0.5
        e[b, a] += 0.5
        strains.append((whole.nodes @ e).ravel())
    affine = np.stack(strains, axis=1)
    u = affine - T @ splu((T.T @ K @ T).tocsc()).solve(T.T @ (K @ affine))
    return u.T @ (K @ u) / (8 * np.prod(box)), whole


def cube_with_void(radius, half=1.0, around=3, through=4, order=2):
    """The octant [0, half]^3 without the ball of a radius around the origin, its void curved."""
    grid, tets = bodies._grid((around, around, through), (1, 1, 1))
    sheets, cells = [], []
    for axis in range(3):
        a, b, t = grid.T
        cube = np.empty_like(grid)
        cube[:, axis] = 1.0
        cube[:, (axis + 1) % 3], cube[:, (axis + 2) % 3] = a, b
        ball = cube / np.linalg.norm(cube, axis=1)[:, None]
        # Layers grow with distance from the void.
        growth = (half / radius) ** t
        share = ((growth - 1) / (half / radius - 1))[:, None]
        sheets.append(radius * ball * (1 - share) + half * cube * share)
        cells.append(tets + axis * len(grid))
    points, where = np.vstack(sheets), np.vstack(cells)
    points[np.abs(points) < 1e-9] = 0.0
    points[np.abs(points - half) < 1e-9] = half
    _, first, inverse = np.unique(points.round(7), axis=0, return_index=True, return_inverse=True)
    points, where = points[first], np.reshape(inverse, -1)[where]
    volume = np.linalg.det(points[where][:, 1:] - points[where][:, :1])
    where[volume < 0] = where[volume < 0][:, [1, 0, 2, 3]]

    def bend(middles, ends):
        on_ball = (np.abs(np.linalg.norm(ends, axis=2) - radius) < 1e-9).all(axis=1)
        bent = middles.copy()
        bent[on_ball] *= (radius / np.linalg.norm(middles[on_ball], axis=1))[:, None]
        return bent

    return bodies.make(points, where, order, onto=bend)


def carved(counts, size, keep, order=2):
    """A box grid of which only the cells with keep(centre of each tet) stay."""
    nodes, tets = bodies._grid(counts, size)
    tets = tets[keep(nodes[tets].mean(axis=1))]
    used, tets = np.unique(tets, return_inverse=True)
    return bodies.make(nodes[used], tets.reshape(-1, 4), order)


def free_faces(mesh, box):
    """Corner nodes (f, 3) of the boundary faces that do not lie on a side of the box."""
    faces, _ = boundary_faces(mesh.tets)
    x = mesh.nodes[faces]
    flat = ((x == 0) | (x == np.array(box))).all(axis=1).any(axis=1)
    return faces[~flat]


def strut_stiffness(cell, modulus, poisson):
    """Stiffness along and across, in N/mm, of one half-diagonal whose ends do not turn.

    Timoshenko's beam of varying radius: antisymmetric about mid-span, so that the moment is the shear force
    times the distance from there. Shear factor of the round section: Cowper, J. Appl. Mech. 33 (1966) 335.
    """
    length = np.sqrt(3) / 2 * cell.size_mm
    t, w = np.polynomial.legendre.leggauss(40)
    s, w = (t + 1) / 2 * length, w / 2 * length
    r = cell.radius(s / length) + cell.offset_xy_mm
    area, inertia = np.pi * r**2, np.pi / 4 * r**4
    factor = 6 * (1 + poisson) / (7 + 6 * poisson)
    shear = modulus / (2 * (1 + poisson))
    across = w @ ((s - length / 2) ** 2 / (modulus * inertia) + 1 / (factor * shear * area))
    return 1 / (w @ (1 / (modulus * area))), 1 / across


def body_centred_by_beams(cell, modulus, poisson):
    """Cubic tensor (6, 6) in MPa of the body-centred lattice of slender struts with rigid joints.

    By the mirrors of the lattice no node turns under any mean strain, so each strut's ends only move apart,
    by the mean strain of its half-diagonal. With constant slender struts E[100] = 36 E I / (U L^3).
    """
    along, across = strut_stiffness(cell, modulus, poisson)
    C = np.zeros((6, 6))
    C[:3, :3] = 2 / cell.size_mm * (along - across) / 3
    C[range(3), range(3)] += 2 / cell.size_mm * across
    C[range(3, 6), range(3, 6)] = (2 * along + across) / (3 * cell.size_mm)
    return C
