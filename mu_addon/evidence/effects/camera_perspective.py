"""Camera perspective."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism=(
        "the camera does not look at right angles to the plane of bending, so that nearer parts look larger"
    ),
    reveals="a square of known sides in the plane of bending; the camera from farther away",
    remedy="set the camera at right angles to the plane of bending",
    of=BENCH,
    instrument=True,
    camera=True,
)
