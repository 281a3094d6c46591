"""Strain stiffening."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="the material stiffens at large stretch",
    reveals="an amplitude ladder to full pressure",
    remedy=IN_MODEL,
    shown_by={
        "coupon": "a test to a larger stretch",
        "beam_deadweight": "larger weights",
    },
)
