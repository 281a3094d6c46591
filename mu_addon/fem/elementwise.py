"""Forces and stiffness of single elements, before they are assembled."""

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


def element_stiffness(model: Model, u: Array, m: MaterialData, elements: Array) -> Array:
    """Tangents (e, 3k, 3k) in N/mm of some elements (e,) by their nodes' displacements, at u (n, 3) in mm."""
    model.tangent(u, 0.0, m)
    k = model.mesh.tets.shape[1]
    rows, columns = np.triu_indices(k)
    parts = model._block_parts.numpy()[: model._element_blocks]
    blocks = parts.reshape(-1, len(rows), 3, 3)[elements]
    whole = np.empty((len(elements), k, 3, k, 3))
    whole[:, rows, :, columns, :] = blocks.transpose(1, 0, 2, 3)
    whole[:, columns, :, rows, :] = blocks.transpose(1, 0, 3, 2)
    return whole.reshape(len(elements), 3 * k, 3 * k)
