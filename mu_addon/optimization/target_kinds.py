"""The quantities that a target may ask for, used by the file of a design and by Blender."""

from __future__ import annotations

import attrs

from ..design.quantity import described

PRESSURE = described(
    "pressure_kPa",
    30.0,
    "gauge pressure in all chambers; negative: vacuum",
    unit="kPa",
    low=-500.0,
    high=500.0,
)
GAP = described("gap_mm", 0.0, "distance from the tip as drawn to the wall", unit="mm", low=0.0, high=200.0)


@attrs.frozen
class Kind:
    """A quantity; takes: keys of its [[target]] table beside its goal; unit: of its value.

    is_yes: it is kept or not, without a number.
    """

    text: str
    takes: tuple[str, ...] = ()
    unit: str = ""
    is_yes: bool = False


AT, OVER = PRESSURE.name, "pressures_kPa"
KINDS = {
    "angle": Kind("bending angle under a pressure, in degrees", (AT,), "deg"),
    "tip_force": Kind("force on a wall next to the tip under a pressure, in N", (AT, GAP.name), "N"),
    "tip_position": Kind("displacement of the tip under a pressure, in mm", (AT, "direction"), "mm"),
    "workspace": Kind("length of the tip's path over two pressures and rest, in mm", (OVER,), "mm"),
    "stiffness": Kind("force that moves the tip by 1 mm, the unit at rest, in N/mm", ("direction",), "N/mm"),
    "stretch": Kind("largest principal stretch of the wall under a pressure", (AT, "region")),
    "safety": Kind("the resin's elongation at break over the wall's strain under a pressure", (AT, "region")),
    "air_volume": Kind("air in the chambers under a pressure, in ml", (AT,), "ml"),
    "mass": Kind("mass without the waveguide, in g", (), "g"),
    "print_time": Kind("time of the print, upright, in h", (), "h"),
    "wall_thickness": Kind("thickness of the thinnest chamber's wall, in mm", (), "mm"),
    "deviation": Kind("mean deviation that the sensor along a path causes, in mm", ("path", OVER), "mm"),
    "sensor_slope": Kind("relative change of the light per degree, along a path", ("path", OVER), "1/deg"),
    "walls_apart": Kind("no wall passes through another under a pressure", (AT,), is_yes=True),
    "printable": Kind("no error in the print check of a proposed unit", is_yes=True),
}
"""By name, in an order that saved files keep: a further one goes to the end."""
