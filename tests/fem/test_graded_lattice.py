"""Homogenised stiffness of graded struts: slender limits, and what the materials make of it."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.design.grading import Grading
from mu_addon.design.lattice_kinds import sin_squared
from mu_addon.design.parameters import Envelope, load_preset
from mu_addon.errors import InputError
from mu_addon.fem.graded_lattice import element_factors, relative_moduli
from mu_addon.fem.lattice_law import LatticeLaw
from mu_addon.fem.laws import CubicShear, DiagonalStretch, Foam, NeoHooke
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.mesh import LATTICE
from mu_addon.meshing.settings import MeshSettings
from mu_addon.resolved.printed_mesh import mesh_of, mesh_printed
from tests.design.kinds import cross

UNIT = load_preset("mu-1.0x")
D = UNIT.printed
SMALL = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3))


@pytest.fixture(scope="module")
def mesh():
    return mesh_of(SMALL, MeshSettings(refine=0.4))


def with_grading(unit=SMALL, **values):
    return attrs.evolve(unit, grading=Grading(**values))


def test_factor_one_changes_nothing():
    for found in relative_moduli(D, np.ones(3)):
        assert found.tolist() == [1.0, 1.0, 1.0]


@given(st.floats(0.5, 1.9), st.sampled_from([0.0, 0.3]))
def test_thicker_is_stiffer(factor, growth):
    d = attrs.evolve(D, junction_diameter=1.5 + growth, midspan_diameter=2.0 + growth, strut_growth=growth)
    h = 1e-5
    factor = min(factor, (4.0 - growth) / 2.0 - 2 * h)
    up, down = (relative_moduli(d, np.array([x])) for x in (factor + h, factor - h))
    for a, b in zip(up, down, strict=True):
        assert a > b


def test_slender_struts_bend_along_an_axis_and_stretch_in_shear():
    """Gibson and Ashby: E as the relative density squared, d^4, in bending; as the density in tension."""
    slender = attrs.evolve(D, junction_diameter=0.65, midspan_diameter=0.65)
    double = relative_moduli(slender, np.array([1.3]))
    assert np.log(double.E100) / np.log(1.3) == pytest.approx(4.0, abs=0.2)
    assert np.log(double.C44) / np.log(1.3) == pytest.approx(2.0, abs=0.05)


def test_the_kind_without_taper_has_the_mid_spans_diameter():
    straight = attrs.evolve(UNIT, lattice=Envelope(kind="body-centred-straight")).printed
    thick = attrs.evolve(D, junction_diameter=2.0, midspan_diameter=2.0)
    for a, b in zip(
        relative_moduli(straight, np.array([0.8])), relative_moduli(thick, np.array([0.8])), strict=True
    ):
        assert a == pytest.approx(b, rel=1e-12)


def test_what_it_does_not_know_is_refused():
    with pytest.raises(InputError, match="outside"):
        relative_moduli(D, np.array([2.2]))
    for kind in (
        cross(),
        attrs.evolve(D.kind, name="other taper", radius=lambda t, a, b: sin_squared(t, a, b) ** 1.1),
    ):
        with pytest.raises(InputError, match="not known"):
            relative_moduli(attrs.evolve(D, kind=kind), np.array([0.9]))


def test_materials_of_an_even_grading(mesh):
    lattice = mesh.region == LATTICE
    plain, _ = materials_of(SMALL, mesh).small_strain(len(mesh.tets))
    graded, poisson = materials_of(with_grading(cells="* * *: 0.8"), mesh).small_strain(len(mesh.tets))
    ratio = relative_moduli(D, np.array([0.8]))
    assert graded[lattice] == pytest.approx(plain[lattice] * np.sqrt(ratio.E100 * ratio.C44), rel=1e-9)
    assert graded[~lattice] == pytest.approx(plain[~lattice], rel=1e-12)
    assert poisson[lattice] == pytest.approx(UNIT.material.lattice_poisson)


def test_materials_follow_the_field_and_its_mirror_image(mesh):
    unit = with_grading(base=0.8, tip=1.2, minus_y=0.9, beside_x=1.1, cells="1 2 2: 0.8")
    factors = element_factors(unit.printed, mesh)
    lattice = np.flatnonzero(mesh.region == LATTICE)
    middle = mesh.nodes[mesh.tets[lattice, :4]].mean(axis=1)
    assert (factors[lattice] == unit.printed.grading.at(middle * [-1, 1, 1])).all()
    found, _ = materials_of(unit, mesh).small_strain(len(mesh.tets))
    order = np.argsort(factors[lattice])
    assert (np.diff(found[lattice][order]) >= -1e-15).all()


def test_a_lattices_law_is_graded_part_by_part(mesh):
    foam = np.array([0.01, 2.0, 0.01, 3.0, 0.001, 1.0])
    law = LatticeLaw(
        "all", ((Foam, foam), (CubicShear, np.array([0.02])), (DiagonalStretch, np.array([0.01])))
    )
    plain = materials_of(SMALL, mesh, law)
    graded = materials_of(with_grading(cells="* * *: 1.2"), mesh, law)
    ratio = relative_moduli(D, np.array([1.2]))
    for before, after in zip(plain.layers[1:], graded.layers[1:], strict=True):
        wanted = {Foam: ratio.E100, CubicShear: ratio.C44, DiagonalStretch: ratio.C12}[before.law]
        assert after.weight == pytest.approx(before.weight * wanted)
    assert plain.layers[0].law is graded.layers[0].law is NeoHooke
    assert (graded.layers[0].weight == 1.0).all()


def test_ungraded_materials_are_what_they_were(mesh):
    """One neo-Hookean layer over all elements, as without any grading."""
    (layer,) = materials_of(SMALL, mesh).layers
    assert layer.law is NeoHooke
    assert len(layer.elements) == len(mesh.tets)


def test_the_skin_of_graded_struts_is_as_deep_as_that_of_others():
    thin = attrs.evolve(SMALL.lattice, junction_diameter_mm=1.2, midspan_diameter_mm=1.6)
    skin = attrs.evolve(SMALL.print, skin_depth_mm=0.2, skin_factor=2.0)
    graded = attrs.evolve(with_grading(cells="* * *: 0.8"), print=skin)
    plain = attrs.evolve(SMALL, lattice=thin, print=skin)
    mesh = mesh_printed(plain, MeshSettings(refine=0.4))
    found, wanted = (materials_of(unit, mesh).layers[0].parameters for unit in (graded, plain))
    # Depths are looked up for factors in steps of 2 %.
    assert found.mean(axis=0) == pytest.approx(wanted.mean(axis=0), rel=0.01)
