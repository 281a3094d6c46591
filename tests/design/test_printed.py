"""The printed size: struts and walls alike, the profile where it should be, what offsets may not do."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from scipy.integrate import trapezoid
from scipy.spatial import cKDTree

from mu_addon.design.lattice import lattice_of
from mu_addon.design.parameters import Chambers, Envelope, Printing, Unit, Waveguide, load_preset
from mu_addon.design.printed import as_printed, skin_stiffening
from mu_addon.design.profile import cavity_radius, cavity_volume, outer_radius, outer_slope, outer_volume
from mu_addon.errors import InputError
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.mesh import LATTICE, MEMBRANE

from .units import units

PRESETS = ("mu-0.75x", "mu-1.0x", "mu-1.5x")


def printed(unit, *offsets, **more):
    return attrs.evolve(unit, print=Printing(*offsets, **more))


@given(units(), st.floats(-0.3, 0.5))
@settings(max_examples=60)
def test_the_same_offset_thickens_struts_and_walls_alike(unit, offset):
    try:
        unit = printed(unit, offset, offset)
    except InputError:
        reject()
    d, p = unit.dimensions, unit.printed
    for key in ("junction_diameter", "midspan_diameter", "wall", "base_cap", "tip_cap", "inlet_wall"):
        assert getattr(p, key) == pytest.approx(getattr(d, key) + 2 * offset, abs=1e-12)
    assert (p.R, p.r) == pytest.approx((d.R + offset, d.r + offset))
    # The cavity moves in as far as the outer surface moves out, at apex and neck.
    for z in (d.cell / 2, d.cell):
        assert outer_radius(p, z) == pytest.approx(outer_radius(d, z) + offset)
        assert cavity_radius(p, z) == pytest.approx(cavity_radius(d, z) - offset)
    # What the pitch, the plate and the model hold stays.
    kept = ("cell", "count", "bounds", "row", "inclusion_radius", "well_pitch", "well_depth", "kind")
    assert [getattr(p, key) for key in kept] == [getattr(d, key) for key in kept]
    assert p.a + p.b == pytest.approx(d.a + d.b)
    assert np.array_equal(lattice_of(p).nodes, lattice_of(d).nodes)


@given(units())
@settings(max_examples=20)
def test_without_an_offset_the_printed_unit_is_the_nominal_one(unit):
    assert unit.printed is unit.dimensions


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("offset", [-0.2, 0.1, 0.3])
def test_the_printed_profile_lies_the_offset_outside(name, offset):
    """The printed parabolas are as far from the nominal ones as they were moved, within 10 % everywhere."""
    d = load_preset(name).dimensions
    p = as_printed(d, offset, offset)
    z = np.linspace(0.0, 3.0 * d.cell, 60001)
    nominal = cKDTree(np.stack([outer_radius(d, z), z], axis=1))
    middle = np.linspace(d.cell, 2.0 * d.cell, 801)
    gap, _ = nominal.query(np.stack([outer_radius(p, middle), middle], axis=1))
    assert np.abs(gap - abs(offset)).max() < 0.1 * abs(offset)
    assert ((outer_radius(p, middle) - outer_radius(d, middle)) * offset > 0).all()


@pytest.mark.parametrize("offset", [0.01, -0.01])
def test_printed_resin_is_the_nominal_and_its_skin(offset):
    """The change of the membrane's volume is the offset times the area of its outer and inner surfaces."""
    d = load_preset("mu-1.0x").dimensions
    p = as_printed(d, offset, offset)
    z = np.linspace(0.0, d.height, 20001)
    outer = trapezoid(2 * np.pi * outer_radius(d, z) * np.hypot(1, outer_slope(d, z)), z)
    gain = (outer_volume(p) - outer_volume(d)) / offset
    # Between apex and joint the parabolas lie up to a tenth of the offset inside, and never outside.
    assert 0.94 * outer < gain < outer
    inner = np.linspace(d.base_cap, d.height - d.tip_cap, 20001)
    radius = cavity_radius(d, inner)
    side = trapezoid(2 * np.pi * radius * np.hypot(1, np.gradient(radius, inner)), inner)
    ends = np.pi * (radius[0] ** 2 + radius[-1] ** 2)
    # Caps grow inward only, by both of their moves; what the outside lacks the inside has.
    lost = (cavity_volume(d) - cavity_volume(p)) / offset
    assert gain + lost == pytest.approx(outer + side + 2 * ends, rel=0.01)


