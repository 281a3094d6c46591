"""A body with moved nodes: same elements, unknowns and pattern, other reference gradients."""

from __future__ import annotations

import copy

import numpy as np

from ..errors import InputError
from ..meshing.mesh import Mesh
from .carried_nodes import Carried
from .elements import Reference
from .model import Model
from .self_contact import SelfContact


def relocated(model: Model, mesh: Mesh, self_contact: SelfContact | None = None) -> Model:
    """The model of a mesh of the same elements with moved nodes, in milliseconds, without a new pattern.

    The two share buffers and factor: use one after the other, and factorise again in between. `load` is the
    first model's and must be set again if it depends on the positions. self_contact: of the other mesh, see
    `SelfContact.relocated`; needed where the first model has one. Raises InputError for a mesh of other
    elements, for a model with obstacles or self-contact alone, and for the tangent of a model whose tied
    nodes have other masters than before: its pattern differs. An inverted element raises MeshingError when it
    is first used.
    """
    if model.obstacles or (model.self_contact is not None and self_contact is None):
        raise InputError(
            "a body in contact cannot be relocated", "model", "leave out obstacles and self-contact"
        )
    if mesh.nodes.shape != model.mesh.nodes.shape or not np.array_equal(mesh.tets, model.mesh.tets):
        raise InputError("the other mesh has other elements", "mesh", "give the same mesh with moved nodes")
    found = copy.copy(model)
    found.self_contact = self_contact
    if mesh is model.mesh:
        return found
    found.mesh = mesh
    found.reference = Reference(mesh, model.device, model.reference)
    if len(mesh.beams):
        found._carried = Carried(mesh)
    if model._folding is not None and not np.array_equal(mesh.tied_weights, model.mesh.tied_weights):
        found._folding = model._folding.of(mesh)
    return found
