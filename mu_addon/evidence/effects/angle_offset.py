"""Angle offset."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the camera's zero angle differs from the unit's",
    reveals="a record at rest",
    remedy="set the camera's zero by a record at rest",
    of=BENCH,
    instrument=True,
    level=True,
)
