"""A wall next to the unit: the pressure at which it stops the unit, and the change by it."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import attrs
import numpy as np

from ...arrays import Array, float64
from ...errors import InputError

CONTACT = "contact"
# A wall nearer than this share of the free unit's way is not computed.
NEAREST = 0.9


@attrs.frozen(eq=False)
class ObstacleResponse:
    """The unit's response to a flat wall along its axis, on one side.

    pressures_kPa (k,): of the free unit, from 0 to its last one of this sign; outward_mm (k,): largest
    distance beyond its outline at rest, ascending from 0. reaches_mm (m,): distance of walls inside the last
    of these, ascending; shares (t,): from the pressure at the first touch (0) to the last one (1), ascending;
    changes (m, t, c): of c channels. spare_mm: additional distance of the free unit in another experiment,
    where sizes are counted from. Raises InputError.
    """

    pressures_kPa: Array = attrs.field(converter=float64)
    outward_mm: Array = attrs.field(converter=float64)
    reaches_mm: Array = attrs.field(converter=float64)
    shares: Array = attrs.field(converter=float64)
    changes: Array = attrs.field(converter=float64)
    spare_mm: float = 0.0

    def __attrs_post_init__(self) -> None:
        rising = all((np.diff(v) > 0).all() for v in (self.outward_mm, self.reaches_mm, self.shares))
        if not (rising and len(self.outward_mm) > 1 and self.outward_mm[0] == 0.0 and self.shares[-1] == 1.0):
            raise InputError("places of walls do not ascend", "response to a wall", "order them from rest on")
        walls, pressures = len(self.reaches_mm), len(self.shares)
        if self.changes.shape[:2] != (walls, pressures):
            raise InputError(
                f"changes {self.changes.shape} do not fit {walls} walls at {pressures} pressures",
                "response to a wall",
                "give changes (walls, pressures, channels)",
            )

    @property
    def farthest_mm(self) -> float:
        """Largest distance in mm of the free unit beyond its outline at rest, at the last pressure."""
        return float(self.outward_mm[-1])

    @property
    def nearest_mm(self) -> float:
        """Largest computed distance in mm of a wall inside the free unit's farthest position anywhere."""
        return float(self.reaches_mm[-1]) + self.spare_mm

    @cached_property
    def _met(self) -> Any:
        from scipy.interpolate import PchipInterpolator

        return PchipInterpolator(self.outward_mm, self.pressures_kPa)

    @cached_property
    def _changed(self) -> Any:
        from scipy.interpolate import CubicSpline

        # No change without a wall, nor at first contact.
        reaches = np.concatenate([[0.0], self.reaches_mm])
        shares = np.concatenate([[0.0], self.shares])
        changes = np.pad(self.changes, ((1, 0), (1, 0), (0, 0)))
        return CubicSpline(reaches, CubicSpline(shares, changes, axis=1)(_EVEN), axis=0)

    def met_kPa(self, reach_mm: float) -> float:
        """Pressure in kPa at which the unit touches a wall.

        reach_mm: distance of the wall inside the free unit's farthest position in all experiments.
        """
        return float(self._met(self.farthest_mm - (reach_mm - self.spare_mm)))

    def change(self, pressure_kPa: Array, reach_mm: float) -> Array:
        """Change (c, n) of the channels, in their units, at pressures (n,) in kPa by a wall at reach_mm.

        0 where the wall is farther than this unit gets; beyond the last computed reach that one is used.
        """
        own, last = reach_mm - self.spare_mm, self.pressures_kPa[-1]
        if own <= 0:
            return np.zeros((self.changes.shape[2], len(pressure_kPa)))
        met = self.met_kPa(reach_mm)
        share = np.clip((pressure_kPa - met) / (last - met), 0.0, 1.0)
        table = self._changed(min(own, self.reaches_mm[-1]))
        return np.stack([np.interp(share, _EVEN, column) for column in table.T])


# The spline over shares is read off a fine even grid, between whose points a straight line is as good.
_EVEN = np.linspace(0.0, 1.0, 101)
