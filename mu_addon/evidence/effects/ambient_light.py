"""Ambient light."""

from .declaration import BENCH, Array, Declaration, Law, Parameter, Setting, Values


def _changing(voltage: Array, v: Values, at: Setting) -> Array:
    hours = (at.time_s - at.time_s[0]) / 3600.0
    return voltage + v["at_first_V"] * (1.0 + v["per_hour"] * hours)


EFFECT = Declaration(
    mechanism="ambient light adds to the signal",
    reveals="the light source switched off",
    remedy="shield the waveguide from light, or subtract a dark reading",
    of=BENCH,
    instrument=True,
    level=True,
    laws=(
        Law(
            ("waveguide_bending",),
            (Parameter("ambient_V", "V", 0.0, 5.0, 0.0, (0.05,), "photodiodes see the room"),),
            {"voltage": lambda voltage, v, at: voltage + v["ambient_V"]},
        ),
        Law(
            ("waveguide_bending",),
            (
                Parameter("at_first_V", "V", 0.0, 5.0, 0.0, (0.05,), "photodiodes see the room"),
                Parameter(
                    "per_hour", "1/h", -10.0, 10.0, 0.0, (-1.0, 1.0), "daylight, a room's lamps that warm up"
                ),
            ),
            {"voltage": _changing},
            "ambient light adds to the signal, and changes during the record",
            refines=True,
        ),
    ),
)
