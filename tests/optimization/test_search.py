"""The search on functions whose best designs are known: one goal, a front, discrete values, what cannot be
met."""

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import Unit
from mu_addon.optimization.freedoms import Freedom, changed_unit
from mu_addon.optimization.search import Observed, SearchSettings
from mu_addon.optimization.targets import Target
from mu_addon.optimization.uncertainty import Uncertainty

from .bodies import search_units


@attrs.frozen
class Named:
    name: str
    conditions: tuple = ()


def target(name, **asked):
    asked.setdefault("tolerance", 0.01)
    return Target(name, "angle", "", Named(name), **asked)


def observer(functions, freedoms, fails=lambda design: False):
    """Observes functions of a design, with slopes by central differences; counts in `calls`."""
    calls = []

    def value(design):
        return np.array([f(*design) for f in functions])

    def one(design):
        calls.append(design)
        slopes = []
        for i, freedom in enumerate(freedoms):
            if freedom.discrete:
                continue
            ends = [tuple(v + s * 1e-5 if j == i else v for j, v in enumerate(design)) for s in (1, -1)]
            slopes.append((value(ends[0]) - value(ends[1])) / 2e-5)
        failed = fails(design)
        gradient = np.array(slopes).T.reshape(len(functions), -1)
        return Observed(design, value(design) * (np.nan if failed else 1), gradient, not failed)

    return calls, lambda designs: [one(d) for d in designs]


TWO = [Freedom("a", 0.0, 2.0), Freedom("b", 0.0, 2.0)]


def best(found):
    [number] = found.proposed
    return found.observed[number]


def test_a_target_is_reached_in_few_steps():
    calls, observe = observer([lambda a, b: np.exp(a) * (1 + b * b)], TWO)
    found = search_units(TWO, [target("t", value=6.0, tolerance=0.05)], observe, (0.5, 0.2))
    assert found.feasible
    assert best(found).values[0] == pytest.approx(6.0, abs=0.05)
    assert len(calls) <= 8


def test_a_bound_objective_pair_has_its_closed_form():
    """The least a + 2 b with a b >= 0.5: a = 1, b = 0.5."""
    _, observe = observer([lambda a, b: a * b, lambda a, b: a + 2 * b], TWO)
    asked = [target("area", low=0.5, tolerance=0.002), target("cost", goal="minimise")]
    found = search_units(TWO, asked, observe, (1.8, 1.8), SearchSettings(30))
    assert found.feasible
    assert best(found).values[1] == pytest.approx(2.0, rel=0.01)
    np.testing.assert_allclose(best(found).design, (1.0, 0.5), rtol=0.1)


def test_the_front_of_two_goals_is_found_along_its_length():
    """Distances to (0, 0) and to (2, 0): the front is b = 0, and the sum of the roots is 2 on it."""
    functions = [lambda a, b: a * a + b * b, lambda a, b: (a - 2) ** 2 + b * b]
    _, observe = observer(functions, TWO)
    asked = [target("near", goal="minimise"), target("far", goal="minimise")]
    found = search_units(TWO, asked, observe, (0.7, 1.5), SearchSettings(24))
    values = np.array([found.observed[i].values for i in found.proposed])
    assert len(values) >= 6
    good = values[np.sqrt(values).sum(axis=1) < 2.06]
    assert len(good) >= 5
    assert np.ptp(np.sqrt(good[:, 0])) > 1.5


def test_the_value_of_a_discrete_freedom_is_chosen_too():
    free = [
        Freedom("a", 0.0, 2.0),
        Freedom("kind", values=("x", "y", "z")),
        Freedom("n", values=(1, 2, 3, 4)),
    ]
    bonus = {"x": 0.0, "y": 1.0, "z": 0.4}
    _, observe = observer([lambda a, kind, n: bonus[kind] - (a - 1.2) ** 2 - (n - 3) ** 2], free)
    found = search_units(free, [target("t", goal="maximise")], observe, (0.1, "x", 1), SearchSettings(30))
    assert best(found).values[0] == pytest.approx(1.0, abs=0.01)


def test_what_stands_in_the_way_is_named():
    """a <= 0.5 and a + b >= 3 cannot both be with b <= 2; the third is not an obstacle."""
    functions = [lambda a, b: a, lambda a, b: a + b, lambda a, b: b]
    _, observe = observer(functions, TWO)
    asked = [
        target("thin", high=0.5, tolerance=0.05),
        target("sum", low=3.0, tolerance=0.05),
        target("b", low=0.1),
    ]
    found = search_units(TWO, asked, observe, (1.0, 1.0), SearchSettings(20))
    assert not found.feasible
    assert set(found.in_the_way) == {"thin", "sum"}
    # The nearest: half of the gap of 0.5 each, in equal tolerances.
    np.testing.assert_allclose(best(found).design, (0.75, 2.0), atol=0.05)


def test_designs_that_fail_are_left_alone():
    calls, observe = observer([lambda a, b: a + b], TWO, fails=lambda d: d[0] + d[1] > 2.0)
    found = search_units(TWO, [target("t", goal="maximise")], observe, (0.2, 0.2), SearchSettings(30))
    assert best(found).sound
    assert best(found).values[0] > 1.8
    assert any(sum(d) > 2.0 for d in calls)


def test_the_same_seed_gives_the_same_designs():
    runs = []
    for _ in range(2):
        _, observe = observer([lambda a, b: a * b, lambda a, b: a - b], TWO)
        asked = [target("p", goal="minimise"), target("m", goal="maximise")]
        found = search_units(TWO, asked, observe, (1.0, 1.0), SearchSettings(10, seed=5))
        runs.append([o.design for o in found.observed])
    assert runs[0] == runs[1]


def test_without_a_sound_design_the_search_ends_with_its_budget():
    _, observe = observer([lambda a, b: a], TWO, fails=lambda d: True)
    found = search_units(TWO, [target("t", low=1.0)], observe, (1.0, 1.0), SearchSettings(5))
    assert not found.feasible
    assert len(found.observed) == 5


def test_a_margin_keeps_a_design_that_far_inside_its_bounds():
    """At least 1.2 and at most 1.8 of a, with a margin that grows with b: the largest b, or none."""
    _, plain = observer([lambda a, b: a, lambda a, b: b], TWO)

    def with_margin(size):
        def observe(designs):
            return [
                attrs.evolve(o, margins=np.array([size * (1 + o.design[1]), 0.0])) for o in plain(designs)
            ]

        return observe

    asked = [target("between", low=1.2, high=1.8), target("small", goal="maximise")]
    found = search_units(TWO, asked, with_margin(0.15), (0.1, 0.5), SearchSettings(30))
    # 0.15 (1 + b) is half the gap, 0.3, at b = 1.
    assert found.feasible
    assert best(found).values == pytest.approx([1.5, 1.0], abs=0.02)
    found = search_units(TWO, asked, with_margin(0.35), (0.1, 0.5), SearchSettings(30))
    assert not found.feasible
    assert best(found).design[0] == pytest.approx(1.5, abs=0.05)


def test_a_print_scatters_every_surface_alike():
    by_print, _ = Uncertainty(0.05, 0.1).freedoms(Unit())
    moved = changed_unit(Unit(), [by_print], [0.1]).print
    assert (moved.offset_xy_mm, moved.offset_z_mm) == (0.1, 0.1)
