"""Pressure gain."""

from .declaration import BENCH, OF_UNITS, Declaration, Law, factor

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
    laws=(
        Law(
            (*OF_UNITS, "pressure_hold"),
            (factor("gain", 0.05, "gauge's sheet, units"),),
            {
                "gain": lambda p, v, at: p / (1.0 + v["gain"]),
                "read_gain": lambda p, v, at: p * (1.0 + v["gain"]),
            },
        ),
    ),
)
