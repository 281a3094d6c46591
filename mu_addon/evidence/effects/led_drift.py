"""Led drift."""

import numpy as np

from .declaration import BENCH, Array, Declaration, Law, Parameter, Setting, Values


def _settling(exponent: Array, v: Values, at: Setting) -> Array:
    return exponent - v["settled"] * np.expm1(-(at.time_s - at.time_s[0]) / v["settling_s"])


EFFECT = Declaration(
    mechanism="the light source fades",
    reveals="a straight waveguide over the same time",
    remedy="let the light source warm up, or measure it with the signal",
    of=BENCH,
    instrument=True,
    level=True,
    laws=(
        Law(
            ("waveguide_bending",),
            (
                Parameter(
                    "per_hour", "1/h", -10.0, 10.0, 0.0, (-0.2,), "light sources lose light as they warm"
                ),
            ),
            {"exponent": lambda x, v, at: x + v["per_hour"] * (at.time_s - at.time_s[0]) / 3600.0},
        ),
        Law(
            ("waveguide_bending",),
            (
                Parameter(
                    "settled", "", -2.0, 2.0, 0.0, (-0.05,), "logarithm of the light's share after warm-up"
                ),
                Parameter("settling_s", "s", 1.0, 1e4, 100.0, (20.0, 200.0), "warming of lamp and driver"),
            ),
            {"exponent": _settling},
            refines=True,
        ),
    ),
)
