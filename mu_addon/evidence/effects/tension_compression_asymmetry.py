"""Tension compression asymmetry."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="the stiffness differs between tension and compression",
    reveals="pressure and vacuum",
    remedy=IN_MODEL,
    shown_by={
        "coupon": "one coupon pulled, another compressed",
    },
)
