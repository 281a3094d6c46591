"""Where the walls of a deformed cavity have passed through each other, which no contact here prevents."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..meshing.mesh import Mesh, mirror
from ..meshing.surface import Surface, winding_number

Array = np.ndarray[Any, Any]

# Probe points lie this far inside the cavity, as a share of the size of their facet: the face itself, or
# the one between its mid-edge nodes.
_INSIDE = 0.02


@attrs.frozen(eq=False)
class SelfContact:
    """Share of the cavity surface that has penetrated another part of it, and where in mm (3,), or None."""

    share: float
    place: Array | None

    @property
    def where(self) -> str:
        """The place as text, in whole mm."""
        return "" if self.place is None else "(" + ", ".join(f"{c:.0f}" for c in self.place) + ")"


def self_contact(mesh: Mesh, u: Array) -> SelfContact:
    """Find penetrated parts of the cavity surface of a mesh displaced by u (n, 3) in mm.

    A point just inside the cavity, next to its wall, is wound once by the closed cavity surface;
    next to walls that have passed through each other it is wound twice, or not at all.
    """
    count = len(mesh.cavity)
    for axis in mesh.symmetry:
        u = _mirrored(mesh, u, axis)
        mesh = mirror(mesh, axis)
    x = mesh.nodes + u
    # One point a face, and on one side of each mirror plane only: the images answer alike.
    corners = x[mesh.cavity[:count, -3:]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice_area = np.linalg.norm(normal, axis=1)
    points = corners.mean(axis=1) + _INSIDE * normal / np.sqrt(twice_area)[:, None]
    # Cavity normals point into it; a surface that winds once around its inside has them outward.
    winding = winding_number(Surface(x, _facets(mesh.cavity)[:, ::-1]), points)
    wrong = np.abs(winding - 1) > 0.5
    if not wrong.any():
        return SelfContact(0.0, None)
    share = twice_area[wrong].sum() / twice_area.sum()
    return SelfContact(float(share), np.average(points[wrong], axis=0, weights=twice_area[wrong]))


def _mirrored(mesh: Mesh, u: Array, axis: str) -> Array:
    """Displacement of `mirror(mesh, axis)`, of a displacement (n, 3) of the mesh."""
    column = "xyz".index(axis)
    off = np.ones(len(mesh.nodes), bool)
    off[mesh.symmetry_nodes(axis)] = False
    image = u[off].copy()
    image[:, column] *= -1
    return np.vstack([u, image])


def _facets(faces: Array) -> Array:
    """Flat triangles of faces (f, 3 | 6): four for one with mid-edge nodes."""
    if faces.shape[1] == 3:
        return faces
    return np.vstack([faces[:, [0, 3, 5]], faces[:, [3, 1, 4]], faces[:, [5, 4, 2]], faces[:, [3, 4, 5]]])
