"""Settings of a grasp: the cube, and its contact with the fingers."""

from __future__ import annotations

import attrs

from ..design.quantity import described
from ..design.settings import FRICTION
from ..errors import InputError

MOST_SIDE_MM = 200.0

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


def _side(_: object, field: attrs.Attribute[float], value: float) -> None:
    if not 0.0 < value <= MOST_SIDE_MM:
        raise InputError(
            f"a cube with a side length of {value:g}", field.name, f"give mm, above 0 to {MOST_SIDE_MM:g}"
        )


@attrs.frozen
class Cube:
    """A rigid cube: its side in mm, and its density in g/ml.

    The default is solid PLA: assumed, since the paper names neither material nor mass; a hollow print is
    lighter.
    """

    side_mm: float = attrs.field(validator=_side)
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
