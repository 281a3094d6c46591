"""Gravity."""

from .declaration import ALL, IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="weight bends the unit",
    reveals="one protocol in three orientations",
    remedy=f"{IN_MODEL}, and give the direction in which the unit hangs by --orientation",
    shown_by={
        "unit_pressure": "one protocol in three orientations",
        "beam_deadweight": "the beam upside down",
        "unit_pose": "a full turn about x at two pressures",
    },
    of=ALL,
)
