"""Ambient light."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="ambient light adds to the signal",
    reveals="the light source switched off",
    remedy="shield the waveguide from light, or subtract a dark reading",
    of=BENCH,
    instrument=True,
    level=True,
)
