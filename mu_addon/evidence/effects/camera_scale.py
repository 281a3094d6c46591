"""Camera scale."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the scale of the camera's picture is wrong",
    reveals="a ruler in the plane of the markers",
    remedy="measure the scale by a ruler in the plane of the markers",
    of=BENCH,
    instrument=True,
    camera=True,
)
