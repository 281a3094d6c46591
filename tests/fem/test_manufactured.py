"""Order of convergence to a smooth displacement that a known body force holds."""

import numpy as np
import pytest

from .manufactured import SHEARS, WAVES, errors, solve


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
