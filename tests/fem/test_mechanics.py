"""The solver against closed forms and against its own derivatives."""

import attrs
import numpy as np
import pytest
from scipy.optimize import brentq

from mu_addon.errors import ConvergenceError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.factor import Cholesky, IndefiniteError, SuperLU
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import SELF_CONTACT_NEWTON, NewtonSettings
from mu_addon.fem.state import rest

from . import bodies
from .bodies import uniform
from .derivatives import assert_derivatives

E, NU = 0.6, 0.4


def unconstrained(mesh):
    """Model and parameters for a body whose unknowns the test prescribes itself."""
    model = Model(mesh)
    return model, model.parameters(uniform(mesh, E, NU))


@pytest.mark.parametrize("order", [1, 2])
def test_patch(order):
    """An affine boundary displacement on a distorted patch is reproduced inside to 1e-10."""
    mesh = bodies.box((3, 3, 3), order=order, jiggle=0.25)
    model, m = unconstrained(mesh)
    F = np.array([[1.1, 0.05, -0.02], [0.03, 0.93, 0.08], [-0.04, 0.02, 1.06]])
    exact = mesh.nodes @ (F - np.eye(3)).T
    boundary = ((mesh.nodes < 1e-9) | (mesh.nodes > 1 - 1e-9)).any(axis=1)
    inside = np.nonzero(~np.repeat(boundary, 3))[0]
    u = np.where(boundary[:, None], exact, 0.0)
    for _ in range(8):
        K = model.matrix(model.tangent(u, 0.0, m)).tocsc()[inside][:, inside]
        u.ravel()[inside] -= np.linalg.solve(K.toarray(), model.residual(u, 0.0, m).ravel()[inside])
    assert np.abs(u - exact).max() < 1e-10


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("pressure", [0.0, 0.03])
def test_force_and_tangent_are_derivatives_of_the_potential(order, pressure):
    mesh = bodies.hollow_box(order, clamp=False)
    model, m = unconstrained(mesh)
    u, d = 0.03 * np.random.default_rng(1).standard_normal((2, *mesh.nodes.shape))
    assert_derivatives(model, m, u, d, pressure)


def test_pressure_stiffness_of_a_closed_cavity_is_symmetric_as_it_is():
    """The symmetrised face blocks add up to the true derivative, so nothing was thrown away."""
    mesh = bodies.hollow_box(2, clamp=False)
    model, m = unconstrained(mesh)
    n = mesh.nodes.size
    u = 0.02 * np.random.default_rng(2).standard_normal(mesh.nodes.shape)
    with_p = model.matrix(model.tangent(u, 1.0, m)) - model.matrix(model.tangent(u, 0.0, m))
    columns = np.random.default_rng(3).choice(n, 12, replace=False)
    for c in columns:
        d = np.zeros(n)
        d[c] = 1e-3
        d = d.reshape(-1, 3)
        force = (model.residual(u + d, 1.0, m) - model.residual(u + d, 0.0, m)) - (
            model.residual(u - d, 1.0, m) - model.residual(u - d, 0.0, m)
        )
        np.testing.assert_allclose(force.ravel() / 2e-3, with_p[:, [c]].toarray().ravel(), atol=1e-8)


def test_uniaxial_tension_matches_its_closed_form():
    """Stretch a bar by 60 %: P = mu J^(-2/3) (lambda - I1/(3 lambda)) + kappa (J - 1) J / lambda."""
    mesh = bodies.box((2, 2, 2), order=2, symmetry=("x", "y", "z"))
    model, m = unconstrained(mesh)
    top = np.nonzero(mesh.nodes[:, 2] == 1)[0]
    mu, kappa = E / (2 * (1 + NU)), E / (3 * (1 - 2 * NU))
    number = np.full(mesh.nodes.size, -1)
    number[model.free] = np.arange(len(model.free))
    pulled = number[3 * top + 2]
    rest_of = np.setdiff1d(np.arange(len(model.free)), pulled)
    u = np.zeros_like(mesh.nodes)
    for stretch in np.linspace(1, 1.6, 7)[1:]:
        u[:, 2] = mesh.nodes[:, 2] * (stretch - 1)
        for _ in range(12):
            K = model.matrix(model.tangent(u, 0.0, m)).tocsc()[rest_of][:, rest_of]
            force = model.residual(u, 0.0, m).ravel()[model.free][rest_of]
            u.ravel()[model.free[rest_of]] -= np.linalg.solve(K.toarray(), force)

    def stresses(side):
        J, I1 = stretch * side**2, stretch**2 + 2 * side**2
        c = mu * J ** (-2 / 3)
        along = c * (stretch - I1 / (3 * stretch)) + kappa * (J - 1) * J / stretch
        across = c * (side - I1 / (3 * side)) + kappa * (J - 1) * J / side
        return along, across

    side = brentq(lambda s: stresses(s)[1], 0.5, 1.0, xtol=1e-14)
    force = model.residual(u, 0.0, m)[top, 2].sum()
    assert force == pytest.approx(stresses(side)[0], rel=1e-9)
    np.testing.assert_allclose(u[:, 0], mesh.nodes[:, 0] * (side - 1), atol=1e-9)


