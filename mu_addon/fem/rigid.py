"""Rigid bodies by their signed distance, and their poses."""

from __future__ import annotations

from typing import Any, Protocol

import attrs
import numpy as np

from ..arrays import Array, float64
from ..errors import InputError


class Rigid(Protocol):
    """A rigid body in its frame: a signed distance and its first two derivatives."""

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """Signed distance (k,) in mm of points (k, 3) in mm, negative inside, and its derivatives.

        Also returned: gradient (k, 3), of unit length, and second derivative (k, 3, 3) in 1/mm.
        """
        ...


def _unit(vector: Any) -> Array:
    v = float64(vector)
    length = float(np.linalg.norm(v))
    if v.shape != (3,) or not length > 0:
        raise InputError(
            f"{vector!r} is not a direction", "obstacle", "give three numbers, not all of them 0"
        )
    return v / length


@attrs.frozen(eq=False)
class Plane:
    """A half-space: `point` (3,) in mm on its surface, `normal` (3,) out of it, of any length.

    >>> import numpy as np
    >>> Plane((0, 0, 0), (0, 0, 1)).distance(np.array([[5.0, 0.0, 2.0]]))[0].tolist()
    [2.0]
    """

    point: Array = attrs.field(converter=float64)
    normal: Array = attrs.field(converter=_unit)

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """Distance (k,) in mm, gradient (k, 3) and second derivative (k, 3, 3), as `Rigid.distance`."""
        return (x - self.point) @ self.normal, np.tile(self.normal, (len(x), 1)), np.zeros((len(x), 3, 3))


@attrs.frozen(eq=False)
class Sphere:
    """A ball about `centre` (3,) of `radius` in mm."""

    centre: Array = attrs.field(converter=float64)
    radius: float

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """Distance (k,) in mm, gradient (k, 3) and second derivative (k, 3, 3), as `Rigid.distance`."""
        away = x - self.centre
        length = np.maximum(np.linalg.norm(away, axis=1), 1e-12 * self.radius)
        normal = away / length[:, None]
        return length - self.radius, normal, round_bend(normal, length)


@attrs.frozen(eq=False)
class Box:
    """A box about `centre` (3,) with half sides `half_mm` (3,) in mm along the axes.

    Outside it the distance is that of its faces, edges and corners; inside, of the nearest face.
    """

    centre: Array = attrs.field(converter=float64)
    half_mm: Array = attrs.field(converter=float64)

    def distance(self, x: Array) -> tuple[Array, Array, Array]:
        """Distance (k,) in mm, gradient (k, 3) and second derivative (k, 3, 3), as `Rigid.distance`."""
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
        turning = np.einsum("ki,ij->kij", past > 0, np.eye(3))
        bend[outside] = round_bend(normal[outside], length[outside], turning[outside])
        return distance, normal, bend


def round_bend(normal: Array, radius: Array, within: Array | None = None) -> Array:
    """Second derivative (k, 3, 3) in 1/mm of the distance from a point, or from an edge.

    normal (k, 3): the distance's gradient; radius (k,) in mm: the distance, below 0 inside. within (k, 3, 3):
    the projection on the plane across the edge, for an edge.
    """
    plane = np.eye(3) if within is None else within
    return np.asarray((plane - normal[:, :, None] * normal[:, None, :]) / radius[:, None, None])


@attrs.frozen(eq=False)
class Pose:
    """Pose of a rigid body: rotated by `rotation` (3, 3), then moved by `shift` (3,) in mm.

    Raises InputError where the matrix is not a rotation (orthogonal, determinant 1).
    """

    rotation: Array = attrs.field(converter=float64, factory=lambda: np.eye(3))
    shift: Array = attrs.field(converter=float64, factory=lambda: np.zeros(3))

    def __attrs_post_init__(self) -> None:
        r = self.rotation
        if r.shape != (3, 3) or not np.allclose(r @ r.T, np.eye(3), atol=1e-9) or np.linalg.det(r) < 0:
            raise InputError(
                "the matrix of a pose is not a rotation", "obstacle", "give one of determinant 1"
            )
