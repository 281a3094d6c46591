"""A study's candidates: what each is solved at, what is left out, and where a path leads elsewhere."""

from types import SimpleNamespace

import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points
from mu_addon.errors import ConvergenceError
from mu_addon.placement.deviation import deviation_of
from mu_addon.placement.deviation_bounds import Contest
from mu_addon.simulate_and_place import compared_pressures
from mu_addon.simulate_and_place.compared_pressures import (
    RankingSetup,
    evaluated,
    evaluated_in_time,
    followed,
    following,
    solved,
    solving,
)
from mu_addon.simulate_and_place.mechanics import Samples
from mu_addon.simulate_and_place.place_stages import Uncertainty, letting_in
from mu_addon.simulate_and_place.ranking import Ranking, mesh_change_mm

from . import made_up
from .made_up import UNIT, Waveguides

ANCHORS, STATIONS = anchor_points(UNIT), 21
PRESSURES = np.array([0.0, -10.0, 0.0, 10.0, 20.0])
GRASP = np.array([0.0, -10.0, -20.0, -10.0, 0.0, 10.0, 20.0, 10.0])


def answered(growth, answer):
    """The value of a set's growth, and all that it asked for."""
    every = []
    try:
        asked = next(growth)
        while True:
            every += asked
            asked = growth.send([answer(*one) for one in asked])
    except StopIteration as end:
        return end.value, every


def ranked(contest=None, count=3, pressures=PRESSURES, before=None, begin=False):
    """So many candidates through a protocol: standing, path check, deviations, and what was asked."""
    names = [f"path{n}" for n in range(count)]
    samples = Samples(np.arange(float(len(pressures))), pressures, pressures)
    compared = RankingSetup(tuple(names), samples)
    motion = made_up.motion(made_up.mesh(), samples.time_s, pressures)
    states = {round(s.pressure_kPa, 9): s for s in motion.solved}
    sensors = Waveguides(UNIT, motion.mesh, (), ANCHORS)
    found, asked = answered(
        solving(compared, contest, before, begin),
        lambda name, at: solved(sensors, names.index(name), at, states, STATIONS, whole=False),
    )
    check, along = answered(
        following(compared, found), lambda name, at: followed(sensors, names.index(name), at)
    )
    deviations = evaluated(compared, found, check, motion, ANCHORS, STATIONS)
    return SimpleNamespace(
        compared=compared, standing=found, check=check, deviations=deviations, asked=asked, along=along
    )


def solutions(found):
    """The number of states that were asked for."""
    return sum(len(pressures) for _, pressures in found.asked)


def test_one_candidate_is_followed_along_its_whole_path(monkeypatch):
    """The most deviating, to its largest deviation: 1 % of the bending there is told, and allowed."""
    same = ranked()
    assert same.along == [("path2", (10.0, 20.0))]
    assert same.check.difference_mm == pytest.approx(0.0, abs=1e-12)
    monkeypatch.setattr(Waveguides, "along", 1e-4)
    apart = ranked()
    assert 1e-5 < apart.check.difference_mm < 0.1
    assert same.check.independent
    assert apart.check.independent
    assert len(apart.along) == 1


def test_where_a_path_leads_elsewhere_every_candidate_is_followed(monkeypatch):
    together = ranked()
    monkeypatch.setattr(Waveguides, "along", 0.01)
    along = ranked()
    assert not along.check.independent
    assert along.standing.solved_kPa == pytest.approx([-10, 10, 20])
    assert along.along[1:] == [(f"path{n}", side) for n in range(3) for side in ((-10.0,), (10.0, 20.0))]
    # Nearer to Model A by a fifth of the first one's distance.
    without, with_path = (one.deviations["path0"].delta[[1, 3, 4], 1:] for one in (together, along))
    np.testing.assert_allclose(with_path, 0.8 * without, rtol=0.05)


def test_a_candidate_that_is_followed_from_rest_is_solved_at_every_pressure_on_its_way(monkeypatch):
    asked = []

    def states(self, number, way):
        asked.append([round(one.pressure_kPa, 9) for one in way])
        return [made_up.state(self.mesh, one.pressure_MPa, 0.95 - 0.01 * number) for one in way]

    by_start = ranked()
    monkeypatch.setattr(Waveguides, "states", states)
    from_rest = ranked()
    assert sorted(asked) == [[-10.0]] * 3 + [[10.0, 20.0]] * 3
    for name, deviation in from_rest.deviations.items():
        np.testing.assert_allclose(deviation.delta, by_start.deviations[name].delta, atol=1e-12)


