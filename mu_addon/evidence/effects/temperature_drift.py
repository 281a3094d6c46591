"""Temperature drift."""

from .declaration import EITHER, Declaration

EFFECT = Declaration(
    mechanism="the modulus depends on temperature",
    reveals="one protocol at two temperatures",
    remedy="keep the temperature constant, or record it with every experiment",
    shown_by={
        "pressure_hold": "the same hold reached slowly, so that its gas is not warm at first",
    },
    of=EITHER,
)
