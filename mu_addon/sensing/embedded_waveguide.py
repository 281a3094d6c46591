"""A printed waveguide in a body that deforms: its lattice's nodes move and turn, and it bends between them.

A bar is joined to the lattice at its path's nodes alone. There the struts fix its position and direction.
Between two nodes it is an unloaded Euler-Bernoulli beam: its axis is the cubic with the ends' positions and
directions. Its own stiffness, which slightly restrains the lattice, is neglected.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.waveguide import Bar
from ..fem.kinematics import MIRROR, mean_gradients, numbers_of
from ..meshing.mesh import Mesh
from .guide import Centreline

_STEPS_A_MM = 4
_STRAIGHT = 1e-6


@attrs.frozen(eq=False)
class WaveguideShape:
    """A waveguide as light sees it: section, wells and junctions, in mm.

    wells: lengths of their centres, junctions: intervals of length that open into struts; lengths count
    from the entry's end face along the axis at rest.
    """

    width: float
    height: float
    wells: tuple[float, ...]
    well_width: float
    well_depth: float
    junctions: tuple[tuple[float, float], ...] = ()


@attrs.frozen(eq=False)
class EmbeddedWaveguide:
    """A printed waveguide at rest, and the lattice nodes that carry it.

    shape: its section and wells. nodes (h, 3) in mm: the lattice's. points (m, 3): the nodes, with an end
    face before and after them; s (m,): lengths in mm along the axis; joint (m,): number of the node that
    carries each point; normals (m - 1, 3): of the face with the wells, for each piece of the axis.
    """

    shape: WaveguideShape
    nodes: Array
    points: Array
    s: Array
    joint: Array
    normals: Array

    @property
    def at_rest(self) -> tuple[Centreline, ...]:
        """The axis as printed, one centreline from each bend to the next (see `legs`)."""
        return self.legs(self.nodes, np.tile(np.eye(3), (len(self.nodes), 1, 1)))

    def legs(self, positions: Array, rotations: Array) -> tuple[Centreline, ...]:
        """The axis where the nodes are at positions (h, 3) in mm, turned by rotations (h, 3, 3).

        One centreline from each bend of the bar at rest to the next, with s continuous. Between two nodes the
        axis is the cubic of a beam without load (Euler and Bernoulli).
        """
        way = np.diff(self.points, axis=0) / np.diff(self.s)[:, None]
        found: list[list[tuple[Array, Array, Array]]] = []
        for k in range(len(way)):
            if not found or np.linalg.norm(way[k] - way[k - 1]) > _STRAIGHT:
                found.append([])
            found[-1].append(self._piece(k, way[k], positions, rotations))
        return tuple(_joined(pieces) for pieces in found)

    def _piece(self, k: int, way: Array, positions: Array, rotations: Array) -> tuple[Array, Array, Array]:
        """Lengths (n,), points (n, 3) and normals (n, 3) of one piece."""
        length = self.s[k + 1] - self.s[k]
        t = np.linspace(0.0, 1.0, max(3, int(_STEPS_A_MM * length)) + 1)[:, None]
        first, last = self.joint[k], self.joint[k + 1]
        begin, end = rotations[first] @ way, rotations[last] @ way
        normals = (1 - t) * (rotations[first] @ self.normals[k]) + t * (rotations[last] @ self.normals[k])
        if first == last:
            # Beyond an end node nothing holds it: it goes on straight.
            at_node = self.s[k + 1] if first == 0 else self.s[k]
            points = positions[first] + (self.s[k] + t * length - at_node) * begin
        else:
            a, b = positions[first], positions[last]
            now = float(np.linalg.norm(b - a))
            points = (
                (1 + 2 * t) * (1 - t) ** 2 * a
                + t * (1 - t) ** 2 * now * begin
                + t**2 * (3 - 2 * t) * b
                - t**2 * (1 - t) * now * end
            )
        tangent = np.gradient(points, axis=0, edge_order=2)
        tangent /= np.linalg.norm(tangent, axis=1)[:, None]
        normals -= tangent * np.einsum("ni,ni->n", tangent, normals)[:, None]
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        return self.s[k] + t[:, 0] * length, points, normals


def _joined(pieces: Sequence[tuple[Array, Array, Array]]) -> Centreline:
    first = pieces[0]
    rest = [tuple(values[1:] for values in piece) for piece in pieces[1:]]
    return Centreline(*(np.concatenate(values) for values in zip(first, *rest, strict=True)))


def embed_waveguide(bar: Bar, nodes: Array, d: Dimensions) -> EmbeddedWaveguide:
    """A printed waveguide with its wells, carried by the lattice nodes (h, 3) in mm of its path.

    bar: from `design.waveguide`. d: sizes of section, wells and struts as they are printed. At every node
    struts open the waveguide's sides over their diameter.
    """
    corners = _lengths(bar.points)
    first = float(np.linalg.norm(nodes[0] - bar.points[0]))
    at_nodes = first + _lengths(nodes)
    points, s, joint = nodes, at_nodes, np.arange(len(nodes))
    if first > _STRAIGHT:
        points, s, joint = np.vstack([bar.points[:1], points]), np.r_[0.0, s], np.r_[0, joint]
    if corners[-1] - s[-1] > _STRAIGHT:
        points, s = np.vstack([points, bar.points[-1:]]), np.r_[s, corners[-1]]
        joint = np.r_[joint, joint[-1]]
    leg = np.searchsorted(corners, (s[1:] + s[:-1]) / 2, side="right") - 1
    halves = np.maximum(d.junction_diameters(nodes), d.waveguide_section) / 2
    total = float(corners[-1])
    shape = WaveguideShape(
        d.waveguide_section,
        d.waveguide_section,
        tuple(_along(bar.points, corners, well.centre) for well in bar.wells),
        d.well_width,
        d.well_depth,
        tuple(
            (max(0.0, at - half), min(total, at + half))
            for at, half in zip(at_nodes.tolist(), halves.tolist(), strict=True)
        ),
    )
    return EmbeddedWaveguide(shape, nodes, points, s, joint, bar.normals[leg])


def _lengths(points: Array) -> Array:
    """Lengths (n,) along a polyline (n, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _along(points: Array, corners: Array, centre: Array) -> float:
    """Length along a polyline (n, 3) with corners at lengths (n,) that is nearest to a well's centre."""
    nearest, found = np.inf, 0.0
    for (a, b), start in zip(pairwise(points), corners, strict=False):
        length = float(np.linalg.norm(b - a))
        along = float(np.clip((centre - a) @ (b - a) / length, 0.0, length))
        away = float(np.linalg.norm(a + along / length * (b - a) - centre))
        if away < nearest - 1e-9:
            nearest, found = away, float(start) + along
    return found


@attrs.frozen(eq=False)
class Joints:
    """Lattice nodes (n, 3) in mm in a mesh: each moves and rotates as the body around it does.

    The elements around a joint's node are taken.
    """

    nodes: Array
    _gradients: Callable[[Array], tuple[Array, Array]]

    @classmethod
    def of(cls, mesh: Mesh, nodes: Array) -> Joints:
        """Joints at nodes (n, 3) in mm of an undeformed mesh, half or whole.

        Raises InputError where the mesh has no joint.
        """
        return cls(nodes, _of_joints(mesh, nodes))

    def moved(self, u: Array) -> tuple[Array, Array]:
        """Positions (n, 3) in mm and rotations (n, 3, 3) after displacements (nodes of the mesh, 3) in mm.

        The rotation is that of the mean deformation around the node (polar decomposition). A symmetric strain
        rotates no node whose struts have cubic symmetry.
        """
        at, F = self._gradients(u)
        left, _, right = np.linalg.svd(F)
        return self.nodes + at, left @ right


def _of_joints(mesh: Mesh, nodes: Array) -> Callable[[Array], tuple[Array, Array]]:
    """Function of displacements: those (n, 3) of a printed body's joints, and the gradients (n, 3, 3) there.

    Joints across the mirror plane of a half mesh move as their images do.
    """
    across = (nodes[:, 0] < 0) & ("x" in mesh.symmetry)
    side = np.where(across[:, None], MIRROR, 1.0)
    numbers = numbers_of(mesh, side * nodes)
    # A joint and its image are one.
    distinct, place = np.unique(numbers, return_inverse=True)

    def gradients(u: Array) -> tuple[Array, Array]:
        F = mean_gradients(mesh, u, distinct)[place]
        return side * u[numbers], side[:, :, None] * F * side[:, None, :]

    return gradients
