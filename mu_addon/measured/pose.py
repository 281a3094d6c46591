"""Direction of gravity, seen from a unit that was turned."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..errors import InputError

Array = np.ndarray[Any, Any]

Direction = tuple[float, float, float]
X: Direction = (1.0, 0.0, 0.0)


def down(orientation_deg: float, axis: Direction = X) -> Array:
    """Unit vector (3,) of gravity in the unit's frame; at 0 degrees along z, as a unit hangs.

    Gravity is turned by orientation_deg degrees about `axis` (3,), of any length but 0, as a right-handed
    screw turns (Rodrigues): about x to -y, about y to +x. Raises InputError for an axis without a length.

    >>> down(0.0).round(9).tolist()[2], down(90.0, (0.0, 1.0, 0.0)).round(9).tolist()[0]
    (1.0, 1.0)
    """
    n = np.array(axis, np.float64)
    length = float(np.linalg.norm(n))
    if not (n.shape == (3,) and length > 0.0):
        raise InputError(
            f"{axis!r} is no axis to turn about", "orientation", "give three numbers, not all of them 0"
        )
    n /= length
    a, z = math.radians(orientation_deg), np.array([0.0, 0.0, 1.0])
    return np.asarray(math.cos(a) * z + math.sin(a) * np.cross(n, z) + (1.0 - math.cos(a)) * n[2] * n)
