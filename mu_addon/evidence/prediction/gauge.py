"""Faults of a pressure gauge: its zero, its gain, and its curve."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..effect import Effect, Parameter
from .curve import bow, curved, straightened

Array = np.ndarray[Any, Any]

BOW = bow("off straight at half pressure, of the largest; gauges 0.0025, cheap ones 0.03")
CURVE = "pressure_nonlinearity"


def gauge(kind: str) -> tuple[Effect, ...]:
    """Effects, for a kind, of the gauge: offset, gain and curve."""
    return (
        Effect(
            "pressure_offset",
            (Parameter("offset_kPa", "kPa", -10.0, 10.0, 0.0, (-1.0, 1.0), "gauge pressures of benches"),),
            (kind,),
        ),
        Effect("pressure_gain", (Parameter("gain", "", -0.3, 0.3, 0.0, (0.05,), "gauge's sheet"),), (kind,)),
        Effect(CURVE, (BOW,), (kind,)),
    )


def as_read(p: Array, values: Mapping[str, float], largest_kPa: float) -> Array:
    """Reading (n,) in kPa of a gauge at pressures (n,) in kPa.

    values: by "effect.parameter", see `gauge`. largest_kPa: pressure at which its curve is straight again; 0
    where none is known.
    """
    p = curved(p, values.get(f"{CURVE}.bow", 0.0), largest_kPa)
    return p * (1.0 + values.get("pressure_gain.gain", 0.0)) + values.get("pressure_offset.offset_kPa", 0.0)


def before_the_gauge(reading: Array, values: Mapping[str, float], largest_kPa: float) -> Array:
    """Pressure (n,) in kPa of a gauge's reading (n,) in kPa, the inverse of `as_read`."""
    p = reading - values.get("pressure_offset.offset_kPa", 0.0)
    p = p / (1.0 + values.get("pressure_gain.gain", 0.0))
    return straightened(p, values.get(f"{CURVE}.bow", 0.0), largest_kPa)
