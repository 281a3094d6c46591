"""The solver against answers that are published or known in closed form."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import erf

from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.laws import OgdenRoxburgh, Prony, Yeoh
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings

from . import bodies, cases, thick
from .radial import incompressible_pressure, inner_stretch

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
    ("turns", "pressure", "stretch"),
    [(2, thick.sphere_pressure(1.3), 1.3), (1, thick.tube_pressure(1.3), 1.3)],
)
def test_radial_equation_tends_to_the_incompressible_closed_form(turns, pressure, stretch):
    off = [inner_stretch(pressure, 10, 12, 1.0, kappa, turns) - stretch for kappa in (1e2, 1e3)]
    assert 0 < off[1] < 2e-3
    assert off[0] / off[1] == pytest.approx(10, rel=0.1)


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


YEOH = (0.3, -0.02, 0.004)


def yeoh(stretch):
    """Energy of the Yeoh law at an incompressible equibiaxial stretch, and its derivative."""
    x, slope = 2 * stretch**2 + stretch**-4 - 3, 4 * stretch - 4 * stretch**-5
    c1, c2, c3 = YEOH
    return c1 * x + c2 * x**2 + c3 * x**3, (c1 + 2 * c2 * x + 3 * c3 * x**2) * slope


def test_a_sphere_under_falling_pressure_relaxes_in_place():
    """Under p (1 + sum of beta e^(-t/tau)) incompressible walls stay where p alone holds their Yeoh law."""
    beta, tau = np.array([0.5, 0.3]), np.array([1.0, 10.0])
    pressure = incompressible_pressure(1.15, 1.15, 10, 12, lambda now, _: yeoh(now)[1])
    time = np.array([0.0, 0.0, 0.5, 2.0, 8.0, 40.0])
    held = pressure * (1 + (beta * np.exp(-time[:, None] / tau)).sum(axis=1)) * (np.arange(6) > 0)
    drift = []
    for kappa in (200.0, 2000.0):
        row = (*YEOH, kappa, beta[0], tau[0], beta[1], tau[1], 0.0, 1.0)
        elastic = thick.sphere_in_time((*YEOH, kappa), Yeoh, [0.0, 1.0], [0.0, pressure])[-1]
        found = thick.sphere_in_time(row, Prony, time, held)[1:]
        drift.append(np.abs(found / elastic - 1).max())
    # What compressibility alone leaves: volume change does not relax.
    assert drift[1] < 5e-4
    assert drift[1] < 0.12 * drift[0]


def test_a_softened_sphere_comes_back_along_its_closed_form():
    """Blown up to 1.25, let down to 1.1, blown up beyond: eta = 1 - erf((W_m - W)/(m + beta W_m))/r."""
    r, m, beta = 1.6, 0.02, 0.1

    def slope(now, largest):
        (energy, rise), (most, _) = yeoh(now), yeoh(largest)
        return rise * (1 - erf((most - energy) / (m + beta * most)) / r)

    course = [(1.0, 1.0), (1.25, 1.25), (1.1, 1.25), (1.2, 1.25), (1.3, 1.3)]
    pressure = [incompressible_pressure(now, largest, 10, 12, slope) for now, largest in course]
    virgin = incompressible_pressure(1.1, 1.1, 10, 12, slope)
    assert pressure[2] < 0.9 * virgin
    found = thick.sphere_in_time((*YEOH, 600.0, r, m, beta), OgdenRoxburgh, np.arange(5.0), pressure)
    np.testing.assert_allclose(found / 10, [now - 1 for now, _ in course], rtol=5e-3, atol=1e-9)
