"""Skin cure."""

from ..unit_body import Body, UnitEffect
from .declaration import IN_MODEL, Declaration, Law, Parameter, Setting, Values

# A skin of this depth represents every skin of the same depth times excess modulus.
SKIN_MM = 0.1
EXCESS = Parameter(
    "excess_mm",
    "mm",
    0.0,
    0.4,
    0.0,
    (0.05, 0.2),
    "depth of the skin times its modulus over the core's, less 1; cure depths are 0.05 to 0.2 mm",
)


def _stiffer(printed: tuple[float, float], v: Values, at: Setting) -> tuple[float, float]:
    offset, excess = printed
    return offset, excess + v["excess_mm"]


def _skinned(body: Body, excess_mm: float) -> Body:
    p = body.unit.print
    excess = excess_mm + p.skin_depth_mm * (p.skin_factor - 1.0)
    return body.printed(skin_depth_mm=SKIN_MM, skin_factor=1.0 + excess / SKIN_MM)


EFFECT = Declaration(
    mechanism="the surface is cured more than the core and is stiffer",
    reveals="coupons of several thicknesses",
    remedy=f"{IN_MODEL}; cure less, or longer and more evenly",
    shown_by={
        "unit_pressure": "coupons of several thicknesses, of the same print",
    },
    laws=(Law(("lattice_compression",), (EXCESS,), {"printed": _stiffer}),),
    unit=UnitEffect(
        EXCESS, (0.0, 0.04, 0.1, 0.2, 0.4), body=_skinned, length=1, larger=(0.54,), first=(0.2,)
    ),
)
