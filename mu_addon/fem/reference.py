"""Elements of the undeformed body: gradients of shape functions and volumes, computed on demand."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import warp as wp

from .elements import ReferenceGradients, reference_gradients

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh

Array = np.ndarray[Any, Any]


class Reference:
    """Gradients and volumes of a mesh's undeformed elements, on a device of Warp as well.

    near: of a mesh of the same elements; only elements with moved nodes are then computed anew.
    """

    def __init__(self, mesh: Mesh, device: str, near: Reference | None = None) -> None:
        self.mesh, self.device = mesh, device
        self._near = near

    @cached_property
    def at(self) -> ReferenceGradients:
        """Gradients and volumes at the quadrature points; raises MeshingError for an inverted element."""
        mesh, near = self.mesh, self._near
        if near is None:
            return reference_gradients(mesh.nodes, mesh.tets)
        moved = (mesh.nodes != near.mesh.nodes).any(axis=1)[mesh.tets].any(axis=1)
        if not moved.any():
            return near.at
        gradients, volumes = near.at.gradients.copy(), near.at.volumes.copy()
        own = reference_gradients(mesh.nodes, mesh.tets[moved])
        gradients[moved], volumes[moved] = own.gradients, own.volumes
        return ReferenceGradients(gradients, volumes)

    @property
    def filled_volumes(self) -> Array:
        """Volumes (m, q) in mm3 that the quadrature points stand for, as far as they are filled."""
        volumes = self.at.volumes
        return np.asarray(volumes * self.mesh.filled if self.mesh.resolved else volumes)

    @cached_property
    def on_device(self) -> tuple[wp.array, wp.array]:
        """Gradients (m, q, k) and filled volumes (m, q) as kernels take them."""
        here = self.device == "cpu"
        volumes = np.ascontiguousarray(self.filled_volumes)
        return (
            wp.array(self.at.gradients, dtype=wp.vec3d, device=self.device, copy=not here),
            wp.array(volumes, dtype=wp.float64, device=self.device, copy=not here),
        )
