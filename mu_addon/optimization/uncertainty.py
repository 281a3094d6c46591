"""Scatter from print to print, and its first-order effect on a unit's quantities."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from .freedoms import Freedom

SURE = 2.0
"""Number of standard errors either way within which a robust unit meets a target."""


@attrs.frozen
class Uncertainty:
    """Standard errors of a print.

    print_mm: of every printed surface; modulus_share: of the resin's modulus, as a share.
    """

    print_mm: float
    modulus_share: float

    def freedoms(self, unit: Unit) -> list[Freedom]:
        """Scatter from print to print as freedoms: the surfaces' offset, and the resin's modulus."""
        return [
            Freedom("print.offset_xy_mm", -0.3, 0.5, also={"print.offset_z_mm": 1.0}, unit="mm"),
            Freedom("material.membrane_modulus_kPa", 10.0, 1e6, unit="kPa"),
        ]

    def errors(self, unit: Unit, slopes: Array) -> tuple[Array, Array]:
        """Standard errors (q,) of quantities by print and by resin, of their slopes (q, 2) by `freedoms`.

        A slope that is nan is not known, and counts as 0.
        """
        by_print, by_modulus = np.abs(np.nan_to_num(slopes)).T
        modulus = unit.material.membrane_modulus_kPa
        return self.print_mm * by_print, self.modulus_share * modulus * by_modulus
