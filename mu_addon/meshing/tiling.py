"""A mesh of one piece of a mirror-symmetric pattern, repeated by mirror images."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from ..errors import MeshingError
from .mesh import FLIPPED_TET, Mesh


def box_of(mesh: Mesh) -> tuple[float, float, float]:
    """Side lengths in mm of the smallest box from the origin that holds a mesh."""
    x, y, z = mesh.nodes.max(axis=0)
    return float(x), float(y), float(z)


def tiled(
    mesh: Mesh,
    counts: tuple[int, int, int],
    box: Sequence[float] | None = None,
    symmetry: tuple[str, ...] = (),
) -> Mesh:
    """Copies of a mesh in its box [0, box] side by side, every other one mirrored, along x, y and z.

    counts: of copies along each axis. box: (3,) mm, `box_of(mesh)` if not given. Nodes exactly on a shared
    plane become one. The m elements of each copy follow those of the copy before, in the mesh's order; the
    cavity is left out; base and tip are the nodes at the lowest and highest z. symmetry: the axes whose zero
    plane stays a mirror. Raises MeshingError for a mesh that leaves its box or a count below 1.
    """
    size = np.array(box_of(mesh) if box is None else box, float)
    if (mesh.nodes < 0).any() or (mesh.nodes > size).any():
        raise MeshingError(
            "a mesh leaves the box it is to be repeated with", f"box {tuple(size)} mm", "give its whole box"
        )
    if min(counts) < 1:
        raise MeshingError(f"{counts} copies are no mesh", "tiling", "ask for one or more")
    nodes, tets = mesh.nodes, mesh.tets
    for axis, count in enumerate(counts):
        nodes, tets = _repeated(nodes, tets, axis, count, size[axis])
    base, tip = (np.flatnonzero(nodes[:, 2] == z) for z in (0.0, counts[2] * size[2]))
    region = np.tile(mesh.region, int(np.prod(counts)))
    return Mesh(nodes, tets, region, mesh.cavity[:0], base, tip, symmetry)


def _images(nodes: Array, axis: int, count: int, side: float) -> tuple[list[Array], list[Array]]:
    """Numbers (n,) of the nodes of each copy along an axis, and a mask of its new nodes."""
    low, high = nodes[:, axis] == 0.0, nodes[:, axis] == side
    total = len(nodes)
    numbers, new = [np.arange(total)], [np.ones(total, bool)]
    for copy in range(1, count):
        fresh = ~(high if copy % 2 else low)
        number = numbers[-1].copy()
        number[fresh] = total + np.arange(np.count_nonzero(fresh))
        total += np.count_nonzero(fresh)
        numbers.append(number)
        new.append(fresh)
    return numbers, new


def _repeated(nodes: Array, tets: Array, axis: int, count: int, side: float) -> tuple[Array, Array]:
    numbers, new = _images(nodes, axis, count, side)
    points, elements = [], []
    for copy, (number, fresh) in enumerate(zip(numbers, new, strict=True)):
        image = nodes[fresh].copy()
        along = image[:, axis]
        mirrored = copy % 2 == 1
        # In this form both planes of every copy come out as whole multiples of the side.
        image[:, axis] = (copy + 1) * side - along if mirrored else copy * side + along
        end = along == (0.0 if mirrored else side)
        image[end, axis] = (copy + 1) * side
        points.append(image)
        turned = FLIPPED_TET[: tets.shape[1]] if mirrored else slice(None)
        elements.append(number[tets][:, turned])
    return np.vstack(points), np.vstack(elements)
