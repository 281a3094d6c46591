"""The mean of an element's volume change: its derivatives, and the locking it eases."""

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.fem.dead_loads import gravity, traction
from mu_addon.fem.laws import Foam, NeoHooke
from mu_addon.fem.materials import Layer, Materials
from mu_addon.fem.model import Model
from mu_addon.fem.state import rest

from . import bodies
from .bodies import uniform
from .derivatives import assert_derivatives

E, NU = 0.6, 0.49


@pytest.mark.parametrize("order", [1, 2])
def test_force_and_tangent_are_derivatives_of_the_potential(order):
    mesh = bodies.hollow_box(order, clamp=False)
    model = Model(mesh, mean_dilatation=True)
    materials = uniform(mesh, E, NU).blended(np.linspace(0, 0.5, len(mesh.tets)), NeoHooke, [0.1, 3.0])
    u, d = 0.03 * np.random.default_rng(1).standard_normal((2, *mesh.nodes.shape))
    assert_derivatives(model, model.parameters(materials), u, d, 0.03)


@pytest.mark.parametrize(
    ("order", "poisson"),
    [(1, NU), (2, 0.4)],
    ids=["one volume in a linear element", "bulk modulus up to 5 shear moduli"],
)
def test_where_the_mean_changes_nothing(order, poisson):
    """A linear element has one volume anyway; compressible bodies, to nu = 0.406, keep their own."""
    mesh = bodies.hollow_box(order, n=3)
    u = 0.03 * np.random.default_rng(2).standard_normal(mesh.nodes.shape)
    forces = []
    for mean in (False, True):
        model = Model(mesh, mean_dilatation=mean)
        forces.append(model.residual(u, 0.0, model.parameters(uniform(mesh, E, poisson))))
    np.testing.assert_allclose(*forces, atol=1e-14)


def test_a_law_without_a_volumetric_part_is_refused():
    mesh = bodies.box((1, 1, 1))
    row = Foam.parameters(0.02, 0.1, 3.0, 8.0)
    foam = Materials((Layer(Foam, np.arange(6), np.repeat(row, 6, axis=0)),))
    with pytest.raises(InputError, match="no volumetric part"):
        Model(mesh, mean_dilatation=True).parameters(foam)


def linearised(mesh, held, load, poisson, mean):
    """Displacement (n, 3) of the linearised body with E = 1 MPa under nodal forces."""
    model = Model(mesh, supports=held, mean_dilatation=mean)
    u = rest(mesh).u
    model.factor.factor(model.tangent(u, 0.0, model.parameters(uniform(mesh, 1.0, poisson))))
    u.ravel()[model.free] = model.factor.solve(load.ravel()[model.free])
    return u


def strip(poisson, mean, counts=(1, 1, 20)):
    """Sag of a strip's end under its weight in plane strain, over bending and shear of a plate, less 1."""
    length, thickness = 20.0, 1.0
    mesh = bodies.box(counts, (1.0, thickness, length), clamp=True)
    held = np.zeros(mesh.nodes.shape, bool)
    held[:, 0] = True
    load = gravity(mesh, 1.0, [0, -1, 0], g_mm_per_s2=1.0)
    u = linearised(mesh, held, load, poisson, mean)
    bending = length**4 * (1 - poisson**2) / (8 * thickness**2 / 12)
    shear = length**2 * (1 + poisson) / (5 / 6)
    return -u[mesh.nodes[:, 2] == length, 1].mean() / (bending + shear) - 1


@pytest.mark.parametrize("poisson", [0.45, 0.49, 0.4999])
def test_a_wall_one_element_thick_bends_about_as_it_should(poisson):
    """Within 5 % at any Poisson's ratio, where points of their own lock by 5 to 11 %."""
    assert abs(strip(poisson, mean=True)) < 0.05
    assert strip(poisson, mean=False) < -0.045


def cook(poisson, mean, n=8):
    """Rise of the corner of Cook's panel in plane strain, linearised, E = 1 MPa, in mm."""
    mesh = bodies.cook(n)
    held = np.zeros(mesh.nodes.shape, bool)
    held[:, 2] = True
    u = linearised(mesh, held, traction(mesh, mesh.cavity, [0.0, 1 / 60, 0.0]), poisson, mean)
    return u[(np.abs(mesh.nodes[:, :2] - [48, 60]) < 1e-9).all(axis=1), 1].mean()


def test_a_thick_nearly_incompressible_panel_loses_a_third_of_what_it_lost():
    """Against 5.183, extrapolated from 16 and 24 cells a side with all of kappa on the mean."""
    known = 5.183
    assert cook(0.4999, mean=False) / known - 1 == pytest.approx(-0.083, abs=0.005)
    assert cook(0.4999, mean=True) / known - 1 == pytest.approx(-0.029, abs=0.005)
