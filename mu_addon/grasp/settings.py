"""Settings of a grasp: the cube, and its contact with the fingers."""

from __future__ import annotations

import attrs

from ..design.quantity import described
from ..design.settings import FRICTION

SIDE = described(
    "side_mm", 25.0, "side of the cube, in the middle between the tips", unit="mm", low=0.1, high=200.0
)
STEP_S = 0.5
"""Longest interval between instants in s."""
DENSITY = described(
    "density_g_per_ml", 1.24, "density of the cubes; solid PLA is assumed", unit="g/ml", low=0.001, high=25.0
)
BEYOND = described(
    "beyond_mm",
    3.0,
    "distance of the cubes' centre beyond the tips at rest",
    unit="mm",
    low=-50.0,
    high=50.0,
)


@attrs.frozen
class Cube:
    """A rigid cube: its side in mm, and its density in g/ml.

    The default is solid PLA: assumed, since the paper names neither material nor mass; a hollow print is
    lighter.
    """

    side_mm: float = SIDE.field()
    density_g_per_ml: float = DENSITY.field()

    @property
    def mass_g(self) -> float:
        """Mass of the whole cube."""
        return self.density_g_per_ml * self.side_mm**3 / 1e3

    @property
    def weight_N(self) -> float:
        """Weight of the whole cube."""
        from ..fem.dead_loads import STANDARD_GRAVITY

        return self.mass_g * 1e-6 * STANDARD_GRAVITY


@attrs.frozen
class Contact:
    """Contact of fingers and cube.

    friction: the lower end of known values. beyond_mm: assumed, the tips' edges then meet both cubes near the
    middle of their sides. The others: of the contact, see `Obstacle`.
    """

    friction: float = FRICTION.field()
    beyond_mm: float = BEYOND.field()
    pressure_MPa: float = 0.1
    depth_mm: float = 0.05
    stick_mm: float = 0.1
    halvings: int = 1
