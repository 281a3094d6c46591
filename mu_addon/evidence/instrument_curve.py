"""The curve of a gauge or load cell whose reading is not proportional to what it measures."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .parameter import Parameter


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
