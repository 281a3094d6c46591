"""Faults of a load cell and its amplifier: gain, curve, and averaging over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..effect import Effect, Parameter
from ..ringing import swinging
from .curve import bow, curved
from .effective_pressure import first_order_lag

Array = np.ndarray[Any, Any]

GAIN = Parameter("gain", "", -0.3, 0.3, 0.0, (0.05,), "calibrations of load cells")
BOW = bow("off straight at half load, of the largest; load cells 0.0005, film sensors 0.03")
FILTER = (Parameter("time_s", "s", 0.0, 2.0, 0.0, (0.05, 0.5), "amplifiers average over 1 ms to 1 s"),)
# Of two poles: equal ones are damped by 1, a Bessel filter's by 0.87, a Butterworth filter's by 0.71.
FILTER_OF_TWO = (
    Parameter("period_s", "s", 0.0, 10.0, 0.0, (0.2, 1.0), "of two poles: 6.3 times the time of each"),
    Parameter("damping", "", 0.5, 0.999, 0.87, (0.87,), "share of the critical damping, as filters have it"),
)
# Keys of values without which nothing is filtered.
FILTERED = ("force_lag.time_s", "force_lag.period_s")


def amplifier(kind: str) -> tuple[Effect, ...]:
    """Effects, for a kind, of the load cell's amplifier: gain, curve, a filter of one pole, or of two."""
    return (
        Effect("force_scale", (GAIN,), (kind,)),
        Effect("force_nonlinearity", (BOW,), (kind,)),
        Effect("force_lag", FILTER, (kind,)),
        Effect(
            "force_lag",
            FILTER_OF_TWO,
            (kind,),
            "the filter of the load cell, of two poles, delays its reading",
            refines=True,
        ),
    )


def amplified(force: Array, values: Mapping[str, float], largest: float) -> Array:
    """Force or stress (n,) with the gain error of a load cell (`amplifier`).

    largest: reading at which its curve is straight again, in the unit of force; 0 where none is known.
    """
    gain = values.get("force_scale.gain", 0.0)
    force = curved(force, values.get("force_nonlinearity.bow", 0.0), largest)
    return force * (1.0 + gain) if gain else force


def filtered(time_s: Array, force: Array, values: Mapping[str, float]) -> Array:
    """Force or stress (n,) as delayed by a load cell's amplifier, at times (n,) in s (`amplifier`)."""
    if (period := values.get("force_lag.period_s", 0.0)) > 0.0:
        return swinging(time_s, force[None], 1.0 / period, values.get("force_lag.damping", 0.87))[0]
    return first_order_lag(time_s, force, values.get("force_lag.time_s", 0.0))
