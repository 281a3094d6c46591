"""Camera tilt."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism=(
        "the camera does not look at right angles to the plane of bending, so that one direction is "
        "foreshortened"
    ),
    reveals="a square of known sides in the plane of bending",
    remedy="set the camera at right angles to the plane of bending",
    of=BENCH,
    instrument=True,
    camera=True,
)
