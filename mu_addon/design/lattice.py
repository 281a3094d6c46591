"""The body-centred lattice envelope as nodes and tapered struts."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from .parameters import Dimensions

DIRECTIONS = np.array(list(product((-1, 1), repeat=3)))
"""(8, 3) signs of the half-diagonals from a cell's centre to its corners."""


@attrs.frozen(eq=False)
class Lattice:
    """Nodes (N, 3) in mm, centres first; struts (E, 2) from centre to corner; radii in mm."""

    nodes: NDArray[np.float64]
    is_centre: NDArray[np.bool_]
    struts: NDArray[np.int64]
    junction_radius: float
    midspan_radius: float

    @property
    def cycles(self) -> int:
        """Independent cycles E - V + 1 of the connected graph: the genus of its thickened surface."""
        return len(self.struts) - len(self.nodes) + 1

    def radius(self, t: ArrayLike) -> NDArray[np.float64]:
        """Strut radius (mm) at fractions t of its length: narrow at both junctions, widest at mid-span."""
        swell = np.sin(np.pi * np.asarray(t, dtype=float)) ** 2
        return self.junction_radius + (self.midspan_radius - self.junction_radius) * swell


def body_centred(d: Dimensions) -> Lattice:
    """Lattice of all cells of the envelope: centres at (iU, jU, (k + 1/2)U), eight half-diagonals each."""
    half_x = d.cells_x // 2
    i, j, k = (
        np.arange(-half_x, half_x + 1),
        np.arange(-d.cells_y_minus, d.cells_y_plus + 1),
        np.arange(d.count),
    )
    # Twice the node coordinates in cells are integers, so corners shared by cells are found exactly.
    centres = _grid(2 * i, 2 * j, 2 * k + 1)
    reach = centres[:, None, :] + DIRECTIONS
    corners, index = np.unique(reach.reshape(-1, 3)[:, ::-1], axis=0, return_inverse=True)
    struts = np.stack([np.repeat(np.arange(len(centres)), 8), len(centres) + index.ravel()], axis=1)
    return Lattice(
        nodes=np.concatenate([centres, corners[:, ::-1]]) * (d.cell / 2.0),
        is_centre=np.arange(len(centres) + len(corners)) < len(centres),
        struts=struts,
        junction_radius=d.junction_diameter / 2.0,
        midspan_radius=d.midspan_diameter / 2.0,
    )


def _grid(x: NDArray[np.int64], y: NDArray[np.int64], z: NDArray[np.int64]) -> NDArray[np.int64]:
    """Points (n, 3) of a grid, x running fastest and z slowest."""
    zz, yy, xx = np.meshgrid(z, y, x, indexing="ij")
    return np.stack([xx.ravel(), yy.ravel(), zz.ravel()], axis=1)
