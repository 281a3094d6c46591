"""Led drift."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the light source fades",
    reveals="a straight waveguide over the same time",
    remedy="let the light source warm up, or measure it with the signal",
    of=BENCH,
    instrument=True,
    level=True,
)
