"""Closed surfaces that mark a path or a point in a picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..design.block import FACES, Block

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]


def tube(points: ArrayLike, radius: float, sides: int = 20) -> Mesh:
    """Vertices (v, 3) and faces (f, 3) of a round-ended tube along a polyline (n, 3), closed and outward.

    radius: in the unit of the points, such as mm; sides: flat pieces around it.
    """
    line = np.asarray(points, float)
    steps = np.diff(line, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    along = np.vstack([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # Half a ball at each end: rings of shrinking radius that step ahead of the end point.
    bow = np.linspace(0.0, 0.5 * np.pi, sides // 4 + 1)
    centers = np.vstack(
        [
            line[0] - radius * np.sin(bow[::-1])[:, None] * along[0],
            line[1:-1],
            line[-1] + radius * np.sin(bow)[:, None] * along[-1],
        ]
    )
    tangents = np.vstack([np.repeat(along[:1], len(bow), 0), along[1:-1], np.repeat(along[-1:], len(bow), 0)])
    radii = np.concatenate([np.cos(bow[::-1]), np.ones(len(line) - 2), np.cos(bow)]) * radius
    across = _carried(tangents)
    turn = np.arange(sides) * 2.0 * np.pi / sides
    rings = (
        centers[:, None]
        + radii[:, None, None] * np.cos(turn)[:, None] * across[:, None]
        + radii[:, None, None] * np.sin(turn)[:, None] * np.cross(tangents, across)[:, None]
    )
    i = np.arange(len(rings) - 1)[:, None] * sides
    a, b = i + np.arange(sides), i + (np.arange(sides) + 1) % sides
    faces = np.stack([a, b, b + sides, a, b + sides, a + sides], axis=-1).reshape(-1, 3)
    return rings.reshape(-1, 3), faces


def ball(center: ArrayLike, radius: float, sides: int = 24) -> Mesh:
    """Vertices (v, 3) and faces (f, 3) of a ball around `center` (3,), closed and outward.

    radius: in the unit of the centre, such as mm; sides: flat pieces around it.
    """
    middle = np.asarray(center, float)
    short = np.array([0.0, 0.0, 1e-3 * radius])
    return tube([middle - short, middle + short], radius, sides)


def box(low: ArrayLike, high: ArrayLike) -> Mesh:
    """Corners (8, 3) and outward faces (12, 3) of a box between two corners (3,)."""
    a, b = np.asarray(low, float), np.asarray(high, float)
    block = Block((a + b) / 2.0, np.eye(3), (b - a) / 2.0)
    return block.corners, np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])


def _carried(tangents: NDArray[Any]) -> NDArray[np.float64]:
    """Unit vectors (n, 3) across `tangents` that turn no more than they must from one to the next."""
    across = np.empty_like(tangents)
    aside = np.eye(3)[np.argmin(np.abs(tangents[0]))]
    for k, tangent in enumerate(tangents):
        aside = aside - (aside @ tangent) * tangent
        aside /= np.linalg.norm(aside)
        across[k] = aside
    return across
