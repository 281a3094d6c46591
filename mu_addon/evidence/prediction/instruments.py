"""Faults of instruments: zero, gain and curve of a gauge or load cell, and its amplifier's filter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..effect import FORCE_SCALE, Effect, Parameter, factor
from ..ringing import swinging
from .effective_pressure import first_order_lag

Array = np.ndarray[Any, Any]


def bow(source: str) -> Parameter:
    """Deviation of a reading from a straight line at half the largest one, as a share of that."""
    return Parameter("bow", "", -0.05, 0.05, 0.0, (0.01,), source, spread=0.01)


def curved(reading: Array, bow: float, largest: float) -> Array:
    """Reading (n,) of a curved instrument at true values (n,), in the same unit.

    largest: reading at which its curve is straight again; 0 where none is known.
    """
    if not bow or largest <= 0.0:
        return reading
    return reading * (1.0 + 4.0 * bow * (1.0 - np.abs(reading) / largest))


def straightened(reading: Array, bow: float, largest: float) -> Array:
    """True values (n,) at readings (n,) of a curved instrument: the inverse of `curved`."""
    if not bow or largest <= 0.0:
        return reading
    # The root of x (1 + 4 b (1 - x / L)) = |reading| that is |reading| at b = 0.
    slope = 1.0 + 4.0 * bow
    root = np.sqrt(np.maximum(slope**2 - 16.0 * bow * np.abs(reading) / largest, 0.0))
    return 2.0 * reading / (slope + root)


GAUGE_BOW = bow("off straight at half pressure, of the largest; gauges 0.0025, cheap ones 0.03")
CURVE = "pressure_nonlinearity"


def gauge(kind: str) -> tuple[Effect, ...]:
    """Effects, for a kind, of the gauge: offset, gain and curve."""
    return (
        Effect(
            "pressure_offset",
            (Parameter("offset_kPa", "kPa", -10.0, 10.0, 0.0, (-1.0, 1.0), "gauge pressures of benches"),),
            (kind,),
        ),
        Effect("pressure_gain", (factor("gain", 0.05, "gauge's sheet, units"),), (kind,)),
        Effect(CURVE, (GAUGE_BOW,), (kind,)),
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


GAIN = factor("gain", 0.05, "calibrations of load cells, sections, units")
CELL_BOW = bow("off straight at half load, of the largest; load cells 0.0005, film sensors 0.03")
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
        Effect(FORCE_SCALE, (GAIN,), (kind,)),
        Effect("force_nonlinearity", (CELL_BOW,), (kind,)),
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
    gain = values.get(f"{FORCE_SCALE}.gain", 0.0)
    force = curved(force, values.get("force_nonlinearity.bow", 0.0), largest)
    return force * (1.0 + gain) if gain else force


def filtered(time_s: Array, force: Array, values: Mapping[str, float]) -> Array:
    """Force or stress (n,) as delayed by a load cell's amplifier, at times (n,) in s (`amplifier`)."""
    if (period := values.get("force_lag.period_s", 0.0)) > 0.0:
        return swinging(time_s, force[None], 1.0 / period, values.get("force_lag.damping", 0.87))[0]
    return first_order_lag(time_s, force, values.get("force_lag.time_s", 0.0))
