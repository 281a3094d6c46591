"""Displacement of a tiled mesh, each copy moving as its mirror image does."""

from __future__ import annotations

import numpy as np

from mu_addon.meshing.mesh import Array, Mesh
from mu_addon.meshing.tiling import _images, _repeated


def tiled_displacement(mesh: Mesh, u: Array, counts: tuple[int, int, int], box: Array, reach: Array) -> Array:
    """Displacement (N, 3) in mm of `tiled(mesh, counts, box)`, each copy moving as its mirror image does.

    u (n, 3): displacement of the mesh, whose box (3,) mm becomes `reach` (3,) mm long.
    """
    nodes, tets, moved = mesh.nodes, mesh.tets, u
    for axis, count in enumerate(counts):
        new_nodes, _ = _repeated(nodes, tets, axis, count, box[axis])
        moved = _repeated_displacement(nodes, moved, axis, count, box[axis], reach[axis])
        nodes, tets = new_nodes, tets[:0]
    return moved


def _repeated_displacement(nodes: Array, u: Array, axis: int, count: int, side: float, reach: float) -> Array:
    _, new = _images(nodes, axis, count, side)
    parts = []
    for copy, fresh in enumerate(new):
        image = u[fresh].copy()
        # Measured from the copy's own low plane, the origin of which moves with the copies before it.
        if copy % 2:
            image[:, axis] = (copy + 1) * (reach - side) - image[:, axis]
        else:
            image[:, axis] += copy * (reach - side)
        parts.append(image)
    return np.vstack(parts)
