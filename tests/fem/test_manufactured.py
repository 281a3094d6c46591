"""Order of convergence to a smooth displacement that a known body force holds."""

import numpy as np
import pytest

from .manufactured import SHEARS, WAVES, errors, fine_rule, solve


@pytest.mark.parametrize("field", [WAVES, SHEARS], ids=["compressible", "nearly incompressible"])
def test_body_force_balances_the_stress(field):
    """Over a cube the body force and the stress on the faces add up to nothing."""
    g, w = np.polynomial.legendre.leggauss(16)
    g, w = (g + 1) / 2, w / 2
    X = np.stack(np.meshgrid(g, g, g, indexing="ij"), axis=-1)
    force = np.einsum("ijkc,i,j,k->c", field.body_force(X), w, w, w)
    total = force.copy()
    for axis in range(3):
        for side, sign in ((1.0, 1.0), (0.0, -1.0)):
            face = np.insert(np.stack(np.meshgrid(g, g, indexing="ij"), axis=-1), axis, side, axis=-1)
            total += sign * np.einsum("ijc,i,j->c", field.stress(face)[..., axis], w, w)
    assert np.abs(force).max() > 0.01
    np.testing.assert_allclose(total, 0, atol=1e-10)


def test_the_nearly_incompressible_field_keeps_its_volume_under_a_pressure_like_its_shear_modulus():
    X = np.random.default_rng(0).uniform(size=(50, 3))
    J = np.linalg.det(np.eye(3) + SHEARS.gradient(X))
    kappa = SHEARS.modulus / (3 * (1 - 2 * SHEARS.poisson))
    mu = SHEARS.modulus / (2 * (1 + SHEARS.poisson))
    assert np.abs(J - 1).max() < 1e-3
    assert 0.5 * mu < kappa * np.abs(J - 1).max() < 5 * mu


def test_fine_rule_is_exact_to_its_degree():
    points, weights = fine_rule(4)
    assert weights.sum() == pytest.approx(1 / 6, rel=1e-14)
    # The integral of x^2 y^2 z over the unit tetrahedron is 2! 2! 1! / 8!.
    _, x, y, z = points.T
    assert (weights * x**2 * y**2 * z).sum() == pytest.approx(4 / 40320, rel=1e-13)


@pytest.mark.parametrize("order", [1, 2])
def test_displacement_converges_one_order_faster_than_its_gradient(order):
    """L2 error of order 2 and 3, H1 error of order 1 and 2, and both as small as interpolation makes them."""
    found = []
    for n in (3, 6):
        mesh, u = solve(n, order)
        found.append(errors(mesh, u))
        nearest = errors(mesh, WAVES.displacement(mesh.nodes))
        assert found[-1][0] < 1.1 * nearest[0]
        assert found[-1][1] < 1.02 * nearest[1]
    rates = np.log2(np.array(found[0]) / found[1])
    np.testing.assert_allclose(rates, [order + 1, order], atol=0.15)


def test_near_incompressibility_slows_quadratic_elements_but_does_not_lock_them():
    found = [errors(*solve(n, 2, SHEARS), SHEARS) for n in (2, 4)]
    assert (np.log2(np.array(found[0]) / found[1]) > [1.6, 1.2]).all()
    assert found[1][0] < 4e-5
