"""Materials of a unit's mesh."""

import attrs
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.grading import Grading
from mu_addon.design.parameters import load_preset
from mu_addon.fem.laws import NeoHooke
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings

UNIT = load_preset("mu-1.0x")
SMALL = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=3))


def test_wall_and_struts_are_of_one_resin():
    mesh = mesh_printed(SMALL, MeshSettings(refine=0.35))
    (layer,) = materials_of(SMALL, mesh).layers
    assert layer.law is NeoHooke
    assert len(layer.elements) == len(mesh.tets)
    assert (layer.parameters == NeoHooke.parameters(2.5, 0.45)).all()


def test_the_skin_of_graded_struts_is_as_deep_as_that_of_others():
    thin = attrs.evolve(SMALL.lattice, junction_diameter_mm=1.2, midspan_diameter_mm=1.6)
    skin = attrs.evolve(SMALL.print, skin_depth_mm=0.2, skin_factor=2.0)
    graded = attrs.evolve(SMALL, grading=Grading(cells="* * *: 0.8"), print=skin)
    plain = attrs.evolve(SMALL, lattice=thin, print=skin)
    mesh = mesh_printed(plain, MeshSettings(refine=0.4))
    found, wanted = (materials_of(unit, mesh).layers[0].parameters for unit in (graded, plain))
    # Depths are looked up for factors in steps of 2 %.
    assert found.mean(axis=0) == pytest.approx(wanted.mean(axis=0), rel=0.01)