def missing(monkeypatch, is_missed):
    """Let candidates have no state at a pressure in kPa where `is_missed`, of both, is true."""
    solve = Waveguides.states

    def states(self, number, way):
        if is_missed(number, way[-1].pressure_kPa):
            raise ConvergenceError("no step lowers the potential")
        return solve(self, number, way)

    monkeypatch.setattr(Waveguides, "states", states)


def test_a_pressure_that_a_path_does_not_reach_is_compared_for_none(monkeypatch):
    whole = ranked().deviations["path0"].delta
    with monkeypatch.context() as patch:
        missing(patch, lambda number, kPa: kPa < 0.0)
        found = ranked()
    assert found.standing.not_reached == ["at -10 kPa and beyond (path0: no step lowers the potential)"]
    assert found.standing.solved_kPa == pytest.approx([10, 20])
    partial, compared = found.deviations["path0"], [0, 2, 3, 4]
    assert np.isnan(partial.delta[1]).all()
    np.testing.assert_allclose(partial.delta[compared], whole[compared], atol=1e-9)
    assert partial.J_hat == pytest.approx(partial.delta[compared].mean())
    assert np.isfinite([partial.J_cont, *partial.over_length]).all()
    missing(monkeypatch, lambda number, kPa: True)
    with pytest.raises(ConvergenceError, match="no pressure is reached by all paths"):
        ranked()


def test_a_path_that_ends_on_its_way_from_rest_ends_the_comparison_there(monkeypatch):
    alone = Waveguides.alone
    monkeypatch.setattr(Waveguides, "along", 0.01)

    def ended(self, number, pressures_MPa):
        return alone(self, number, pressures_MPa[pressures_MPa < 0.015] if number == 2 else pressures_MPa)

    monkeypatch.setattr(Waveguides, "alone", ended)
    found = ranked()
    assert found.standing.not_reached == [
        "at 20 kPa and beyond (path2: no equilibrium at 20 kPa on its path from rest)"
    ]
    assert found.standing.solved_kPa == pytest.approx([-10, 10])
    for deviation in found.deviations.values():
        assert np.isnan(deviation.delta).all(axis=1).tolist() == [False, False, False, False, True]


# Candidate n of the made-up sensors bends the unit by a further hundredth less than the one before.


def contested(contest, before=None, begin=False):
    """A contest of ten candidates through a grasp."""
    return ranked(contest, 10, GRASP, before, begin)


def test_a_candidate_that_cannot_be_among_the_best_is_left_with_a_bound():
    """The three best, their digits and their order are those of a full ranking."""
    every, some = contested(Contest(3, every=True)), contested(Contest(3))
    # All ten above 0; of suction the three best and a near one all, two others the weaker one.
    assert (every.standing.at_least_mm, solutions(every), solutions(some)) == ({}, 40, 30)
    assert [*some.deviations] == ["path0", "path1", "path2", "path3"]
    assert [*some.standing.at_least_mm] == [f"path{n}" for n in range(4, 10)]
    for name, deviation in some.deviations.items():
        assert np.array_equal(deviation.delta, every.deviations[name].delta)
    for name, bound in some.standing.at_least_mm.items():
        assert some.deviations["path2"].J_hat < bound < every.deviations[name].J_hat
    assert some.check.difference_mm == every.check.difference_mm


@pytest.mark.parametrize("contest", [Contest(1), Contest(3), Contest(3, every=True)])
def test_a_contest_that_is_begun_and_then_decided_asks_for_what_one_at_once_does(contest):
    begun, whole = contested(contest, begin=True), contested(contest)
    assert [*begun.deviations] == [f"path{n}" for n in range(contest.best)]
    decided = contested(contest, begun.standing)
    assert begun.asked + decided.asked == whole.asked
    assert decided.standing.at_least_mm == whole.standing.at_least_mm
    for name, deviation in whole.deviations.items():
        assert np.array_equal(deviation.delta, decided.deviations[name].delta)


def test_what_a_margin_lets_in_again_is_solved_from_what_is_there():
    first = contested(Contest(1))
    assert [*first.deviations] == ["path0"]
    limit = 1.9 * first.deviations["path0"].J_hat
    wider = contested(Contest(1, limit / 1.9 * 0.9), first.standing)
    assert len(wider.deviations) > 1
    assert all(bound > limit for bound in wider.standing.at_least_mm.values())
    asked = [(name, p) for name, at in [*first.asked, *wider.asked] for p in at]
    assert len(asked) == len({*asked}), "nothing is solved twice"


