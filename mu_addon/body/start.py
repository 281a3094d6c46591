"""Start of Newton's method: the unit's state without a waveguide, and the waveguide bent to fit it."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..fem.carried_nodes import following
from ..fem.equilibrium import Equilibrium
from ..fem.kinematics import mean_gradients, numbers_of
from ..fem.rotations import nearest_rotations
from ..meshing.mesh import Mesh

# Weight of the surroundings' rotation beside the legs of a path.
_TWIST = 0.05
# A displacement in mm whose forces are linear in it, and how many times as stiff what is held is made.
_SMALL, _HELD = 1e-6, 1e6


def started(unit: Mesh, mesh: Mesh, path: Array, u: Array) -> Array:
    """Displacements (m, 3) in mm of a mesh with a waveguide, from those of the unit without it, u (n, 3).

    unit, mesh: of `mesh_printed` and `with_waveguide`; path (h, 3): the waveguide's lattice nodes in mm.
    Nodes of thickened struts move with the deformation gradient around them. The waveguide's axis becomes a
    cubic Hermite curve between the joints of the path, each rotated as its legs are. Sections rotate by the
    interpolation of both joints' rotations and the least rotation onto the curve. Beyond its ends the
    waveguide is rigid.
    """
    count = len(u)
    moved = u.copy()
    shift = mesh.nodes[:count] - unit.nodes
    rows = np.flatnonzero(shift.any(axis=1))
    if len(rows):
        slope = mean_gradients(unit, u, rows) - np.eye(3)
        moved[rows] += np.einsum("kij,kj->ki", slope, shift[rows])
    own = mesh.nodes[count:]
    bent = _bent(unit, path, u, own) - own
    if "x" in mesh.symmetry:
        bent[own[:, 0] == 0.0, 0] = 0.0
    return following(mesh, np.vstack([moved, bent]))


def eased(equilibrium: Equilibrium, start: Array, u: Array, reach_mm: float = np.inf) -> Array:
    """A start (m, 3) in mm of `started`, relaxed so that struts fit the waveguide that they are tied to.

    equilibrium: of the unit with its waveguide; u (n, 3): state of the unit without it, in mm. In `started`,
    struts' nodes that follow bar or seats move away from their neighbours, by tenths of a millimetre at large
    bending, and elements there may be inverted. Here the unit moves as a linear, undeformed one would. The
    waveguide is held, and so is all that is farther from it than reach_mm as drawn: walls and struts that
    touch there would cross.
    """
    from scipy.spatial import cKDTree

    model, own = equilibrium.model, len(u)
    left = np.zeros_like(start)
    left[:own] = start[:own] - u
    largest = np.abs(left).max()
    if largest == 0.0:
        return start
    small = _SMALL / largest
    still = model.residual(np.zeros_like(start), 0.0, equilibrium.parameters)
    pulled = model.residual(small * left, 0.0, equilibrium.parameters) - still
    tangent = equilibrium.rest_tangent.copy()
    # The first entry of a column of the lower triangle is the diagonal's.
    held = np.arange(len(start)) >= own
    if np.isfinite(reach_mm):
        held |= cKDTree(model.mesh.nodes[own:]).query(model.mesh.nodes)[0] > reach_mm
    diagonal = model.pattern.indptr[:-1][held[model.free // 3]]
    tangent[diagonal] *= _HELD
    model.factor.factor(tangent)
    return model.moved(start, -model.factor.solve(pulled.ravel()[model.free] / small))


def _bent(unit: Mesh, path: Array, u: Array, points: Array) -> Array:
    """Positions (k, 3) in mm of points (k, 3) of a waveguide, bent with the joints of its path (h, 3)."""
    from scipy.spatial.transform import Rotation, Slerp

    joints = numbers_of(unit, path)
    way = np.diff(path, axis=0)
    at = _no_shorter(path + u[joints], np.linalg.norm(way, axis=1))
    turn = _turns(mean_gradients(unit, u, joints), way, np.diff(at, axis=0))
    length = np.linalg.norm(way, axis=1)
    share = np.einsum("ksi,si->ks", points[:, None] - path[:-1], way) / length**2
    share = np.clip(share, 0.0, 1.0)
    foot = path[:-1] + share[:, :, None] * way
    leg = np.linalg.norm(points[:, None] - foot, axis=2).argmin(axis=1)
    found = np.empty_like(points)
    for i, step in enumerate(way):
        rows = np.flatnonzero(leg == i)
        t = share[rows, i]
        ends, slopes = at[i : i + 2], turn[i : i + 2] @ step
        curve, slope = _hermite(ends, slopes, t)
        rotation = Slerp([0.0, 1.0], Rotation.from_matrix(turn[i : i + 2]))(t)
        along = slope / np.linalg.norm(slope, axis=1, keepdims=True)
        across = rotation.apply(points[rows] - foot[rows, i])
        found[rows] = curve + _onto(rotation.apply(step / length[i]), along, across)
    return found


def _no_shorter(points: Array, length: Array) -> Array:
    """A polyline (h, 3) in mm about its middle, with legs stretched to lengths (h - 1,) if they are shorter.

    A slender bar that is as short as the lattice around it would be far beyond buckling.
    """
    way = np.diff(points, axis=0)
    way *= np.maximum(length / np.linalg.norm(way, axis=1), 1.0)[:, None]
    found = np.vstack([np.zeros(3), np.cumsum(way, axis=0)])
    return np.asarray(found + (points - found).mean(axis=0))


def _turns(around: Array, way: Array, bent: Array) -> Array:
    """Rotations (h, 3, 3) of a path's joints: those that fit the legs before and after best.

    way, bent (h - 1, 3): legs at rest and deformed; around (h, 3, 3): deformation gradients around the
    joints, used only for the rotation about straight legs. By Kabsch's method.
    """
    scale = np.linalg.norm(way, axis=1)[:, None, None] ** 2
    leg = bent[:, :, None] * way[:, None, :] / scale
    wanted = _TWIST * around
    wanted[:-1] += leg
    wanted[1:] += leg
    found = nearest_rotations(wanted)
    if len(way) > 1:
        # Beyond the last inner joint a leg goes on bending as it does there.
        for end, inner, last in ((0, 1, 0), (-1, -2, -1)):
            slope = 2.0 * bent[last] - found[inner] @ way[last]
            wanted[end] = _TWIST * around[end] + slope[:, None] * way[last] / scale[last]
        found = nearest_rotations(wanted)
    return found


def _hermite(ends: Array, slopes: Array, t: Array) -> tuple[Array, Array]:
    """Points and slopes (k, 3) at t (k,) of the cubic between two ends (2, 3) with slopes (2, 3) there."""
    s = t[:, None]
    h = 2 * s**3 - 3 * s**2 + 1, s**3 - 2 * s**2 + s, 3 * s**2 - 2 * s**3, s**3 - s**2
    dh = 6 * s**2 - 6 * s, 3 * s**2 - 4 * s + 1, 6 * s - 6 * s**2, 3 * s**2 - 2 * s
    parts = ends[0], slopes[0], ends[1], slopes[1]
    return sum(a * b for a, b in zip(h, parts, strict=True)), sum(
        a * b for a, b in zip(dh, parts, strict=True)
    )


def _onto(first: Array, second: Array, vectors: Array) -> Array:
    """Vectors (k, 3) under the least rotations that turn unit vectors `first` (k, 3) into `second` (k, 3)."""
    axis = np.cross(first, second)
    cosine = (first * second).sum(axis=1, keepdims=True)
    once = np.cross(axis, vectors)
    return np.asarray(vectors + once + np.cross(axis, once) / (1.0 + cosine))
