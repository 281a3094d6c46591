"""A tip held across the unit's axis by a load cell: free to slide along it, and to turn."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..meshing.mesh import Mesh
from .obstacle import Obstacle

# N/mm: a unit at 1.0x moves its tip by some 10 mm for the load cell's reading, so that the cell's own
# deflection, force over this, is some hundredths of a per cent of it.
STIFFNESS = 500.0
# Nodes this near to the outermost one of the tip, as a share of the tip's width, lie on its edge.
EDGE = 1e-3


class HeldTip(Obstacle):
    """The edge of the tip toward +y on a stiff load cell that lies across the axis; a term of a model's.

    The cell holds the edge's y at rest plus `gap_mm`, toward either side. A pulling force is below 0; a flat
    pad cannot pull. The tip is otherwise free: it slides along the pad without friction and rotates about its
    edge. mesh: half, quarter or whole. shift (n,): additional displacement in y of each node in mm, for a
    unit bent by its weight before the cell is placed. Raises InputError where the mesh has no tip.
    """

    def __init__(self, mesh: Mesh, gap_mm: float, shift: Array | None = None) -> None:
        tip = np.asarray(mesh.tip)
        if not len(tip):
            raise InputError("the mesh has no tip that a load cell could hold", "blocked force")
        y = mesh.nodes[tip, 1]
        self.edge = tip[y >= y.max() - EDGE * np.ptp(y)]
        self.way = gap_mm + (np.zeros(len(self.edge)) if shift is None else shift[self.edge])
        # A mirror plane shares the cell between its two sides.
        self.stiffness = STIFFNESS / 2 ** len(mesh.symmetry) / len(self.edge)
        self.copies = 2 ** len(mesh.symmetry)
        self.share, self.friction, self.path = 1.0, 0.0, None

    def reading_N(self, u: Array) -> float:
        """Force in N of the whole unit on the cell, toward +y, at displacement u (n, 3) in mm."""
        return float(self.copies * self.stiffness * self._off(u).sum())

    def _off(self, u: Array) -> Array:
        return np.asarray(u[self.edge, 1] - self.share * self.way)

    def energy_mJ(self, u: Array) -> float:
        """Energy in mJ stored in the cell at u (n, 3) in mm."""
        return float(0.5 * self.stiffness * (self._off(u) ** 2).sum())

    def forces(self, u: Array) -> tuple[Array, Array]:
        """Nodes (j,) of the edge, and the energy's derivative by them, (j, 3) in N, at u (n, 3) in mm."""
        found = np.zeros((len(self.edge), 3))
        found[:, 1] = self.stiffness * self._off(u)
        return self.edge, found

    def blocks(self, u: Array) -> tuple[Array, Array]:
        """Second derivative in N/mm of the energy: pairs (j, 2) of a node with itself, blocks (j, 3, 3)."""
        found = np.zeros((len(self.edge), 3, 3))
        found[:, 1, 1] = self.stiffness
        return np.stack([self.edge, self.edge], axis=1), found

    def begin(self, u: Array | None = None) -> None:
        """Do nothing: a cell has no history."""

    def commit(self, u: Array) -> None:
        """Do nothing: a cell has no history."""

    def deepest_mm(self, u: Array) -> float:
        """Return 0: nothing overlaps. u: displacements (n, 3) in mm."""
        return 0.0
