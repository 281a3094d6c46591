"""Waveguide play."""

from ..lags import play_operator
from .declaration import Declaration, Law, Parameter

EFFECT = Declaration(
    mechanism=(
        "the waveguide has play in its channel, or in the stage that bends it, and stays at each reversal"
    ),
    reveals="bending to and fro at two paces: play is as large at either",
    remedy="remove the play of the waveguide in its channel, or of the stage, and record again",
    laws=(
        Law(
            ("waveguide_bending",),
            (
                Parameter(
                    "play_deg", "deg", 0.0, 20.0, 0.0, (1.0, 4.0), "half a millimetre in a bend: 1 to 5 deg"
                ),
            ),
            {"bend": lambda angle, v, at: play_operator(angle, v["play_deg"])},
        ),
    ),
)