def test_a_wider_contest_leaves_the_first_as_it_was():
    """A second path check of the first contest asks for the same candidate."""
    first = contested(Contest(1)).standing
    before = {name: [*found] for name, found in first.anchors.items()}
    wider = contested(Contest(1, every=True), first)
    assert wider.standing.at_least_mm == {}
    assert {name: [*found] for name, found in first.anchors.items()} == before


def test_many_pressures_are_interpolated_and_nothing_is_left_out(monkeypatch):
    monkeypatch.setattr(compared_pressures, "FEW_PRESSURES", 3)
    found = contested(Contest(1))
    assert (len(found.deviations), found.standing.at_least_mm) == (10, {})


@pytest.mark.parametrize(
    ("numbers", "ending_kPa", "compared"),
    [((1,), -20.0, [True] * 2 + [False] + [True] * 5), ((1, 4), 20.0, [True] * 6 + [False, True])],
    ids=["one of the best in suction", "under pressure, said once"],
)
def test_a_pressure_that_a_path_misses_opens_the_contest_anew(monkeypatch, numbers, ending_kPa, compared):
    missing(monkeypatch, lambda number, kPa: number in numbers and kPa == pytest.approx(ending_kPa))
    found = contested(Contest(3))
    why = "path1: no step lowers the potential"
    assert found.standing.not_reached == [f"at {ending_kPa:g} kPa and beyond ({why})"]
    assert {"path0", "path1", "path2"} <= {*found.deviations}
    for deviation in found.deviations.values():
        assert np.isfinite(deviation.over_time).tolist() == compared
    least = max(found.deviations[f"path{n}"].J_hat for n in range(3))
    assert all(bound > least for bound in found.standing.at_least_mm.values())


def test_a_loser_without_a_state_costs_the_others_nothing(monkeypatch):
    missing(monkeypatch, lambda number, kPa: number == 9 and kPa < -15.0)
    found = contested(Contest(3, every=True))
    assert found.standing.ended == ["path9 at -20 kPa and beyond (no step lowers the potential)"]
    assert ([*found.standing.at_least_mm], found.standing.not_reached) == (["path9"], [])
    assert np.isfinite(found.deviations["path0"].delta).all()


def test_where_states_depend_on_the_path_nothing_is_left_out(monkeypatch):
    monkeypatch.setattr(Waveguides, "along", 0.05)
    found = contested(Contest(3))
    assert not found.check.independent
    assert (len(found.deviations), found.standing.at_least_mm) == (10, {})
    more = letting_in(found.compared, Contest(3), found.standing, found.check, Uncertainty(1.0))
    assert answered(more, pytest.fail) == (found.standing, [])


def test_with_history_instants_count_until_the_first_that_a_path_does_not_reach():
    motion = made_up.motion(made_up.mesh(), np.arange(5.0), PRESSURES)
    moved = {f"path{n}": ANCHORS + 1e-3 * (n + 1) * PRESSURES[:, None, None] for n in range(3)}
    moved["path2"] = moved["path2"][:4]
    found, not_reached = evaluated_in_time([*moved], moved, motion, ANCHORS, STATIONS)
    assert not_reached == ["from 4 s on (path2: no equilibrium at 20 kPa)"]
    for one in found.values():
        assert np.isfinite(one.over_time).tolist() == [True, True, True, True, False]
    with pytest.raises(ConvergenceError, match="not all paths are compared from 1 s on"):
        evaluated_in_time([*moved], moved | {"path1": moved["path1"][:1]}, motion, ANCHORS, STATIONS)


def test_a_mesh_check_compares_the_pressures_that_both_meshes_reach():
    fine, coarse = (
        deviation_of(np.outer(of_time, np.ones(3))) for of_time in ([0.1, 0.3, 0.4], [np.nan, 0.36])
    )
    change = mesh_change_mm({"alpha1": fine}, {"alpha1": coarse}, [0, 1])
    # 0.3 to 0.36 at the one pressure of both, of a mean deviation of 0.8 / 3.
    assert change == pytest.approx(0.06 * fine.J_hat / 0.3)
    with pytest.raises(ConvergenceError, match="on both meshes"):
        mesh_change_mm({"alpha1": coarse}, {"alpha1": fine}, [0, 0, 0])


def test_the_mesh_check_takes_the_paths_that_disturb_least():
    deviations = {
        name: deviation_of(np.full((2, 3), mm)) for name, mm in (("a", 0.3), ("b", 0.1), ("c", 0.2))
    }
    assert Ranking(deviations).best(2) == ["b", "c"]
