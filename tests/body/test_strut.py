"""A strut swept from junction to junction is the printed lattice's octant."""

import attrs
import numpy as np
import pytest

from mu_addon.body.strut import strut_mesh
from mu_addon.design import load_preset
from mu_addon.design.strut_cell import Facets, StrutCell, relative_density
from mu_addon.errors import InputError
from mu_addon.fem.materials import Materials
from mu_addon.homogenize.elasticity import strained
from mu_addon.meshing.mesh import boundary_faces
from mu_addon.meshing.quality import dihedral_angles, element_volumes, folded_corners
from mu_addon.meshing.tiling import tiled

DIMENSIONS = load_preset("mu-1.0x").dimensions


def cell(d):
    return StrutCell(d.kind, d.cell, d.junction_diameter / 2.0, d.midspan_diameter / 2.0)


@pytest.mark.parametrize(
    ("rings", "layers", "error"),
    [
        (1, 5, 3e-3),
        pytest.param(2, 8, 3e-4, marks=pytest.mark.nightly("test_its_volume_is_that_of_the_printed_cell")),
    ],
)
def test_its_volume_is_that_of_the_printed_cell(rings, layers, error):
    mesh = strut_mesh(DIMENSIONS, rings, layers)
    density = element_volumes(mesh).sum() / (DIMENSIONS.cell / 2.0) ** 3
    # The drawn cell has flat facets, here so many that they cost less than 1e-3 of it.
    assert density == pytest.approx(relative_density(cell(DIMENSIONS), Facets(128, 64)), rel=error + 1e-3)


def test_its_elements_are_sound():
    mesh = strut_mesh(DIMENSIONS, 1, 5)
    assert dihedral_angles(mesh).min() > 12.0
    assert folded_corners(mesh).min() > 0.5


def test_mirror_images_meet_face_to_face():
    mesh = strut_mesh(DIMENSIONS, 2, 5)
    block = tiled(mesh, (2, 2, 2))
    faces, _ = boundary_faces(block.tets)
    points = block.nodes[faces]
    sides = np.stack([points == 0.0, points == DIMENSIONS.cell]).all(axis=2).any(axis=(0, 2))
    middle = (points == DIMENSIONS.cell / 2.0).all(axis=1).any(axis=1)
    assert sides.any()
    assert not middle.any(), "a face on a plane between two octants belongs to one element only"


def test_its_three_shears_are_one():
    mesh = strut_mesh(DIMENSIONS, 1, 5)
    resin = Materials.neo_hooke(np.ones(len(mesh.tets)), np.full(len(mesh.tets), 0.45))
    whole, moved = strained(mesh, resin)
    one, fewer = strained(mesh, resin, alike=True)
    assert np.abs(one.C - whole.C).max() < 1e-9 * whole.C.max()
    assert (fewer == moved[:4]).all()


def test_what_it_cannot_sweep_is_refused():
    thick = attrs.evolve(DIMENSIONS, midspan_diameter=6.0)
    with pytest.raises(InputError, match="fill their cell"):
        strut_mesh(thick, 1, 5)


def test_its_elements_bend_as_finer_ones_do():
    """E[100] of the lattice is struts in bending; with the other diagonals one ring was 53 % too stiff."""
    from mu_addon.fem.materials import Materials
    from mu_addon.homogenize.elasticity import effective_tensor

    def moduli(rings, layers):
        mesh = strut_mesh(DIMENSIONS, rings, layers)
        count = len(mesh.tets)
        return effective_tensor(mesh, Materials.neo_hooke(np.full(count, 1.0), np.full(count, 0.45)))

    coarse, fine = moduli(1, 6), moduli(2, 12)
    assert coarse.cubic_error < 1e-9, "the three planes of an end are one as the other"
    assert fine.E100 < coarse.E100 < 1.08 * fine.E100
    assert fine.C44 < coarse.C44 < 1.02 * fine.C44
