"""Angle offset."""

import numpy as np

from .declaration import BENCH, CYCLED, Array, Declaration, Law, Parameter, Setting, Values


def _read(y: Array, v: Values, at: Setting) -> Array:
    angles = np.array([channel == "angle_deg" for channel in at.channels])
    return y + v["offset_deg"] * angles[:, None]


EFFECT = Declaration(
    mechanism="the camera's zero angle differs from the unit's",
    reveals="a record at rest",
    remedy="set the camera's zero by a record at rest",
    of=BENCH,
    instrument=True,
    level=True,
    laws=(
        Law(
            (*CYCLED, "waveguide_bending"),
            (Parameter("offset_deg", "deg", -30.0, 30.0, 0.0, (1.0,), "camera frame"),),
            {"read": _read, "bent_zero": lambda angle, v, at: angle - v["offset_deg"]},
        ),
    ),
)
