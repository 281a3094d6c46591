"""A printed unit's mesh moved to a slightly different unit, against that unit meshed anew."""

import attrs
import numpy as np
import pytest

from mu_addon.body.morph import PrintedMorph
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.errors import MeshingError
from mu_addon.fem.elements import solid_volumes
from mu_addon.meshing.mesh import LATTICE, MEMBRANE
from mu_addon.meshing.settings import MeshSettings

SETTINGS = MeshSettings(refine=0.3)


def unit(scale=1.0, **values):
    made = load_preset("mu-1.0x")
    sections = {"chambers": {"count": 3}, "lattice": {}, "grading": {}, "print": {}}
    for name, value in values.items():
        section, _, key = name.partition("__")
        sections[section][key] = value
    changed = {name: attrs.evolve(getattr(made, name), **own) for name, own in sections.items()}
    return attrs.evolve(made, scale=scale, **changed)


@pytest.fixture(scope="module")
def morph():
    drawn = unit()
    return PrintedMorph(mesh_printed(drawn, SETTINGS, solid=True), drawn, SETTINGS)


def volume(mesh, region):
    return solid_volumes(mesh)[mesh.region == region].sum()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "of_struts"),
    [
        ({"chambers__wall_mm": 0.95}, False),
        ({"chambers__neck_diameter_mm": 12.8}, False),
        ({"chambers__bladder_share": 0.62}, False),
        ({"lattice__junction_diameter_mm": 1.6}, True),
        ({"lattice__midspan_diameter_mm": 2.1}, True),
        ({"grading__plus_y": 1.05}, True),
        ({"print__offset_xy_mm": 0.03, "print__offset_z_mm": 0.03}, True),
    ],
)
def test_volumes_change_as_those_of_a_unit_that_is_meshed_anew(morph, values, of_struts):
    other = unit(**values)
    moved, anew = morph.to(other), mesh_printed(other, SETTINGS, solid=True)
    for region in (MEMBRANE, LATTICE):
        before, after, found = (volume(m, region) for m in (morph.mesh, anew, moved))
        # Struts are cut by points, and dropped where next to nothing is left.
        slack = 2e-3 * before if region == LATTICE else 1e-4 * before
        assert found - before == pytest.approx(after - before, rel=0.1, abs=slack), region
    assert np.array_equal(moved.tets, morph.mesh.tets)
    if not of_struts:
        lattice = np.unique(moved.tets[moved.region == LATTICE])
        assert np.array_equal(moved.nodes[lattice], morph.mesh.nodes[lattice])


def test_tied_nodes_stay_where_the_wall_has_them(morph):
    moved = morph.to(unit(chambers__wall_mm=0.91, chambers__neck_diameter_mm=12.6))
    np.testing.assert_allclose(moved.tied_weights.sum(axis=1), 1.0, atol=1e-9)
    # Weights of a point in an element give the point itself.
    place = np.einsum("tk,tki->ti", moved.tied_weights, moved.nodes[moved.tied_to])
    base = morph.mesh
    before = np.einsum("tk,tki->ti", base.tied_weights, base.nodes[base.tied_to])
    held = np.abs(before - base.nodes[base.tied]).max(axis=1) > 1e-6
    np.testing.assert_allclose(place[~held], moved.nodes[moved.tied][~held], atol=2e-3)


ANEW = pytest.mark.nightly("test_beams_are_those_of_a_unit_that_is_meshed_anew")


@pytest.mark.parametrize(
    "values",
    [
        {"lattice__junction_diameter_mm": 1.52, "lattice__midspan_diameter_mm": 2.01},
        pytest.param({"grading__plus_y": 1.05}, marks=ANEW),
        pytest.param({"scale": 1.1}, marks=ANEW),
    ],
)
def test_beams_are_those_of_a_unit_that_is_meshed_anew(values):
    drawn, other = unit(), unit(**values)
    moved = PrintedMorph(mesh_printed(drawn, SETTINGS), drawn, SETTINGS).to(other)
    anew = mesh_printed(other, SETTINGS)
    assert np.array_equal(moved.beams, anew.beams)
    np.testing.assert_allclose(moved.flexible, anew.flexible, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(moved.nodes[moved.beams], anew.nodes[moved.beams], atol=1e-6)
    np.testing.assert_allclose(moved.nodes[moved.carried], anew.nodes[moved.carried], atol=1e-6)


def test_another_scale_scales_all_of_it(morph):
    moved = morph.to(unit(scale=1.1))
    np.testing.assert_allclose(moved.nodes, 1.1 * morph.mesh.nodes, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(moved.filled, morph.mesh.filled, atol=1e-9)
    np.testing.assert_allclose(moved.tied_weights, morph.mesh.tied_weights, atol=1e-7)


def test_what_cannot_be_moved_is_refused(morph):
    for other in (
        unit(chambers__count=4),
        unit(lattice__kind="body-centred-straight"),
        unit(lattice__cells_y_plus=3),
    ):
        with pytest.raises(MeshingError, match="cannot be moved"):
            morph.to(other)
    with pytest.raises(MeshingError, match="not of a printed unit"):
        PrintedMorph(morph.mesh, unit(chambers__wall_mm=1.0), SETTINGS)
