"""Force scale."""

from .declaration import BENCH, Declaration

EFFECT = Declaration(
    mechanism="the force is scaled: load cell, section as typed, clamping or specimen",
    reveals="a dead weight on the load cell, the section measured, the specimen clamped again",
    remedy=(
        "check which specimen was in each test, hang a dead weight from the load cell, measure the "
        "section, and clamp the specimen again"
    ),
    of=BENCH,
)
