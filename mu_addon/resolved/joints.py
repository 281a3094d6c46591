"""Where struts meet they are stiffer than beams: zones about a joint that do not stretch, or do not bend."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..design.dimensions import Dimensions

Array = np.ndarray[Any, Any]


@attrs.frozen
class Zones:
    """Rigid zones about a joint in junction diameters: in stretch, and in bending, twist and shear.

    fewer: factor of the latter where a number of struts meets, 1 where none is given.
    """

    stretch: float
    bend: float
    fewer: tuple[tuple[int, float], ...] = ()

    def lengths(self, junction_mm: Array, meeting: Array) -> tuple[Array, Array]:
        """Lengths in mm (any shape) of both zones, of junction diameters and numbers of struts there."""
        factor = np.ones(np.shape(meeting))
        for number, less in self.fewer:
            factor = np.where(meeting == number, less, factor)
        return self.stretch * junction_mm, self.bend * junction_mm * factor


def zones_of(d: Dimensions) -> Zones:
    return Zones(0.1455, 0.5028, ((4, 0.704), (2, 0.362), (1, 0.0)))
