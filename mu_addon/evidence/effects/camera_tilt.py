"""Camera tilt."""

import attrs

from ..camera import View
from .declaration import BENCH, CYCLED, Declaration, Law, Parameter, Setting, Values

FORESHORTENING = Parameter(
    "foreshortening",
    "",
    -0.06,
    0.06,
    0.0,
    (0.01,),
    "1 less the cosine of 20 degrees; above 0 across the unit, below along it",
)


def _squeezed(view: View, v: Values, at: Setting) -> View:
    short = v["foreshortening"]
    return attrs.evolve(view, across=1.0 - max(short, 0.0), along=1.0 + min(short, 0.0))


EFFECT = Declaration(
    mechanism=(
        "the camera does not look at right angles to the plane of bending, so that one direction is "
        "foreshortened"
    ),
    reveals="a square of known sides in the plane of bending",
    remedy="set the camera at right angles to the plane of bending",
    of=BENCH,
    instrument=True,
    camera=True,
    laws=(Law(CYCLED, (FORESHORTENING,), {"view": _squeezed}),),
)
