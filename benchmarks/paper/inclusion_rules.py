"""The paper's inclusion rule beside the one that converges: which share of an element a sensor stiffens."""

from __future__ import annotations

from typing import Any

import numpy as np

from mu_addon.placement.inclusion import Inclusion

Array = np.ndarray[Any, Any]

RULES = INTERSECT, VOLUME_FRACTION = ("intersect", "volume_fraction")


def sensor_share(rule: str, found: Inclusion) -> Array:
    """Share (m,) of every element that becomes the sensor's material under an inclusion rule.

    "intersect" (the paper's): the whole of every touched element, so that J depends on the mesh.
    "volume_fraction": the share inside the cylinder, in parallel with the lattice's own (Voigt's upper
    bound); it converges. Raises ValueError for another rule.

    >>> found = Inclusion(np.array([0.0, 0.25, 1.0]), radius_mm=1.0, length_mm=25.0)
    >>> sensor_share("intersect", found).tolist(), sensor_share("volume_fraction", found).tolist()
    ([0.0, 1.0, 1.0], [0.0, 0.25, 1.0])
    """
    if rule == INTERSECT:
        return found.touched.astype(float)
    if rule == VOLUME_FRACTION:
        return found.share
    raise ValueError(f"unknown inclusion rule {rule!r}; use one of {', '.join(RULES)}")
