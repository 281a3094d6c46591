"""Clock offset."""

import numpy as np

from ..lags import smooth_at
from .declaration import BENCH, DRIVEN, Array, Declaration, Law, Parameter, Setting, Values


def _driven(p: Array, v: Values, at: Setting) -> Array:
    return np.interp(at.time_s - v["offset_s"], at.time_s, p)


def _bent(angle: Array, v: Values, at: Setting) -> Array:
    return smooth_at(at.time_s, at.experiment["angle_deg"], v["offset_s"])


EFFECT = Declaration(
    mechanism="the clocks of camera and gauge differ",
    reveals="steps and fast cycles",
    remedy="record with one clock, or shift the records by the offset",
    of=BENCH,
    instrument=True,
    laws=(
        Law(
            (*DRIVEN, "waveguide_bending"),
            (Parameter("offset_s", "s", -2.0, 2.0, 0.0, (-0.1, 0.1), "clocks set by hand"),),
            {"clock": _driven, "bent_clock": _bent},
        ),
    ),
)
