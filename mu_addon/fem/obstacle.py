"""Rigid bodies that a deforming body may touch: frictionless contact by a penalty of stated depth."""

from __future__ import annotations

from typing import Any, Protocol

import attrs
import numpy as np

from ..errors import InputError
from ..meshing.mesh import AXES, TRIANGLE_EDGES, Mesh, boundary_faces
from ..meshing.quality import shapes
from .contact import with_middles
from .descent import NewtonSettings
from .elements import triangle_quadrature

Array = np.ndarray[Any, Any]

# Points that begin to touch change the tangent, so an old factor is soon of no use; and a body that is
# stopped ends far from where it was predicted.
CONTACT = NewtonSettings(keep_factor=0.2, max_factorisations=40, surprise=3.0)


def _float64(values: Any) -> Array:
    return np.ascontiguousarray(values, np.float64)


class Rigid(Protocol):
    """A rigid body in its own frame: a signed distance and its first two derivatives."""

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """Distance (k,) of points (k, 3), negative inside, its gradient (k, 3) and its bend (k, 3, 3)."""
        ...


def _unit(vector: Any) -> Array:
    v = _float64(vector)
    length = float(np.linalg.norm(v))
    if v.shape != (3,) or not length > 0:
        raise InputError(f"{vector!r} is no direction", "obstacle", "give three numbers, not all of them 0")
    return v / length


@attrs.frozen(eq=False)
class Plane:
    """A half-space through `point` (3,) in mm; `normal` (3,) points out of it, to the free side."""

    point: Array = attrs.field(converter=_float64)
    normal: Array = attrs.field(converter=_unit)

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """See Rigid."""
        return (x - self.point) @ self.normal, np.tile(self.normal, (len(x), 1)), np.zeros((len(x), 3, 3))


@attrs.frozen(eq=False)
class Sphere:
    """A ball about `centre` (3,) of `radius` in mm."""

    centre: Array = attrs.field(converter=_float64)
    radius: float

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """See Rigid."""
        away = x - self.centre
        length = np.maximum(np.linalg.norm(away, axis=1), 1e-12 * self.radius)
        normal = away / length[:, None]
        return length - self.radius, normal, _round(normal, length)


@attrs.frozen(eq=False)
class Box:
    """A box about `centre` (3,) with half sides (3,) in mm along the axes.

    Outside it the distance is that of its faces, edges and corners; inside, of the nearest face.
    """

    centre: Array = attrs.field(converter=_float64)
    half_mm: Array = attrs.field(converter=_float64)

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """See Rigid."""
        away = x - self.centre
        beyond = np.abs(away) - self.half_mm
        sign = np.where(away < 0, -1.0, 1.0)
        past = np.maximum(beyond, 0.0)
        length = np.linalg.norm(past, axis=1)
        outside = length > 0
        nearest = beyond.argmax(axis=1)
        normal = np.zeros_like(x)
        rows = np.arange(len(x))
        normal[rows, nearest] = sign[rows, nearest]
        distance = beyond[rows, nearest]
        bend = np.zeros((len(x), 3, 3))
        normal[outside] = sign[outside] * past[outside] / length[outside, None]
        distance[outside] = length[outside]
        # Only directions that point past a face turn the normal.
        turning = (past > 0).astype(float)
        bend[outside] = _round(normal[outside], length[outside], turning[outside])
        return distance, normal, bend


def _round(normal: Array, radius: Array, within: Array | None = None) -> Array:
    """Second derivative (k, 3, 3) of the distance from a point, edge (`within` two axes) or face."""
    eye = np.eye(3) if within is None else np.einsum("ki,ij->kij", within, np.eye(3))
    return np.asarray((eye - normal[:, :, None] * normal[:, None, :]) / radius[:, None, None])


@attrs.frozen(eq=False)
class Pose:
    """Where a rigid body is: turned by `rotation` (3, 3), then moved by `shift` (3,) in mm."""

    rotation: Array = attrs.field(converter=_float64, factory=lambda: np.eye(3))
    shift: Array = attrs.field(converter=_float64, factory=lambda: np.zeros(3))

    def __attrs_post_init__(self) -> None:
        r = self.rotation
        if r.shape != (3, 3) or not np.allclose(r @ r.T, np.eye(3), atol=1e-9) or np.linalg.det(r) < 0:
            raise InputError("the matrix of a pose is no rotation", "obstacle", "give one of determinant 1")


