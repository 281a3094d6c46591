"""Rate-independent hysteresis."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="friction inside the material resists every reversal",
    reveals="slow loops",
    remedy=f"{IN_MODEL} where a unit was measured; approach a pressure from one side",
    shown_by={
        "coupon": "loading and unloading at two rates a decade apart",
        "lattice_compression": "loading and unloading at two rates a decade apart",
    },
    memory=True,
)
