"""Camera scale."""

from __future__ import annotations

import attrs

from ..camera import View
from .declaration import BENCH, CYCLED, Data, Declaration, Law, Parameter, Setting, Values

EXCESS = Parameter("excess", "", -0.1, 0.1, 0.0, (0.01,), "a ruler nearer or farther than the unit")


def _of_markers(law: Law, data: Data) -> tuple[Law, ...]:
    return (law,) if any(c.startswith("marker") for c in data.channels) else ()


def _grown(view: View, v: Values, at: Setting) -> View:
    return attrs.evolve(view, excess=v["excess"])


EFFECT = Declaration(
    mechanism="the scale of the camera's picture is wrong",
    reveals="a ruler in the plane of the markers",
    remedy="measure the scale by a ruler in the plane of the markers",
    of=BENCH,
    instrument=True,
    camera=True,
    laws=(Law(CYCLED, (EXCESS,), {"view": _grown}, offered=_of_markers),),
)
