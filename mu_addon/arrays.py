"""The type of a numpy array in signatures, whose shape and unit stand in docstrings, and converters to it."""

from typing import Any

import numpy as np

Array = np.ndarray[Any, Any]


def float64(values: Any) -> Array:
    """Values as a contiguous array of floats."""
    return np.ascontiguousarray(values, np.float64)


def int32(values: Any) -> Array:
    """Values as a contiguous array of whole numbers."""
    return np.ascontiguousarray(values, np.int32)
