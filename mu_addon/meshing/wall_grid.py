"""Grid of a unit's wall, repeated node by node for units near to it."""

from __future__ import annotations

import numpy as np

from ..design.dimensions import Dimensions
from ..errors import MeshingError
from .membrane import Membrane, Meridian, membrane_mesh, stations
from .mesh import Array


class WallGrid:
    """Grid of a unit's membrane, repeated node by node for other units."""

    def __init__(
        self, d: Dimensions, edge_mm: float, turn: float, sectors: int, layers: int, rings: int
    ) -> None:
        """d: as printed; edge_mm: along the meridian; the others as `membrane_mesh` has them."""
        self.meridian = Meridian.of(d)
        self._heights = stations(self.meridian, edge_mm)
        self._grid = turn, sectors, layers, rings
        self.membrane = self._made(self.meridian, self._heights)

    def of(self, b: Dimensions) -> Membrane:
        """Membrane of other dimensions of the same cell and envelope; raises MeshingError."""
        a = self.meridian.d
        if a.count != b.count or not np.allclose(a.bounds, b.bounds, rtol=0, atol=1e-9 * a.cell):
            raise unmovable("its envelope differs")
        second = Meridian.of(b)
        breaks = [_breaks(m) for m in (self.meridian, second)]
        order = np.argsort(breaks[0])
        from_, to = (x[order] for x in breaks)
        if not (np.diff(to) > 0).all():
            raise unmovable("its profile differs")
        made = self._made(second, np.interp(self._heights, from_, to))
        if not np.array_equal(self.membrane.tets, made.tets):
            raise unmovable("its membrane folds")
        return made

    def _made(self, meridian: Meridian, heights: Array) -> Membrane:
        turn, sectors, layers, rings = self._grid
        return membrane_mesh(meridian, turn, heights, sectors, layers, rings)


def _breaks(meridian: Meridian) -> Array:
    """Heights on the profile where a part ends: cuts, arcs, ends."""
    d = meridian.d
    joints = np.arange(d.count)[:, None] * d.cell + np.array([0.0, d.b, d.cell / 2, d.cell - d.b])
    return np.concatenate([joints.ravel(), [d.height], meridian.cuts])


def unmovable(why: str) -> MeshingError:
    """Error of a mesh that cannot be moved to another unit."""
    return MeshingError(
        f"the mesh of a unit cannot be moved: {why}", "unit", "make a new mesh of the other unit"
    )
