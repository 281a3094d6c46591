"""Laws in parallel, uniform in space, of a homogenised lattice."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from .elements import ReferenceGradients, reference_gradients
from .materials import Layer

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh


@attrs.frozen(eq=False)
class LatticeLaw:
    """Laws that act in parallel in every lattice element.

    layers: (law, parameters (count,)) pairs. stretch: the smallest and the largest stretch that they were
    fitted to. Raises InputError where there is no law, or one does not admit its parameters.
    """

    name: str
    layers: tuple[tuple[Any, Array], ...]
    stretch: tuple[float, float] = (0.0, np.inf)

    def __attrs_post_init__(self) -> None:
        if not self.layers:
            raise InputError(f"the lattice's law {self.name!r} has no layer", remedy="give it a law")
        rows = tuple((law, np.ascontiguousarray(row, np.float64)) for law, row in self.layers)
        object.__setattr__(self, "layers", rows)
        self.fill(np.zeros(1, int))

    def fill(self, elements: Array) -> tuple[Layer, ...]:
        """Layers of a body's materials with these laws in some elements (k,), the same parameters in each."""
        return tuple(Layer(law, elements, np.tile(row, (len(elements), 1))) for law, row in self.layers)

    def hash(self) -> str:
        """SHA-256 of the laws' names and every parameter."""
        digest = hashlib.sha256(self.name.encode())
        for law, row in self.layers:
            digest.update(repr((law.name, law.parameter_names)).encode() + row.tobytes())
        return digest.hexdigest()


def deformation_gradients(
    mesh: Mesh, u: Array, elements: Array, reference: ReferenceGradients | None = None
) -> tuple[Array, Array]:
    """F (e, q, 3, 3) and volumes (e, q) in mm3 of the quadrature points of some elements (e,).

    u: displacements (n, 3) in mm. reference: of these elements, where it is known.
    """
    tets = mesh.tets[elements]
    reference = reference or reference_gradients(mesh.nodes, tets)
    return np.eye(3) + np.einsum("eai,eqaj->eqij", u[tets], reference.gradients), reference.volumes


def stretches(F: Array) -> Array:
    """Principal stretches (..., 3), ascending, of deformation gradients F (..., 3, 3)."""
    return np.sqrt(np.linalg.eigvalsh(np.swapaxes(F, -1, -2) @ F))
