"""Forces and stiffness of single elements, before they are assembled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .elements import reference_gradients

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh
    from .model import MaterialData, Model

Array = np.ndarray[Any, Any]


def element_forces(model: Model, u: Array, m: MaterialData) -> Array:
    """Internal forces (m, k, 3) in N of every element on its nodes, at displacements (n, 3) in mm."""
    model.residual(u, 0.0, m)
    found: Array = model._element_force.numpy().copy()
    return found


def element_stiffness(model: Model, u: Array, m: MaterialData, elements: Array) -> Array:
    """Tangents (e, 3k, 3k) in N/mm of some elements (e,), by the displacements of their k nodes.

    u: displacements (n, 3) in mm, about which the tangent is taken, at no pressure.
    """
    model.tangent(u, 0.0, m)
    k = model.mesh.tets.shape[1]
    rows, columns = np.triu_indices(k)
    parts = model._block_parts.numpy()[: model._element_blocks]
    blocks = parts.reshape(-1, len(rows), 3, 3)[elements]
    whole = np.empty((len(elements), k, 3, k, 3))
    whole[:, rows, :, columns, :] = blocks.transpose(1, 0, 2, 3)
    whole[:, columns, :, rows, :] = blocks.transpose(1, 0, 3, 2)
    return whole.reshape(len(elements), 3 * k, 3 * k)


def rotations(mesh: Mesh, u: Array, elements: Array) -> Array:
    """Rotation (e, 3, 3) of each element's mean deformation gradient: the nearest orthogonal matrix.

    u: displacements (n, 3) in mm; elements: numbers (e,). By singular value decomposition.
    """
    reference = reference_gradients(mesh.nodes, mesh.tets[elements])
    share = reference.volumes / reference.volumes.sum(axis=1)[:, None]
    F = np.eye(3) + np.einsum("eai,eqaj,eq->eij", u[mesh.tets[elements]], reference.gradients, share)
    left, _, right = np.linalg.svd(F)
    return np.asarray(left @ right)
