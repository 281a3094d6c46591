"""The solver against closed forms and against its own derivatives."""

import attrs
import numpy as np
import pytest

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.factor import Cholesky, IndefiniteError, SuperLU
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import SELF_CONTACT_NEWTON

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


def test_cavity_volume_of_the_undeformed_sphere():
    mesh = bodies.sphere_octant(10, 12, 4)
    model = Model(mesh)
    exact = 4 / 3 * np.pi * 10**3 / 8
    assert model.cavity_volume(np.zeros_like(mesh.nodes)) == pytest.approx(exact, rel=1e-3)


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
