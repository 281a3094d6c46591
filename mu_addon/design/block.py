"""A box in any orientation: wells, seats and pockets of a waveguide."""

from __future__ import annotations

from itertools import product
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array

# Corners of a box as signs along its axes, the last running fastest; and its faces, outward.
_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))
FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


@attrs.frozen(eq=False)
class Block:
    """A box with its centre (3,) and half sizes (3,) in mm; the rows of axes (3, 3) are its unit vectors.

    axes: orthonormal and right-handed; `half` is given along them.
    """

    centre: Array
    axes: Array
    half: Array

    @classmethod
    def between(cls, low: ArrayLike, high: ArrayLike, origin: ArrayLike, axes: Array) -> Block:
        """The box from corner `low` (3,) to `high` (3,), both in mm in a local frame.

        origin (3,): the frame's origin in mm; axes (3, 3): its unit vectors as rows.
        """
        low, high = np.asarray(low, float), np.asarray(high, float)
        return cls(np.asarray(origin, float) + (low + high) / 2.0 @ axes, axes, (high - low) / 2.0)

    @property
    def corners(self) -> Array:
        """Corners (8, 3) in mm, the third axis running fastest."""
        return np.asarray(self.centre + (_SIGNS * self.half) @ self.axes)

    @property
    def volume(self) -> float:
        """Volume in mm3."""
        return float(8.0 * np.prod(self.half))

    def grown(self, offset: Array) -> Block:
        """The box with each face moved outward by |D n|, D = diag(offset (3,)) in mm, inward if negative."""
        return attrs.evolve(self, half=self.half + face_moves(self.axes, offset))

    def longer(self, axis: int, by: float) -> Block:
        """The box with one face moved outward by `by` mm: the face whose outward normal is +axis, 0 to 2."""
        more = by / 2.0 * np.eye(3)[axis]
        return Block(self.centre + more @ self.axes, self.axes, self.half + more)

    def points(self, step: float) -> Array:
        """Points (n, 3) in mm of a regular grid that fills the box, its corners among them.

        step: largest distance in mm between neighbours along each axis.
        """
        counts = np.maximum(2, np.ceil(2.0 * self.half / step).astype(int) + 1)
        ticks = [np.linspace(-h, h, n) for h, n in zip(self.half, counts, strict=True)]
        return np.asarray(self.centre + np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, 3) @ self.axes)

    def solid(self) -> Any:
        """The box as a manifold3d.Manifold, in mm."""
        from manifold3d import Manifold, Mesh64

        triangles = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])
        return Manifold(Mesh64(self.corners, triangles.astype(np.uint64)))


def face_moves(normals: Array, offset: Array) -> Array:
    """Distances (n,) in mm by which flat faces of unit normals (n, 3) move along their normals.

    offset (3,): the print offset D along x, y and z in mm, all of one sign; a face moves by |D n|, inward if
    the offset is negative.
    """
    moves = np.linalg.norm(normals * offset, axis=-1)
    return np.asarray(-moves if (offset < 0.0).any() else moves)
