"""Stress at the nodes against closed forms: uniform states exactly, a thick sphere under pressure nearly."""

import attrs
import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.laws import NeoHooke, OgdenRoxburgh
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings
from mu_addon.fem.state import rest
from mu_addon.fem.stress import NodalMean, cauchy, peak_stretch, von_mises

from . import bodies, thick


@pytest.mark.parametrize("order", [1, 2])
def test_uniaxial_stress_is_exact_and_uniform(order):
    mesh = bodies.box((2, 2, 2), (1.0, 2.0, 1.5), order=order, jiggle=0.1)
    mu, kappa, F = 0.4, 2.0, np.diag([0.9, 0.9, 1.3])
    sigma, found = cauchy(mesh, mesh.nodes @ (F - np.eye(3)).T, bodies.everywhere(mesh, NeoHooke, mu, kappa))
    assert np.allclose(found, F)
    # sigma = mu J^(-5/3) dev(b) + kappa (J - 1) 1, of W = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2.
    J, b = np.linalg.det(F), F @ F.T
    expected = mu * J ** (-5 / 3) * (b - np.trace(b) / 3 * np.eye(3)) + kappa * (J - 1) * np.eye(3)
    assert np.allclose(sigma, expected)
    mean = NodalMean(mesh, np.arange(len(mesh.tets)))
    at_nodes = von_mises(mean(sigma))
    assert np.array_equal(mean.nodes, np.arange(len(mesh.nodes)))
    # Under two equal stresses it is the difference to the third.
    assert np.allclose(at_nodes, expected[2, 2] - expected[0, 0])


def test_a_linear_field_goes_on_to_the_nodes_of_quadratic_elements():
    mesh = bodies.box((2, 1, 2), (1.0, 1.0, 1.0))
    # The field z at the quadrature points: F = 1 + z e_z e_z comes from u_z = z^2 / 2.
    u = np.zeros_like(mesh.nodes)
    u[:, 2] = mesh.nodes[:, 2] ** 2 / 2
    _, F = cauchy(mesh, u, bodies.uniform(mesh, 1.0, 0.3))
    some = np.flatnonzero(mesh.nodes[mesh.corners].mean(axis=1)[:, 0] < 0.5)
    mean = NodalMean(mesh, some)
    assert len(mean.nodes) < len(mesh.nodes)
    assert np.allclose(mean(F[..., 2, 2]), 1 + mesh.nodes[mean.nodes, 2])


def test_a_thick_sphere_under_pressure():
    """At the inner surface the radial stress is -p, and von Mises' mu (a^2 - a^-4), a = 1.1 the stretch."""
    errors = []
    for around in (4, 6):
        mesh = bodies.sphere_octant(thick.INNER, thick.OUTER, around, through=around // 3, order=2)
        pressure, poisson = thick.sphere_pressure(), 0.499
        materials = bodies.uniform(mesh, 2 * (1 + poisson), poisson)
        found = Equilibrium(Model(mesh), materials, NewtonSettings(max_step_MPa=0.05))
        u = found.path([pressure], rest(mesh))[-1].u
        sigma, _ = cauchy(mesh, u, materials)
        mean = NodalMean(mesh, np.arange(len(mesh.tets)))
        inside = np.searchsorted(mean.nodes, np.unique(mesh.cavity))
        at_nodes = mean(sigma)[inside]
        radial = np.linalg.eigvalsh(at_nodes)[:, 0].mean()
        mises = von_mises(at_nodes).mean()
        errors.append((radial / -pressure - 1, mises / (1.1**2 - 1.1**-4) - 1))
    coarse, fine = np.abs(errors)
    assert (fine < coarse).all()
    assert fine[1] < 0.02


def test_a_law_with_history_is_refused():
    mesh = bodies.box((1, 1, 1))
    materials = bodies.everywhere(mesh, OgdenRoxburgh, *np.ones(len(OgdenRoxburgh.parameter_names)))
    with pytest.raises(InputError, match="how the state was reached"):
        cauchy(mesh, np.zeros_like(mesh.nodes), materials)


def test_the_peak_stretch_is_told_with_its_place_and_without_what_is_cut_away():
    mesh = bodies.box((4, 1, 4), (1.0, 1.0, 4.0))
    u = np.zeros_like(mesh.nodes)
    u[:, 2] = 0.05 * mesh.nodes[:, 2] ** 2
    found = peak_stretch(mesh, u, mesh.region[0])
    z = found.place_mm[2]
    assert z > 3.7
    assert found.largest == pytest.approx(1 + 0.1 * z)
    # A hundredth of the volume is the uppermost 0.04 mm, less than between two points.
    assert found.largest - 0.02 < found.exceeded <= found.largest
    low = mesh.nodes[mesh.corners].mean(axis=1)[:, 2] < 2.0
    cut = attrs.evolve(mesh, filled=np.where(low[:, None], 1.0, 0.3) * np.ones((1, 4)))
    left = peak_stretch(cut, u, mesh.region[0])
    assert left.place_mm[2] < 2.0
    assert left.largest == pytest.approx(1 + 0.1 * left.place_mm[2])
