"""Lens distortion."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the camera's lens distorts its picture",
    reveals="a calibration pattern; the camera from farther away",
    remedy="calibrate the lens, or move the camera farther away",
    of=BENCH,
    instrument=True,
    camera=True,
)