def test_unequal_offsets_move_what_faces_them():
    d = load_preset("mu-1.0x").dimensions
    wide, tall = as_printed(d, 0.2, 0.0), as_printed(d, 0.0, 0.2)
    assert (wide.R, wide.base_cap) == pytest.approx((d.R + 0.2, d.base_cap))
    assert (tall.R, tall.base_cap) == pytest.approx((d.R, d.base_cap + 0.4))
    assert tall.a > d.a  # bladders grow along z into the necks
    for p in (wide, tall):
        assert d.wall < p.wall < d.wall + 0.4
        assert d.junction_diameter < p.junction_diameter < d.junction_diameter + 0.4
    both = as_printed(d, 0.2, 0.2)
    # A half-diagonal's normals have a mean of n_z^2 of 1/3: it gains more in the plane than along z.
    assert both.junction_diameter > wide.junction_diameter > tall.junction_diameter


REFUSED = {
    "struts": (
        {"lattice": Envelope(junction_diameter_mm=0.5)},
        (-0.25, -0.25),
        "leave no material of struts",
    ),
    "walls": ({"chambers": Chambers(wall_mm=0.4)}, (-0.2, -0.2), "leave no material of walls of 0.4 mm"),
    "one way": ({"chambers": Chambers(wall_mm=0.4)}, (0.0, -0.2), "leave no material of walls of 0.4 mm"),
    "cells": ({"lattice": Envelope(midspan_diameter_mm=8.0)}, (0.45, 0.45), "fill the cell: struts of 8 mm"),
    "inlet": ({"chambers": Chambers(inlet_diameter_mm=0.8)}, (0.4, 0.0), "close the inlet of 0.8 mm"),
    "wells": ({"waveguide": Waveguide(well_width_mm=0.8)}, (0.0, 0.45), "close wells of 0.8 mm"),
    "necks": ({"chambers": Chambers(bladder_share=0.9), "scale": 0.75}, (0.49, 0.49), "leave no necks"),
    "bore": (
        {
            "chambers": Chambers(
                bladder_share=0.9,
                neck_diameter_mm=2.4,
                wall_mm=0.9,
                inlet_diameter_mm=0.5,
                inlet_wall_mm=0.4,
            )
        },
        (0.2, 0.3),
        "close the necks",
    ),
    "apices": ({"chambers": Chambers(wall_mm=1.7)}, (0.4, 0.4), "fold the cavity at the apices"),
    "caps": ({"chambers": Chambers(tip_cap_mm=6.0)}, (0.2, 0.2), "fill an end chamber"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_offsets_that_erase_fill_or_close_are_named(case):
    change, offsets, what = REFUSED[case]
    Unit(**change)
    with pytest.raises(InputError) as caught:
        Unit(print=Printing(*offsets), **change)
    assert what in caught.value.what
    assert "when printed)" in caught.value.what
    assert caught.value.where == "[print] offset_xy_mm, offset_z_mm"
    # What is offered fits, and a tenth more does not.
    words = caught.value.remedy.split()
    fits = [float(words[k]) for k in (2, 6)]
    Unit(print=Printing(*fits), **change)
    more = [1.1 * fit for fit in fits]
    with pytest.raises(InputError, match="when printed"):
        Unit(print=Printing(*more), **change)


def test_a_skin_stiffens_by_its_share_of_the_wall():
    assert skin_stiffening(1.0, 0.0, 3.0) == 1.0
    assert skin_stiffening(1.0, 0.25, 3.0) == pytest.approx(2.0)
    assert skin_stiffening(1.0, 0.7, 3.0) == pytest.approx(3.0)
    assert skin_stiffening(1.0, 0.3, 1.0) == 1.0


def test_a_units_membrane_is_as_stiff_as_its_skin_makes_it():
    """0.9 mm of wall with skins of 0.09 mm, twice as stiff: 1.2; less if printed 0.1 mm thicker all over."""
    tets = np.tile(np.arange(10), (2, 1))
    elements = SimpleNamespace(
        nodes=np.zeros((10, 3)), tets=tets, region=np.array([MEMBRANE, LATTICE]), order=2
    )

    def stiffness(unit):
        (layer,) = materials_of(unit, elements).layers
        return layer.parameters[0, 0]

    bare = load_preset("mu-1.0x")
    skinned = printed(bare, skin_depth_mm=0.09, skin_factor=2.0)
    assert stiffness(skinned) / stiffness(bare) == pytest.approx(1.2)
    thicker = printed(bare, 0.1, 0.1, skin_depth_mm=0.09, skin_factor=2.0)
    assert stiffness(thicker) / stiffness(bare) == pytest.approx(1 + 0.18 / 1.1)
