"""Best designs in closed form, found by finite elements, their adjoint gradients and the search."""

import numpy as np
import pytest

from mu_addon.optimization.freedoms import Freedom
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.quantities import RestStiffness
from mu_addon.optimization.search import SearchSettings, search_units
from mu_addon.optimization.structure import solve
from mu_addon.optimization.targets import Target

from .bodies import LENGTH, MODULUS, Cantilever, Volume

FREE = [Freedom("a", 1.0, 4.0), Freedom("b", 1.0, 4.0)]
WANTED = 4e-4  # N/mm


def stiffness(a, b):
    return 3 * MODULUS * a * b**3 / 12 / LENGTH**3


@pytest.mark.slow
def test_the_lightest_cantilever_of_a_stiffness_is_as_thin_as_allowed_and_as_high_as_needed():
    quantities = [RestStiffness("k", "y"), Volume("v")]
    asked = [
        Target("k", "stiffness", "N/mm", quantities[0], low=WANTED, tolerance=WANTED * 0.01),
        Target("v", "mass", "mm3", quantities[1], goal="minimise"),
    ]
    calls = []
    observe = Cantilever().observe(quantities, calls)
    found = search_units(FREE, asked, observe, (3.0, 3.0), SearchSettings(16))
    [number] = found.proposed
    a, b = found.observed[number].design
    # k = 3 E a b^3 / (12 L^3) with the least a b: a on its bound.
    height = (4 * WANTED * LENGTH**3 / MODULUS) ** (1 / 3)
    assert found.feasible
    assert a == pytest.approx(1.0, rel=0.01)
    assert b == pytest.approx(height, rel=0.01)
    assert found.observed[number].values[1] == pytest.approx(LENGTH * height, rel=0.01)
    assert len(calls) <= 16


def test_the_slopes_of_stiffness_are_those_of_the_closed_form():
    body = Cantilever()
    a, b = 1.5, 2.0
    middle = body.at(a, b)
    quantities = [RestStiffness("y", "y"), RestStiffness("x", "x"), RestStiffness("z", "z"), Volume("v")]
    states, _ = solve(middle, ())
    step = 1e-4
    pairs = [
        lambda: (body.at(a + step, b), body.at(a - step, b), 2 * step),
        lambda: (body.at(a, b + step), body.at(a, b - step), 2 * step),
    ]
    found = gradients(middle, states, quantities, pairs)
    k, across, along = stiffness(a, b), stiffness(b, a), MODULUS * a * b / LENGTH
    expected = np.array(
        [[k / a, 3 * k / b], [3 * across / a, across / b], [along / a, along / b], [b * LENGTH, a * LENGTH]]
    )
    # Slender beams leave out shear, of the order of (b/L)^2.
    np.testing.assert_allclose(found, expected, rtol=0.01)
    np.testing.assert_allclose(found[2:], expected[2:], rtol=1e-6)
