"""Pressure gain."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the pressure gauge has a gain error",
    reveals="a dead load, or a second gauge",
    remedy="have the gauge calibrated, or divide its readings by the gain",
    shown_by={
        "unit_pressure": "a second gauge on the same pressure",
        "pressure_hold": "a second gauge on the same pressure",
    },
    of=BENCH,
    instrument=True,
)
