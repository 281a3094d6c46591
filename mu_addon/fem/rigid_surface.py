"""A rigid body bounded by a closed surface of triangles, by its signed distance."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import warp as wp

from ..arrays import Array
from ..design.body import Body, body_of, flaws, require_sound
from .rigid import round_bend

# Regions of a triangle: its face, edges ab, bc, ca, and corners a, b, c.
_FACE, _EDGE, _CORNER = 0, 1, 4


class Surface:
    """The inside of a closed surface: vertices (n, 3) in mm and triangles (m, 3) that look outward.

    The distance is exact in float64; where several triangles are equally near, to float32, any is taken. Its
    sign is that of the pseudonormal of the nearest face, edge or vertex (Baerentzen and Aanaes, IEEE Trans.
    Vis. Comput. Graph. 11 (2005) 243), so that it holds at every edge and vertex. Raises InputError for a
    surface that is open, cuts itself or is of several parts, as `design.body.flaws` has it.
    """

    def __init__(self, vertices: Any, triangles: Any, name: str = "obstacle") -> None:
        body = body_of(vertices, triangles, name)
        require_sound(body, flaws(body), "an obstacle")
        self.body: Body = body
        self._corners = body.vertices[body.triangles]
        self._middle = body.bounds.mean(axis=0)

    @cached_property
    def _normals(self) -> Array:
        """Pseudonormals (m, 7, 3), not of unit length but of faces, of every triangle's regions."""
        t, p = self.body.triangles, self._corners
        sides = np.roll(p, -1, axis=1) - p
        face = np.cross(sides[:, 0], sides[:, 1])
        face /= np.linalg.norm(face, axis=1)[:, None]
        edges = np.sort(np.stack([t, np.roll(t, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
        _, number = np.unique(edges, axis=0, return_inverse=True)
        of_edges = np.zeros((number.max() + 1, 3))
        np.add.at(of_edges, number.ravel(), np.repeat(face, 3, axis=0))
        out = sides / np.linalg.norm(sides, axis=2)[:, :, None]
        cosine = -(out * np.roll(out, 1, axis=1)).sum(axis=2)
        angle = np.arccos(np.clip(cosine, -1, 1))
        of_corners = np.zeros_like(self.body.vertices)
        np.add.at(of_corners, t, angle[:, :, None] * face[:, None, :])
        return np.concatenate([face[:, None], of_edges[number.reshape(-1, 3)], of_corners[t]], axis=1)

    @cached_property
    def _search(self) -> wp.Mesh:
        points = wp.array((self.body.vertices - self._middle).astype(np.float32), dtype=wp.vec3, device="cpu")
        indices = wp.array(self.body.triangles.astype(np.int32).ravel(), dtype=int, device="cpu")
        return wp.Mesh(points, indices)

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """Distance (k,) in mm, gradient (k, 3) and second derivative (k, 3, 3), as `Rigid.distance`.

        The second derivative is that about the nearest edge or vertex, and 0 where a face is nearest.
        """
        near = self._nearest(x)
        a, b, c = np.moveaxis(self._corners[near], 1, 0)
        foot, region = _closest(x, a, b, c)
        normal = self._normals[near, region]
        away = x - foot
        sign = np.where((away * normal).sum(axis=1) < 0, -1.0, 1.0)
        length = np.linalg.norm(away, axis=1)
        on = length < 1e-12
        face = region == _FACE
        normal = normal / np.linalg.norm(normal, axis=1)[:, None]
        turns = ~face & ~on
        normal[turns] = sign[turns, None] * away[turns] / length[turns, None]
        distance = np.where(face, (away * normal).sum(axis=1), sign * length)
        bend = np.zeros((len(x), 3, 3))
        within = np.tile(np.eye(3), (len(x), 1, 1))
        for k, (start, end) in enumerate(((a, b), (b, c), (c, a))):
            here = region == _EDGE + k
            along = (end - start)[here]
            along /= np.linalg.norm(along, axis=1)[:, None]
            within[here] -= along[:, :, None] * along[:, None, :]
        bend[turns] = round_bend(normal[turns], sign[turns] * length[turns], within[turns])
        return distance, normal, bend

    def _nearest(self, x: Array) -> Array:
        """The nearest triangle of points (k, 3), (k,)."""
        points = wp.array((x - self._middle).astype(np.float32), dtype=wp.vec3, device="cpu")
        found = wp.empty(len(x), dtype=int, device="cpu")
        reach = float(np.linalg.norm(x - self._middle, axis=1).max(initial=0.0))
        reach += float(np.linalg.norm(np.ptp(self.body.bounds, axis=0)))
        wp.launch(_nearest_face, len(x), [self._search.id, points, reach, found], device="cpu")
        return np.asarray(found.numpy())


@wp.kernel
def _nearest_face(
    mesh: wp.uint64,
    points: wp.array(dtype=wp.vec3),  # type: ignore[valid-type]
    reach: float,
    found: wp.array(dtype=int),  # type: ignore[valid-type]
) -> None:
    i = wp.tid()
    found[i] = wp.mesh_query_point_no_sign(mesh, points[i], reach).face


def _closest(p: Array, a: Array, b: Array, c: Array) -> tuple[Array, Array]:
    """Nearest points (k, 3) of triangles a, b, c to p (k, 3), and the region (k,) each lies in.

    Source: Ericson, Real-Time Collision Detection, 2005, 5.1.5.
    """

    def dot(u: Array, v: Array) -> Array:
        return np.asarray((u * v).sum(axis=1))

    ab, ac, bc = b - a, c - a, c - b
    d1, d2 = dot(ab, p - a), dot(ac, p - a)
    d3, d4 = dot(ab, p - b), dot(ac, p - b)
    d5, d6 = dot(ab, p - c), dot(ac, p - c)
    of_a: Array = d3 * d6 - d5 * d4
    of_b: Array = d5 * d2 - d1 * d6
    of_c: Array = d1 * d4 - d3 * d2
    whole: Array = of_a + of_b + of_c
    regions = [
        ((d1 <= 0) & (d2 <= 0), _CORNER, a),
        ((d3 >= 0) & (d4 <= d3), _CORNER + 1, b),
        ((d6 >= 0) & (d5 <= d6), _CORNER + 2, c),
        ((of_c <= 0) & (d1 >= 0) & (d3 <= 0), _EDGE, a + _share(d1, d1 - d3) * ab),
        ((of_a <= 0) & (d4 >= d3) & (d5 >= d6), _EDGE + 1, b + _share(d4 - d3, d4 - d3 + d5 - d6) * bc),
        ((of_b <= 0) & (d2 >= 0) & (d6 <= 0), _EDGE + 2, a + _share(d2, d2 - d6) * ac),
    ]
    foot = a + _share(of_b, whole) * ab + _share(of_c, whole) * ac
    region = np.full(len(p), _FACE)
    # The first that holds counts, so the last is laid down first.
    for holds, which, place in reversed(regions):
        foot[holds] = place[holds]
        region[holds] = which
    return foot, region


def _share(part: Array, whole: Array) -> Array:
    return np.asarray(part / np.where(whole == 0, 1.0, whole))[:, None]
