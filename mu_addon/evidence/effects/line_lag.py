"""Line lag."""

from .declaration import BENCH, IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="the resistance of the air line delays the chamber pressure behind the gauge",
    reveals="steps and fast cycles",
    remedy=f"{IN_MODEL}; a shorter or wider line, or a gauge at the unit",
    shown_by={
        "unit_pressure": "steps of pressure, with the camera at 30 frames a second or more",
        "pressure_step": "the same steps with the gauge at the unit's end of the line",
    },
    of=BENCH,
)
