"""Fatigue drift."""

import math

import numpy as np

from ..lags import cycles
from .declaration import CYCLED, MACHINE, Array, Declaration, Law, Parameter, Setting, Values


def _cycled(modulus: Array, v: Values, at: Setting) -> Array:
    done = at.past.cycles + cycles(at.experiment["pressure_kPa"])
    return modulus * (1.0 - v["per_decade"] * np.log10(1.0 + done))


def _tested(stiffness: float, v: Values, at: Setting) -> float:
    return stiffness * (1 - v["per_decade"] * math.log10(1 + at.past.tests))


EFFECT = Declaration(
    mechanism="the modulus falls with the number of cycles",
    reveals="the first protocol again at the end",
    remedy="replace the specimen, or recalibrate after that many cycles",
    memory=True,
    laws=(
        Law(
            (*CYCLED, *MACHINE),
            (Parameter("per_decade", "", 0.0, 0.4, 0.0, (0.03,), "modulus lost in ten times the cycles"),),
            {"modulus": _cycled, "stiffness": _tested},
        ),
    ),
)
