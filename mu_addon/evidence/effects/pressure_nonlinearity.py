"""Pressure nonlinearity."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the gauge's reading is not proportional to the pressure, by at most 5 % of its largest",
    reveals="the gauge and a second one on the same pressure, in steps up to the largest",
    remedy="compare the gauge with another one in steps up to the largest pressure",
    of=BENCH,
    instrument=True,
)
