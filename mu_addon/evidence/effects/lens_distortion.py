"""Lens distortion."""

import attrs

from ..camera import View
from .declaration import BENCH, CYCLED, Declaration, Law, Parameter, Setting, Values

AT_TIP = Parameter(
    "at_tip",
    "",
    -0.05,
    0.05,
    0.0,
    (0.005,),
    "radial, where the tip is at rest: lenses of cameras 0.1 to 5 %; above 0 pincushion",
)


def _distorted(view: View, v: Values, at: Setting) -> View:
    return attrs.evolve(view, lens=v["at_tip"])


EFFECT = Declaration(
    mechanism="the camera's lens distorts its picture",
    reveals="a calibration pattern; the camera from farther away",
    remedy="calibrate the lens, or move the camera farther away",
    of=BENCH,
    instrument=True,
    camera=True,
    laws=(Law(CYCLED, (AT_TIP,), {"view": _distorted}),),
)
