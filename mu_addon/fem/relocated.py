"""A body with its nodes elsewhere: same elements, unknowns and pattern, other reference gradients."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import warp as wp

from ..errors import InputError
from ..meshing.mesh import Mesh
from .elements import reference_gradients
from .model import Model

Array = np.ndarray[Any, Any]


def relocated(model: Model, mesh: Mesh) -> Model:
    """The model of a mesh of the same elements with other nodes, in milliseconds instead of a new pattern.

    The two share buffers and factor: use one after the other, and factorise again in between. `load` is the
    first model's and must be set anew where it depends on the places. Raises InputError for a mesh of other
    elements and for a model with obstacles or self-contact, and MeshingError for an inverted element.
    """
    if model.obstacles or model.self_contact is not None:
        raise InputError(
            "a body in contact cannot be relocated", "model", "leave out obstacles and self-contact"
        )
    if mesh.nodes.shape != model.mesh.nodes.shape or not np.array_equal(mesh.tets, model.mesh.tets):
        raise InputError("the other mesh has other elements", "mesh", "give the same mesh with moved nodes")
    found = copy.copy(model)
    if mesh is model.mesh:
        return found
    reference = reference_gradients(mesh.nodes, mesh.tets)
    weights = reference.volumes * mesh.filled if mesh.resolved else reference.volumes
    found.mesh = mesh
    found.volumes = weights.sum(axis=1)
    found._gradients = model._put(reference.gradients, wp.vec3d)
    found._dV = model._put(weights, wp.float64)
    return found
