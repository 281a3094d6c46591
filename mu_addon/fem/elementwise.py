"""Forces of single elements, before they are assembled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from .model import MaterialData, Model

Array = np.ndarray[Any, Any]


def element_forces(model: Model, u: Array, m: MaterialData) -> Array:
    """Internal forces (m, k, 3) in N of every element on its nodes, at displacements (n, 3) in mm."""
    model.residual(u, 0.0, m)
    found: Array = model._element_force.numpy().copy()
    return found
