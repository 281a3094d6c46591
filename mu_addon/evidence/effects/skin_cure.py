"""Skin cure."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="the surface is cured more than the core and is stiffer",
    reveals="coupons of several thicknesses",
    remedy=f"{IN_MODEL}; cure less, or longer and more evenly",
    shown_by={
        "unit_pressure": "coupons of several thicknesses, of the same print",
    },
)
