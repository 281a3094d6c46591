"""Best designs in closed form, found by finite elements, their adjoint gradients and the search."""

import numpy as np
import pytest

from mu_addon.optimization.freedoms import Freedom
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.quantities import RestStiffness
from mu_addon.optimization.search import SearchSettings
from mu_addon.optimization.structure import solve
from mu_addon.optimization.targets import Target

from .bodies import (
    LENGTH,
    MODULUS,
    AxialStiffness,
    Cantilever,
    Fold,
    GradedBlock,
    Resin,
    Volume,
    fold_stiffness,
    search_units,
)

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


@pytest.mark.slow
def test_the_least_resin_of_a_graded_block_is_where_the_moment_is():
    """A block in bending: sum(J_i/f_i) is given and sum(f_i) least where f_i grows as the root of J_i."""
    layers = 4
    ends = LENGTH - np.linspace(0, LENGTH, layers + 1)
    moment = (ends[:-1] ** 3 - ends[1:] ** 3) / 3  # the integral of the squared moment in each layer
    section = MODULUS * 2.0**4 / 12
    wanted = 1.5 * section / moment.sum()
    roots = np.sqrt(moment)
    best = roots * roots.sum() * wanted / section
    quantities = [RestStiffness("k", "y"), Resin("resin")]
    asked = [
        Target("k", "stiffness", "N/mm", quantities[0], low=wanted, tolerance=wanted * 0.01),
        Target("resin", "mass", "", quantities[1], goal="minimise"),
    ]
    calls = []
    observe = GradedBlock(layers).observe(quantities, calls)
    free = [Freedom(f"layer {n}", 0.1, 4.0) for n in range(layers)]
    found = search_units(free, asked, observe, (1.5,) * layers, SearchSettings(30))
    [number] = found.proposed
    resin = found.observed[number].values[1]
    assert found.feasible
    # An even block of that stiffness has 1.5.
    assert best.mean() < 1.3
    assert resin == pytest.approx(best.mean(), rel=0.01)
    # Near the least, where resin hardly depends on them, the factors themselves are less sharp.
    np.testing.assert_allclose(found.observed[number].design, best, rtol=0.1)


@pytest.mark.slow
def test_the_lightest_bellows_of_a_stiffness_has_the_thickness_of_plate_theory():
    folds, wanted = 6, 2e-3  # N/mm, of folds in series
    quantities = [AxialStiffness("k", "z"), Volume("v")]
    each = folds * wanted
    asked = [
        Target("k", "stiffness", "N/mm", quantities[0], low=each, tolerance=each * 0.01),
        Target("v", "mass", "mm3", quantities[1], goal="minimise"),
    ]
    free = [Freedom("t", 0.2, 1.5)]
    found = search_units(free, asked, Fold().observe(quantities, []), (0.8,), SearchSettings(10))
    [number] = found.proposed
    thickness = (each / fold_stiffness(1.0)) ** (1 / 3)
    assert found.feasible
    assert 0.25 < thickness < 0.6, "thin enough for plate theory"
    assert found.observed[number].design[0] == pytest.approx(thickness, rel=0.01)
