"""Viscoelasticity."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="all moduli relax with time",
    reveals="pressure holds, and one protocol at two rates a decade apart",
    remedy=f"{IN_MODEL}; compare loads at one rate, and read holds at one time",
    shown_by={
        "coupon": "one coupon at two rates a decade apart, or held at a stretch",
        "lattice_compression": "one block at two rates a decade apart, or held",
        "pressure_hold": "a longer hold, and the same in a rigid chamber of that volume",
        "pressure_step": "one step held for two decades of time longer",
        "blocked_force": "the tip blocked at a larger gap, held for two decades of time",
    },
    memory=True,
)
