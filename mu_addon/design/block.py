"""A box turned any way in space: wells, seats and pockets of a waveguide."""

from __future__ import annotations

from itertools import product
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Corners of a box as signs along its axes, the last running fastest; and its faces, outward.
_SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))
FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


@attrs.frozen(eq=False)
class Block:
    """A box of centre (3,) and half sizes (3,) in mm along orthonormal, right-handed axes, rows of (3, 3)."""

    centre: Array
    axes: Array
    half: Array

    @classmethod
    def between(cls, low: ArrayLike, high: ArrayLike, origin: ArrayLike, axes: Array) -> Block:
        """The box from low to high (3,), told along the axes from an origin (3,), mm."""
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
        """The box with the face that looks along an axis, 0 to 2, moved outward by `by` mm."""
        more = by / 2.0 * np.eye(3)[axis]
        return Block(self.centre + more @ self.axes, self.axes, self.half + more)

    def points(self, step: float) -> Array:
        """Points (n, 3) of a grid of at most `step` mm that fills the box, its corners among them."""
        counts = np.maximum(2, np.ceil(2.0 * self.half / step).astype(int) + 1)
        ticks = [np.linspace(-h, h, n) for h, n in zip(self.half, counts, strict=True)]
        return np.asarray(self.centre + np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, 3) @ self.axes)

    def solid(self) -> Any:
        """The box as a Manifold."""
        from manifold3d import Manifold, Mesh64

        triangles = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])
        return Manifold(Mesh64(self.corners, triangles.astype(np.uint64)))


def face_moves(normals: Array, offset: Array) -> Array:
    """How far (n,) flat faces of unit normals (n, 3) move for offsets (3,) along x, y and z of one sign."""
    moves = np.linalg.norm(normals * offset, axis=-1)
    return np.asarray(-moves if (offset < 0.0).any() else moves)