def pressurise(mesh, pressure, modulus, poisson, **options):
    model = Model(mesh)
    equilibrium = Equilibrium(model, uniform(mesh, modulus, poisson), NewtonSettings(**options))
    return model, equilibrium.path([pressure], rest(mesh))[-1]


def test_cavity_volume_of_the_undeformed_sphere():
    mesh = bodies.sphere_octant(10, 12, 4)
    model = Model(mesh)
    exact = 4 / 3 * np.pi * 10**3 / 8
    assert model.cavity_volume(np.zeros_like(mesh.nodes)) == pytest.approx(exact, rel=1e-3)


def test_a_balloon_past_its_limit_is_refused_by_name():
    mesh = bodies.sphere_octant(10, 11, 3)
    with pytest.raises(ConvergenceError, match="limit point") as caught:
        pressurise(mesh, 1.0, 2.0, 0.45, max_step_MPa=0.05, min_step_MPa=1e-3)
    assert "kPa" in str(caught.value)
    assert "mm" in caught.value.where


def test_vacuum_and_pressure_move_apart():
    mesh = bodies.hollow_box(2)
    _, blown = pressurise(mesh, 0.01, E, NU)
    model, sucked = pressurise(mesh, -0.01, E, NU)
    none = model.cavity_volume(np.zeros_like(mesh.nodes))
    assert model.cavity_volume(sucked.u) < none < model.cavity_volume(blown.u)


def test_both_factorisations_agree_and_see_indefiniteness():
    mesh = bodies.hollow_box(2)
    model = Model(mesh)
    m = model.parameters(uniform(mesh, E, NU))
    values = model.tangent(np.zeros_like(mesh.nodes), 0.0, m)
    pattern = model.pattern
    b = np.random.default_rng(0).standard_normal((len(model.free), 3))
    solutions = []
    for kind in (Cholesky, SuperLU):
        factor = kind(pattern.indptr, pattern.indices, pattern.order)
        solutions.append(factor.factor(values).solve(b))
        np.testing.assert_allclose(factor.solve(b[:, 0]), solutions[-1][:, 0], rtol=1e-9)
        broken = values.copy()
        broken[pattern.indptr[:-1]] *= -1
        with pytest.raises(IndefiniteError):
            factor.factor(broken)
    np.testing.assert_allclose(*solutions, rtol=1e-9)
    np.testing.assert_allclose(model.matrix(values) @ solutions[0], b, atol=1e-9)


def test_the_factor_of_an_indefinite_tangent_serves_several_steps():
    """A column compressed to five times its buckling load springs back to rest."""
    mesh = bodies.box((1, 1, 12), (1.0, 1.0, 12.0), clamp=True)
    share = mesh.nodes[:, 2] / 12.0
    start = np.zeros_like(mesh.nodes)
    start[:, 2] = -0.01 * mesh.nodes[:, 2]
    start[:, 0] = 0.36 * share**2 * (1.0 - 0.3 * share)
    found = []
    for steps in (1, SELF_CONTACT_NEWTON.indefinite_steps):
        settings = attrs.evolve(SELF_CONTACT_NEWTON, indefinite_steps=steps)
        equilibrium = Equilibrium(Model(mesh, threads=1), uniform(mesh, E, 0.3), settings)
        found.append(equilibrium.newton(start, 0.0))
        assert np.abs(found[-1].u).max() < 1e-9
    assert 4 * found[1].factorisations < found[0].factorisations
