"""Waveguide play."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism=(
        "the waveguide has play in its channel, or in the stage that bends it, and stays at each reversal"
    ),
    reveals="bending to and fro at two paces: play is as large at either",
    remedy="remove the play of the waveguide in its channel, or of the stage, and record again",
)
