"""Material points that markers sit on, and their motion."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..fem.embedding import Probe
from ..fem.kinematics import probe
from ..measured import Experiment
from ..measured.pose import at_rest
from ..meshing.mesh import AXES, Mesh, boundary_faces


@attrs.frozen(eq=False)
class Marker:
    """A marker's measured position at rest (3,) and its material point (3,), both in mm.

    The frame is that of DESIGN section 2: z along the axis from the inlet, x = 0 the plane of bending, +y the
    side with more lattice. axes: measured coordinates; without x, the marker is assumed to lie in the plane.
    distance_mm: between the two, over the measured coordinates.
    """

    number: int
    axes: str
    seen: Array
    point: Array
    distance_mm: float


def attached(mesh: Mesh, experiments: Sequence[Experiment], farthest_mm: float) -> tuple[Marker, ...]:
    """Markers of experiments of one scale, each on the nearest point of the undeformed mesh.

    farthest_mm: largest distance admitted, in mm. Raises InputError for a marker farther than that from the
    unit or from its position in another experiment, and the errors of `at_rest`.
    """
    every = at_rest(experiments)
    found = []
    for number, (axes, seen, where) in every.items():
        point = nearest(mesh, seen)
        known = [AXES.index(a) for a in axes]
        distance = float(np.linalg.norm((point - seen)[known]))
        if distance > farthest_mm:
            place = ", ".join(f"{a} = {seen[AXES.index(a)]:.1f}" for a in axes)
            raise InputError(
                f"marker {number} lies {distance:.1f} mm from the unit, at {place} mm",
                where,
                "give positions in the unit's frame (z from the inlet along the axis, +y to the side with "
                "more lattice, x = 0 in the plane of bending) and its scale",
            )
        found.append(Marker(number, axes, seen, point, distance))
    for e in experiments:
        for number, (_, seen, _) in _again(e).items():
            apart = float(np.linalg.norm(seen - every[number][1]))
            if apart > farthest_mm:
                raise InputError(
                    f"marker {number} sits {apart:.1f} mm from where {every[number][2]} has it",
                    e.name,
                    "give markers on another place another number",
                )
    return tuple(found)


def _again(e: Experiment) -> dict[int, tuple[str, Array, str]]:
    """Return `at_rest` of one experiment, without the markers it does not show at rest."""
    try:
        return at_rest([e])
    except InputError:
        return {}


def nearest(mesh: Mesh, place: Array) -> Array:
    """The point (3,) in mm of an undeformed body nearest to `place` (3,) in mm, itself if it is inside.

    The surface is taken flat between corners of elements. Half meshes count as the whole body.
    """
    turned = np.array(
        [-1.0 if a in mesh.symmetry and x < 0 else 1.0 for a, x in zip(AXES, place, strict=True)]
    )
    try:
        probe(mesh, turned * place)
    except InputError:
        return np.asarray(turned * _on_surface(mesh, turned * place))
    return np.array(place)


def _on_surface(mesh: Mesh, place: Array) -> Array:
    faces, _ = boundary_faces(mesh.tets)
    corners = mesh.nodes[faces]
    a, edges = corners[:, 0], corners[:, 1:] - corners[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    gram = edges @ edges.transpose(0, 2, 1)
    st = np.linalg.solve(gram, (edges @ (place - a)[:, :, None]))[:, :, 0]
    within = (st >= 0).all(axis=1) & (st.sum(axis=1) <= 1) & (np.linalg.norm(normal, axis=1) > 0)
    candidates = [(a + np.einsum("fe,fei->fi", st, edges))[within]]
    for i in range(3):
        start, along = corners[:, i], corners[:, (i + 1) % 3] - corners[:, i]
        t = np.einsum("fi,fi->f", place - start, along) / np.einsum("fi,fi->f", along, along)
        candidates.append(start + np.clip(t, 0, 1)[:, None] * along)
    points = np.concatenate(candidates)
    return np.asarray(points[np.linalg.norm(points - place, axis=1).argmin()])


@attrs.frozen(eq=False)
class MaterialPoints:
    """Material points (p, 3) in mm that move with a mesh.

    sides (p, 3): -1 in the directions in which a point lies beyond a mirror plane of a half or quarter mesh,
    else 1. probe: interpolates displacements at the mirrored points.
    """

    points: Array
    sides: Array
    probe: Probe

    def at(self, u: Array) -> Array:
        """Positions (p, 3) in mm of the points under nodal displacements u (n, 3) in mm."""
        return np.asarray(self.points + self.sides * self.probe.displacement(u))


def material_points(mesh: Mesh, points: Array) -> MaterialPoints:
    """Material points at the positions of a mesh nearest to `points` (p, 3), in mm.

    The mesh may be a half or quarter of the unit; see `MaterialPoints`.
    """
    mirrored = [AXES.index(a) for a in mesh.symmetry]
    sides = np.ones((len(points), 3))
    sides[:, mirrored] = np.where(np.asarray(points)[:, mirrored] < 0, -1.0, 1.0)
    near = np.array([nearest(mesh, p) for p in points]).reshape(-1, 3)
    if not len(near):
        return MaterialPoints(near, sides, Probe(np.empty((0, 4), int), np.empty((0, 4))))
    return MaterialPoints(near, sides, probe(mesh, sides * near))