class Obstacle:
    """Frictionless contact of a mesh's outer surface with a rigid body, as a term of `Model.obstacles`.

    Where a point of the surface is a depth s inside, the obstacle presses on it with k s^2/(2 d) for s < d
    and k (s - d/2) beyond, in MPa on the undeformed area, along the distance's gradient. d is `depth_mm`, k
    such that at `pressure_MPa` the depth is d: that is the gap's error, `deepest_mm` what a state has of it.
    Force and tangent are continuous, and the energy is a potential of the displacement. `pose` may be set
    between equilibria, as an obstacle that moves has it. Faces of the base, the cavity and mirror planes do
    not touch. halvings: of a face's sides, before the quadrature's points are laid on the pieces: large faces
    feel an obstacle up to near their edges only with some. Raises InputError.
    """

    def __init__(
        self, mesh: Mesh, rigid: Rigid, pressure_MPa: float, depth_mm: float, halvings: int = 0
    ) -> None:
        if not (pressure_MPa > 0 and depth_mm > 0):
            raise InputError(
                f"a contact of {pressure_MPa:g} MPa at {depth_mm:g} mm of depth",
                "obstacle",
                "give both above 0: the contact pressure to expect, and how deep it may press in there",
            )
        self.rigid, self.pose = rigid, Pose()
        self.depth_mm = depth_mm
        self.stiffness = 2 * pressure_MPa / depth_mm
        self._rest = mesh.nodes
        self.faces = outer_faces(mesh)
        points, weight = _subdivided(*triangle_quadrature(mesh.order), halvings)
        self._shape, derivative = shapes(points, TRIANGLE_EDGES, mesh.order)
        tangents = np.einsum("fni,qnk->kfqi", mesh.nodes[self.faces], derivative)
        self._area = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=-1) * weight
        self._pairs = np.stack(np.triu_indices(self.faces.shape[1]), axis=1)

    def energy_mJ(self, u: Array) -> float:
        """Energy stored in the contact at displacement (n, 3) in mm."""
        s = np.maximum(-self._gaps(u)[0], 0.0)
        d, k = self.depth_mm, self.stiffness
        density = np.where(s < d, s**3 / (6 * d), s**2 / 2 - d * s / 2 + d**2 / 6)
        return float((self._area * k * density).sum())

    def forces(self, u: Array) -> tuple[Array, Array]:
        """Nodes (j,) of faces in contact, and the energy's derivative by their displacement (j, 3) in N."""
        face, area, pressure, _, normal, _ = self._touching(u)
        of_nodes = -np.einsum("fq,qa,fqi->fai", area * pressure, self._shape, normal)
        return self.faces[face].ravel(), of_nodes.reshape(-1, 3)

    def blocks(self, u: Array) -> tuple[Array, Array]:
        """Second derivative of the energy: pairs (j, 2) of nodes of one face, each once, blocks (j, 3, 3)."""
        face, area, pressure, slope, normal, bend = self._touching(u)
        at_points = slope[..., None, None] * normal[..., :, None] * normal[..., None, :]
        at_points -= pressure[..., None, None] * bend
        a, b = self._pairs.T
        shapes = self._shape[:, a] * self._shape[:, b]
        blocks = np.einsum("fq,qp,fqij->fpij", area, shapes, at_points)
        pairs = self.faces[face][:, self._pairs]
        return pairs.reshape(-1, 2), blocks.reshape(-1, 3, 3)

    def force_N(self, u: Array) -> Array:
        """Force (3,) of the meshed body on the obstacle; of a half mesh, of that half."""
        _, forces = self.forces(u)
        return np.asarray(forces.sum(axis=0))

    def places(self, u: Array) -> Array:
        """The surface's points (f, q, 3) that may touch, in mm."""
        return np.asarray(np.einsum("qa,fai->fqi", self._shape, (self._rest + u)[self.faces]))

    def gap_mm(self, u: Array) -> float:
        """Least distance of the surface's points from the obstacle, negative where they touch."""
        return float(self._gaps(u)[0].min())

    def deepest_mm(self, u: Array) -> float:
        """How deep the surface is in the obstacle at most: the error of the gap."""
        return max(0.0, -self.gap_mm(u))

    def pressures_MPa(self, u: Array) -> tuple[Array, Array]:
        """Places (k, 3) in mm of the surface's points in contact, and the pressure (k,) on each."""
        face, _, pressure, *_ = self._touching(u)
        x = np.einsum("qa,fai->fqi", self._shape, (self._rest + u)[self.faces[face]])
        on = pressure > 0
        return x[on], pressure[on]

    def _gaps(self, u: Array, faces: Array | None = None) -> tuple[Array, Array, Array]:
        """Distance (f, q), gradient (f, q, 3) and second derivative (f, q, 3, 3) at points of faces."""
        chosen = self.faces if faces is None else faces
        x = np.einsum("qa,fai->fqi", self._shape, (self._rest + u)[chosen])
        r, shift = self.pose.rotation, self.pose.shift
        g, n, h = self.rigid.distance((x.reshape(-1, 3) - shift) @ r)
        shape = x.shape[:2]
        return g.reshape(shape), (n @ r.T).reshape(*shape, 3), (r @ h @ r.T).reshape(*shape, 3, 3)

    def _touching(self, u: Array) -> tuple[Array, ...]:
        """Faces in contact (f,); at their points area, pressure, its slope, gradient, second derivative."""
        face = np.flatnonzero((self._gaps(u)[0] < 0).any(axis=1))
        g, n, h = self._gaps(u, self.faces[face])
        s, d, k = np.maximum(-g, 0.0), self.depth_mm, self.stiffness
        pressure = np.where(s < d, k * s**2 / (2 * d), k * (s - d / 2))
        return face, self._area[face], pressure, np.where(s < d, k * s / d, k), n, h


def _subdivided(points: Array, weight: Array, halvings: int) -> tuple[Array, Array]:
    """A triangle's quadrature, barycentric points (q, 3) and weights (q,), on its 4^halvings equal pieces."""
    pieces = np.eye(3)[None]
    for _ in range(halvings):
        a, b, c = pieces[:, 0], pieces[:, 1], pieces[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        corners = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab))
        pieces = np.concatenate([np.stack(t, axis=1) for t in corners])
    return (points @ pieces).reshape(-1, 3), np.tile(weight, len(pieces)) / len(pieces)


def outer_faces(mesh: Mesh) -> Array:
    """Faces (f, 3 | 6) of a mesh that something outside can touch: neither cavity, base nor mirror plane."""
    faces, owner = boundary_faces(mesh.tets)
    cavity = {tuple(f) for f in np.sort(mesh.cavity_corners, axis=1).tolist()}
    keep = np.array([tuple(f) not in cavity for f in np.sort(faces, axis=1).tolist()])
    keep &= ~np.isin(faces, mesh.base).all(axis=1)
    for axis in mesh.symmetry:
        keep &= ~(mesh.nodes[faces, AXES.index(axis)] == 0.0).all(axis=1)
    faces, owner = faces[keep], owner[keep]
    return with_middles(faces, mesh.tets[owner]) if mesh.order == 2 else faces
