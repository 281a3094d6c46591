"""Optical nonlinearity."""

import numpy as np

from .declaration import Array, Declaration, Law, Parameter, Setting, Values

FROM_ONSET = (
    Parameter("excess", "", -0.9, 10.0, 0.0, (0.3,), "loss at 90 deg over proportional, less 1"),
    Parameter("onset_deg", "deg", 0.0, 90.0, 0.0, (0.0, 20.0), "bend at which modes begin to leak"),
)
# Modes that are guided less leave first, others begin to leak: calibrations go by a power of the bend or by a
# polynomial in it, which has any smooth curve to third order.
BY_POWER = (
    Parameter("at_90_deg", "", -0.9, 10.0, 0.0, (0.3,), "loss at 90 deg over proportional, less 1"),
    Parameter("power", "", 1.1, 4.0, 2.0, (1.5, 2.5), "of the bend, for the excess"),
)
BY_CUBE = (
    Parameter("square", "", -10.0, 10.0, 0.0, (0.3,), "loss at 90 deg over proportional"),
    Parameter("cube", "", -10.0, 10.0, 0.0, (0.0,), "loss at 90 deg over proportional"),
)


def _from_onset(angle: Array, v: Values, at: Setting) -> Array:
    beyond = np.maximum(np.abs(angle) - v["onset_deg"], 0.0)
    return angle + np.sign(angle) * v["excess"] * beyond**2 / 90.0


def _by_power(angle: Array, v: Values, at: Setting) -> Array:
    return angle + 90.0 * v["at_90_deg"] * np.sign(angle) * np.abs(angle / 90.0) ** v["power"]


def _by_cube(angle: Array, v: Values, at: Setting) -> Array:
    x = angle / 90.0
    return angle + 90.0 * (v["square"] * np.abs(x) * x + v["cube"] * x**3)


EFFECT = Declaration(
    mechanism="the light loss is not proportional to curvature",
    reveals="an amplitude ladder",
    remedy="calibrate the sensor over the whole range of bending",
    laws=(
        Law(("waveguide_bending",), FROM_ONSET, {"bend": _from_onset}),
        Law(
            ("waveguide_bending",),
            BY_POWER,
            {"bend": _by_power},
            "the light loss is not proportional to curvature, but a power of it",
            refines=True,
        ),
        Law(
            ("waveguide_bending",),
            BY_CUBE,
            {"bend": _by_cube},
            "the light loss is not proportional to curvature, by its square and cube",
            refines=True,
        ),
    ),
)
