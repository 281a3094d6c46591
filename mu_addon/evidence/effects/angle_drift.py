"""Angle drift."""

import attrs
import numpy as np

from ..camera import View
from ..drift import drift, drift_laws
from .declaration import BENCH, CYCLED, Data, Declaration, Setting, Values

# Largest rotation of a stable camera during a record.
TURN_deg = 20.0


def _most(data: Data) -> float:
    return TURN_deg


def _turned(view: View, v: Values, at: Setting) -> View:
    return attrs.evolve(view, turned=view.turned + np.radians(drift(at.time_s, v)))


EFFECT = Declaration(
    mechanism="the camera rotates slowly about its optical axis",
    reveals="a mark on the bench, in the same picture",
    remedy="fix the camera, or follow a mark on the bench",
    of=BENCH,
    instrument=True,
    level=True,
    laws=drift_laws(CYCLED, "deg", _most, {"view": _turned}),
)
