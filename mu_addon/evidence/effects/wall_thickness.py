"""Wall thickness."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="the chamber wall is thicker or thinner than nominal",
    reveals="a section, or the mass",
    remedy=f"{IN_MODEL}; cut one unit and measure its wall",
    shown_by={
        "unit_pressure": "the wall of a unit cut open",
    },
)
