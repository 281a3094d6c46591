"""A mesh moved to another unit: on that unit's surfaces, of its volumes, refused where it does not fit."""

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.design.profile import outer_radius
from mu_addon.errors import MeshingError
from mu_addon.fem.elements import reference_gradients
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import LATTICE, MEMBRANE
from mu_addon.meshing.morph import morphed
from mu_addon.meshing.settings import MeshSettings

UNIT = load_preset("mu-1.0x")


def printed(offset):
    return attrs.evolve(UNIT, print=attrs.evolve(UNIT.print, offset_xy_mm=offset, offset_z_mm=offset))


def thicker(factor):
    return attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, wall_mm=factor * UNIT.chambers.wall_mm))


OTHERS = [printed(0.25), printed(-0.1), thicker(0.8), thicker(1.3)]


@pytest.fixture(scope="module", params=[1, 2])
def drawn(request):
    settings = MeshSettings(refine=0.5, order=request.param)
    return settings, mesh_unit(UNIT, settings)


@pytest.mark.parametrize("other", OTHERS, ids=["+0.25", "-0.1", "thin", "thick"])
def test_a_moved_mesh_is_that_of_the_other_unit(drawn, other):
    settings, mesh = drawn
    found = morphed(mesh, UNIT, other, settings)
    d = other.printed
    np.testing.assert_array_equal(found.tets, mesh.tets)
    shared = np.intersect1d(found.corners[found.region == MEMBRANE], found.corners[found.region == LATTICE])
    radius = np.hypot(*found.nodes[shared, :2].T)
    np.testing.assert_allclose(radius, outer_radius(d, found.nodes[shared, 2]), atol=1e-9)
    # The envelope and the mirror keep their nodes in plane.
    for column, planes in enumerate(d.bounds):
        for plane in (0.0, *planes):
            on = mesh.nodes[:, column] == plane
            np.testing.assert_allclose(found.nodes[on, column], plane, atol=1e-12)
    if settings.order == 1:
        # Flat facets, of which another unit's own mesh may have another number around.
        return
    expected = mesh_unit(other, settings)
    for region in (MEMBRANE, LATTICE):
        volume, own = (
            reference_gradients(m.nodes, m.tets[m.region == region]).volumes.sum() for m in (found, expected)
        )
        assert volume == pytest.approx(own, rel=2e-3)


def test_what_does_not_change_dimensions_moves_nothing(drawn):
    settings, mesh = drawn
    skinned = attrs.evolve(UNIT, print=attrs.evolve(UNIT.print, skin_depth_mm=0.1, skin_factor=2.0))
    assert morphed(mesh, UNIT, skinned, settings) is mesh


def test_nodes_move_in_proportion_to_a_small_change(drawn):
    settings, mesh = drawn
    one, ten = (morphed(mesh, UNIT, printed(s), settings).nodes - mesh.nodes for s in (1e-4, 1e-3))
    np.testing.assert_allclose(ten, 10 * one, atol=2e-5)
    assert np.abs(one).max() < 3e-4


def test_another_units_mesh_is_refused(drawn):
    settings, mesh = drawn
    longer = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=7))
    with pytest.raises(MeshingError, match="cannot be moved"):
        morphed(mesh, UNIT, longer, settings)
    with pytest.raises(MeshingError, match="not by gmsh, or has other settings"):
        morphed(mesh, UNIT, thicker(1.1), attrs.evolve(settings, meridian_mm=1.2))
