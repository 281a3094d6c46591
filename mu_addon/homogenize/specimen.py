"""A block of n x n x n cells between plates, one eighth of it: three mid-planes are mirrors."""

from __future__ import annotations

import attrs
import numpy as np

from ..errors import InputError
from ..fem.materials import Layer, Materials
from ..meshing.mesh import AXES, FLIPPED_TET, Mesh
from ..meshing.tiling import box_of, tiled


@attrs.frozen(eq=False)
class Specimen:
    """An eighth of a block, from its middle, the origin, to its outer faces; the plates move along z.

    mesh: mirrored at all three zero planes; its `tip` are the nodes on the plate. cells: along each side.
    side_mm: of the whole block. materials: of the eighth.
    """

    mesh: Mesh
    cells: int
    side_mm: float
    materials: Materials


def block_specimen(octant: Mesh, cells: int, materials: Materials) -> Specimen:
    """One eighth of a block of cells^3 cells, for `compress`, made of copies of an eighth of one cell.

    octant: mesh of [0, U/2]^3 mm with a corner of the cell at the origin, and materials: those of the octant.
    The block's outer faces are faces of cells, cut flat. Laws must be isotropic, since copies are mirror
    images. Raises InputError for less than one cell or an octant that is not cubic.
    """
    if cells < 1 or cells != int(cells):
        raise InputError(f"a specimen of {cells} cells", "compression test", "ask for 1 cell or more")
    box = box_of(octant)
    if not np.allclose(box, box[0], rtol=1e-12):
        raise InputError(f"the octant of a cell is {box} mm", "compression test", "give that of a cubic cell")
    nodes, tets = octant.nodes, octant.tets
    if cells % 2:
        # The middle of an odd block is the middle of a cell, of an even one a corner.
        nodes = box[0] - nodes
        tets = tets[:, FLIPPED_TET[: tets.shape[1]]]
    piece = attrs.evolve(octant, nodes=nodes, tets=tets)
    mesh = tiled(piece, (cells,) * 3, (box[0],) * 3, symmetry=AXES)
    mesh = attrs.evolve(mesh, base=mesh.base[:0])
    return Specimen(mesh, int(cells), 2 * cells * box[0], repeated(materials, len(tets), cells**3))


def repeated(materials: Materials, elements: int, copies: int) -> Materials:
    """Materials of `copies` copies, one after another, of a piece of `elements` elements."""
    starts = elements * np.arange(copies)[:, None]
    return Materials(
        tuple(
            Layer(
                layer.law,
                (starts + layer.elements).ravel(),
                np.tile(layer.parameters, (copies, 1)),
                np.tile(layer.weight, copies),
            )
            for layer in materials.layers
        )
    )
