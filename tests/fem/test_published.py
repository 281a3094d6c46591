"""The solver against answers that are published or known in closed form."""

import numpy as np
import pytest
from scipy.optimize import brentq

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings

from . import bodies, cases

MU, KAPPA = 1.0, 4.0
E, NU = 9 * KAPPA * MU / (3 * KAPPA + MU), (3 * KAPPA - 2 * MU) / (6 * KAPPA + 2 * MU)
KNOWN = cases.cases()


def deformed(F, held, order):
    """Mean first Piola-Kirchhoff stress and displacement of a distorted unit cube pulled by F at `held`."""
    mesh = bodies.box((2, 2, 2), order=order, jiggle=0.2)
    model = Model(mesh, supports=held(mesh.nodes))
    equilibrium = Equilibrium(model, bodies.uniform(mesh, E, NU), NewtonSettings(tolerance=1e-12))
    u = mesh.nodes @ (F - np.eye(3)).T
    # A start that is wrong inside: the solution must find its way back to homogeneity.
    noise = 0.005 * np.random.default_rng(0).standard_normal(u.shape)
    u.ravel()[model.free] += noise.ravel()[model.free]
    u = equilibrium.newton(u, 0.0).u
    reaction = model.residual(u, 0.0, equilibrium.parameters)
    # Of a body in equilibrium, the integral of P is the sum of force times place.
    return reaction.T @ mesh.nodes, u, mesh


def principal(stretches):
    """Nominal principal stresses of the neo-Hookean law."""
    s = np.asarray(stretches)
    J = s.prod()
    return (MU * J ** (-2 / 3) * (s * s - (s * s).sum() / 3) + KAPPA * (J - 1) * J) / s


@pytest.mark.parametrize("order", [1, 2])
def test_equibiaxial_tension(order):
    stretch = 1.3
    thin = brentq(lambda t: principal([stretch, stretch, t])[2], 0.3, 1.0, xtol=1e-15)

    def held(X):
        sides = (X == 0) | (X == 1)
        sides[:, 2] = X[:, 2] == 0
        return sides

    P, u, mesh = deformed(np.diag([stretch, stretch, thin]), held, order)
    expected = np.diag(principal([stretch, stretch, thin]))
    np.testing.assert_allclose(P, expected, atol=1e-10)
    np.testing.assert_allclose(u, mesh.nodes * [stretch - 1, stretch - 1, thin - 1], atol=1e-10)


@pytest.mark.parametrize("order", [1, 2])
def test_simple_shear(order):
    """P = mu (F - I1/3 F^-T): beside the shear stress a normal one of -mu g^2/3 (Poynting)."""
    g = 0.5

    def held(X):
        return np.repeat(((X == 0) | (X == 1)).any(axis=1)[:, None], 3, axis=1)

    F = np.array([[1, 0, g], [0, 1, 0], [0, 0, 1]])
    P, _, _ = deformed(F, held, order)
    normal = -MU * g**2 / 3
    expected = [[normal, 0, MU * g], [0, normal, 0], [MU * g * (1 + g**2 / 3), 0, normal]]
    np.testing.assert_allclose(P, expected, atol=1e-10)


@pytest.mark.parametrize(
    ("name", "order", "sizes", "bound", "rate"),
    [
        ("sphere 0.45", 1, (4, 8), 0.045, 1.3),
        ("sphere 0.45", 2, (4, 8), 1e-4, 3.0),
        ("sphere 0.4999", 2, (2, 4), 0.002, None),
        ("tube 0.45", 1, (8, 16), 0.01, 1.5),
        ("tube 0.45", 2, (8, 16), 1e-5, 2.0),
        ("tube 0.4999", 2, (8, 16), 3e-5, 1.8),
        ("cook", 1, (8, 16), 0.14, 1.2),
        ("cook", 2, (8, 16), 0.008, 1.2),
        ("cook incompressible", 2, (8, 16), 0.03, 1.5),
        ("cook finite", 2, (8, 16), 0.035, 1.2),
        ("beam", 2, (2, 3), 0.017, None),
        ("ventricle inside", 2, (2, 4), 0.025, None),
        ("ventricle outside", 2, (2, 4), 0.02, None),
    ],
)
def test_known_answer(name, order, sizes, bound, rate):
    """The finer of two meshes is near the known value, and nearer than the coarser by the stated order."""
    case = KNOWN[name]
    errors = [abs(case.error(case.answer(size, order))) for size in sizes]
    assert errors[1] < bound
    if rate is not None:
        assert np.log2(errors[0] / errors[1]) > rate
