"""Angle drift."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the camera rotates slowly about its optical axis",
    reveals="a mark on the bench, in the same picture",
    remedy="fix the camera, or follow a mark on the bench",
    of=BENCH,
    instrument=True,
    level=True,
)
