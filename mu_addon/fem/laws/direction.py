"""Directions in the undeformed body, as parameters of a law."""

from __future__ import annotations

from typing import Any

import numpy as np

from .law import Array
from .valid import require


def unit(directions: Array) -> Array:
    """Directions (3,) or (k, 3) of any length but 0 as unit vectors (k, 3)."""
    directions = np.atleast_2d(np.asarray(directions, float))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def require_unit(law: Any, parameters: Array, first: int) -> None:
    """Raise InputError unless parameters `first` to `first` + 2 of every row (k, count) are a unit vector.

    Its length may differ from 1 by 1e-9. law: named in the error.
    """
    length = np.linalg.norm(parameters[:, first : first + 3], axis=1)
    name = f"length of ({', '.join(law.parameter_names[first : first + 3])})"
    require(np.abs(length - 1) < 1e-9, law, name, length, "1", f"let {law.__name__}.parameters make the row")
