"""Clogged chamber."""

from .declaration import Declaration

EFFECT = Declaration(
    mechanism="one chamber receives less pressure than the others",
    reveals="markers along the unit",
    remedy="drain and clean the unit, and look for cured resin in its necks; print with drains",
)
