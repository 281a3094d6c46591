"""Mullins softening."""

from .declaration import IN_MODEL, Declaration

EFFECT = Declaration(
    mechanism="the first loading softens all later loading below its peak",
    reveals="a virgin ladder",
    remedy=f"{IN_MODEL} where a unit was measured; load a new print to its full range once",
    shown_by={
        "coupon": "cycles of growing stretch on a coupon that was never loaded",
        "lattice_compression": "cycles of growing strain on a block that was never loaded",
    },
    memory=True,
)
