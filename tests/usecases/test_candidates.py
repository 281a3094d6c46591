"""A study's sweep: what it solves, what it keeps, and what it does where a path leads elsewhere."""

import attrs
import numpy as np
import pytest
from mu_addon.usecases.simulate_and_place.candidates_by_pressure import CandidateSolver
from mu_addon.usecases.simulate_and_place.candidates_in_time import evaluations

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.errors import ConvergenceError
from mu_addon.fem.protocol import Protocol
from mu_addon.placement.candidates import Candidate, Evaluation, candidate_paths
from mu_addon.placement.deviation import centreline_deviation, deviation_of
from mu_addon.placement.elimination import Contest
from mu_addon.run.cache import Cache
from mu_addon.studies.unit_ranking import UnitStudy
from mu_addon.usecases.simulate_and_place.ranking import Ranking, mesh_change_mm

from . import made_up
from .made_up import UNIT, Waveguides

PRESSURES = np.array([0.0, -10.0, 0.0, 10.0, 20.0])
JOB = UnitStudy(
    unit=UNIT,
    protocol=Protocol(np.arange(5.0), PRESSURES),
    mesh=made_up.MESH,
    times=5,
    stations=21,
    workers=1,
)
JOBS = candidate_paths(anchor_points(UNIT), windows(4))


@pytest.fixture(autouse=True)
def waveguides(monkeypatch):
    """Sensors by formulas, in the place of those that are solved for."""
    monkeypatch.setattr("mu_addon.usecases.simulate_and_place.candidate_pool.PrintedWaveguides", Waveguides)


@pytest.fixture(scope="module")
def model_a():
    mesh = made_up.mesh()
    return mesh, made_up.motion(mesh, np.arange(5.0), PRESSURES)


def swept(model_a, folder, **changes):
    mesh, trajectory = model_a
    sweep = CandidateSolver(attrs.evolve(JOB, **changes), Cache(folder), mesh, JOBS, PRESSURES)
    shares = []
    found = sweep.evaluations(trajectory, shares.append, verify=True)
    sweep.close()
    assert shares == sorted(shares) or sweep.not_reached
    return sweep, np.array([e.deviation.delta for e in found])


def test_one_candidate_is_followed_along_its_whole_path(model_a, tmp_path, monkeypatch):
    """At the largest deviation: a difference of 1 % of the bending there is told, and allowed."""
    sweep, _ = swept(model_a, tmp_path / "same")
    assert sweep.path_difference_mm == pytest.approx(0.0, abs=1e-12)
    assert sweep.independent_of_path
    monkeypatch.setattr(Waveguides, "along", 1e-4)
    sweep, _ = swept(model_a, tmp_path / "apart")
    assert 1e-5 < sweep.path_difference_mm < 0.1
    assert sweep.independent_of_path


def test_where_a_path_leads_elsewhere_every_candidate_is_followed(model_a, tmp_path, monkeypatch):
    _, together = swept(model_a, tmp_path / "together")
    monkeypatch.setattr(Waveguides, "along", 0.01)
    sweep, along = swept(model_a, tmp_path / "along")
    assert not sweep.independent_of_path
    assert sweep.solved_kPa == pytest.approx([-10, 10, 20])
    # Nearer to Model A by a fifth of the first one's distance.
    pressed = [1, 3, 4]
    np.testing.assert_allclose(along[0][pressed, 1:], 0.8 * together[0][pressed, 1:], rtol=0.05)


def test_what_was_solved_is_read_back_to_the_same_digits(model_a, tmp_path):
    _, first = swept(model_a, tmp_path)
    before = {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    _, again = swept(model_a, tmp_path)
    assert np.array_equal(first, again)
    assert {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()} == before


def test_a_candidate_that_is_followed_from_rest_is_kept_at_every_pressure_on_its_way(
    model_a, tmp_path, monkeypatch
):
    asked = []

    def followed(self, number, way):
        asked.append([round(one.pressure_kPa, 9) for one in way])
        return [made_up.state(self.mesh, one.pressure_MPa, 0.95 - 0.01 * number) for one in way]

    _, by_start = swept(model_a, tmp_path / "starts")
    monkeypatch.setattr(Waveguides, "states", followed)
    _, from_rest = swept(model_a, tmp_path / "paths")
    assert sorted(asked) == [[-10.0]] * 3 + [[10.0, 20.0]] * 3
    assert len(sorted((tmp_path / "paths").glob("sweep-*"))) == 9
    np.testing.assert_allclose(from_rest, by_start, atol=1e-12)


def test_a_pressure_that_a_path_does_not_reach_is_compared_for_none(model_a, tmp_path, monkeypatch):
    _, whole = swept(model_a, tmp_path / "whole")
    solve = Waveguides.states

    def above(limit_MPa):
        def reached(self, number, way):
            if way[-1].pressure_MPa < limit_MPa:
                raise ConvergenceError("no step lowers the potential")
            return solve(self, number, way)

        return reached

    monkeypatch.setattr(Waveguides, "states", above(0.0))
    sweep, partial = swept(model_a, tmp_path / "partial")
    assert sweep.not_reached == ["at -10 kPa and beyond (alpha1: no step lowers the potential)"]
    assert sweep.solved_kPa == pytest.approx([10, 20])
    compared = [0, 2, 3, 4]
    assert np.isnan(partial[:, 1]).all()
    np.testing.assert_allclose(partial[:, compared], whole[:, compared], atol=1e-9)
    deviation = deviation_of(partial[0])
    assert deviation.J_hat == pytest.approx(partial[0, compared].mean())
    assert np.isfinite([deviation.J_cont, *deviation.over_length]).all()

    monkeypatch.setattr(Waveguides, "states", above(1.0))
    with pytest.raises(ConvergenceError, match="no pressure is reached by all paths"):
        swept(model_a, tmp_path / "none")


def test_a_path_that_ends_on_its_way_from_rest_ends_the_comparison_there(model_a, tmp_path, monkeypatch):
    alone = Waveguides.alone
    monkeypatch.setattr(Waveguides, "along", 0.01)

    def ended(self, number, pressures_MPa):
        return alone(self, number, pressures_MPa[pressures_MPa < 0.015] if number == 2 else pressures_MPa)

    monkeypatch.setattr(Waveguides, "alone", ended)
    sweep, found = swept(model_a, tmp_path)
    name = JOBS[2].name
    assert sweep.not_reached == [
        f"at 20 kPa and beyond ({name}: no equilibrium at 20 kPa on its path from rest)"
    ]
    assert sweep.solved_kPa == pytest.approx([-10, 10])
    assert np.isnan(found).all(axis=(0, 2)).tolist() == [False, False, False, False, True]


# Candidate n of the made-up sensors bends the unit by a further hundredth less than the one before.
TEN = [Candidate(f"path{n}", 1, JOBS[0].points) for n in range(10)]
GRASP = np.array([0.0, -10.0, -20.0, -10.0, 0.0, 10.0, 20.0, 10.0])


@pytest.fixture(scope="module")
def grasping(model_a):
    mesh, _ = model_a
    return mesh, made_up.motion(mesh, np.arange(8.0), GRASP)


def contested(grasping, folder, contest, **changes):
    """A contest of ten candidates, their evaluations by name, and how often each pressure was solved."""
    mesh, trajectory = grasping
    sweep = CandidateSolver(attrs.evolve(JOB, **changes), Cache(folder), mesh, TEN, GRASP, contest=contest)
    for state in trajectory.solved[::-1] if sweep._job.workers > 1 else ():
        sweep.reached(state)
    found = {e.name: e.deviation for e in sweep.evaluations(trajectory, lambda _: None, verify=True)}
    sweep.close()
    return sweep, found, len(list(folder.glob("sweep-*")))


def test_a_candidate_that_cannot_be_among_the_best_is_left_with_a_bound(grasping, tmp_path):
    """The three best, their digits and their order are those of a full ranking."""
    every, all_found, solved_all = contested(grasping, tmp_path / "all", Contest(3, every=True))
    some, found, solved = contested(grasping, tmp_path / "some", Contest(3))
    # All ten above 0; of suction the three best and a near one all, two others the weaker one.
    assert (every.at_least_mm, solved_all, solved) == ({}, 40, 30)
    assert [*found] == ["path0", "path1", "path2", "path3"]
    assert [*some.at_least_mm] == [one.name for one in TEN[4:]]
    for name, deviation in found.items():
        assert np.array_equal(deviation.delta, all_found[name].delta)
    for name, bound in some.at_least_mm.items():
        assert found["path2"].J_hat < bound < all_found[name].J_hat
    assert some.path_difference_mm == every.path_difference_mm


def test_what_a_margin_lets_in_again_is_solved_from_what_is_kept(grasping, tmp_path):
    _, found, _ = contested(grasping, tmp_path, Contest(1))
    assert [*found] == ["path0"]
    margin = 0.9 * found["path0"].J_hat
    wider, found, _ = contested(grasping, tmp_path, Contest(1, margin))
    limit = found["path0"].J_hat + margin
    assert len(found) > 1
    assert all(bound > limit for bound in wider.at_least_mm.values())


def test_an_earlier_full_ranking_is_shown_in_full(grasping, tmp_path):
    _, full, _ = contested(grasping, tmp_path, Contest(3, every=True))
    again, found, _ = contested(grasping, tmp_path, Contest(3))
    assert again.at_least_mm == {}
    assert {n: d.J_hat for n, d in found.items()} == {n: d.J_hat for n, d in full.items()}


def test_many_pressures_are_interpolated_and_nothing_is_left_out(grasping, tmp_path, monkeypatch):
    monkeypatch.setattr("mu_addon.usecases.simulate_and_place.candidates_by_pressure.FEW_PRESSURES", 3)
    sweep, found, _ = contested(grasping, tmp_path, Contest(1))
    assert (len(found), sweep.at_least_mm) == (10, {})


def test_a_pressure_that_one_of_the_best_does_not_reach_opens_the_contest_anew(
    grasping, tmp_path, monkeypatch
):
    solve = Waveguides.states

    def ended(self, number, way):
        if number == 1 and way[-1].pressure_MPa < -0.015:
            raise ConvergenceError("no step lowers the potential")
        return solve(self, number, way)

    monkeypatch.setattr(Waveguides, "states", ended)
    sweep, found, _ = contested(grasping, tmp_path, Contest(3))
    assert sweep.not_reached == ["at -20 kPa and beyond (path1: no step lowers the potential)"]
    assert {"path0", "path1", "path2"} <= {*found}
    assert all(np.isnan(deviation.delta[2]).all() for deviation in found.values())
    least = max(found[f"path{n}"].J_hat for n in range(3))
    assert all(bound > least for bound in sweep.at_least_mm.values())


def test_a_pressure_missed_under_pressure_is_said_once_and_the_lower_ones_are_kept(
    grasping, tmp_path, monkeypatch
):
    solve = Waveguides.states

    def ended(self, number, way):
        if number in (1, 4) and way[-1].pressure_MPa > 0.015:
            raise ConvergenceError("no step lowers the potential")
        return solve(self, number, way)

    monkeypatch.setattr(Waveguides, "states", ended)
    sweep, found, _ = contested(grasping, tmp_path, Contest(3))
    assert sweep.not_reached == ["at 20 kPa and beyond (path1: no step lowers the potential)"]
    assert {"path0", "path1", "path2"} <= {*found}
    assert np.isfinite(found["path1"].over_time).tolist() == [True] * 6 + [False, True]


def test_a_loser_without_a_state_costs_the_others_nothing(grasping, tmp_path, monkeypatch):
    solve = Waveguides.states

    def ended(self, number, way):
        if number == 9 and way[-1].pressure_MPa < -0.015:
            raise ConvergenceError("no step lowers the potential")
        return solve(self, number, way)

    monkeypatch.setattr(Waveguides, "states", ended)
    sweep, found, _ = contested(grasping, tmp_path, Contest(3, every=True))
    assert sweep.ended == ["path9 at -20 kPa and beyond (no step lowers the potential)"]
    assert ([*sweep.at_least_mm], sweep.not_reached) == (["path9"], [])
    assert np.isfinite(found["path0"].delta).all()


def test_where_states_depend_on_the_path_nothing_is_left_out(grasping, tmp_path, monkeypatch):
    monkeypatch.setattr(Waveguides, "along", 0.05)
    sweep, found, _ = contested(grasping, tmp_path, Contest(3))
    assert not sweep.independent_of_path
    assert (len(found), sweep.at_least_mm) == (10, {})


def test_with_history_instants_count_until_the_first_that_a_path_does_not_reach(
    model_a, tmp_path, monkeypatch
):
    mesh, trajectory = model_a
    points = anchor_points(UNIT)

    def ended(self, number, time_s, pressure_kPa):
        moved = points + 1e-3 * (number + 1) * pressure_kPa[:, None, None]
        return moved[:4] if number == 2 else moved

    monkeypatch.setattr(Waveguides, "simulated_in_time", ended, raising=False)
    found, not_reached = evaluations(JOB, Cache(tmp_path), mesh, trajectory, JOBS, lambda _: None)
    assert not_reached == [f"from 4 s on ({JOBS[2].name}: no equilibrium at 20 kPa)"]
    for one in found:
        assert np.isfinite(one.deviation.over_time).tolist() == [True, True, True, True, False]


def test_a_mesh_check_compares_the_pressures_that_both_meshes_reach():
    fine, coarse = (
        Evaluation("alpha1", deviation_of(np.outer(of_time, np.ones(3))))
        for of_time in ([0.1, 0.3, 0.4], [np.nan, 0.36])
    )
    change = mesh_change_mm({"alpha1": fine}, [coarse], [0, 1])
    # 0.3 to 0.36 at the one pressure of both, of a mean deviation of 0.8 / 3.
    assert change == pytest.approx(0.06 * fine.deviation.J_hat / 0.3)
    nowhere = {"alpha1": attrs.evolve(fine, deviation=coarse.deviation)}
    with pytest.raises(ConvergenceError, match="on both meshes"):
        mesh_change_mm(nowhere, [fine], [0, 0, 0])


def test_the_mesh_check_of_printed_paths_takes_those_that_disturb_least():
    deviations = {}
    for candidate, offset in zip(JOBS, (0.3, 0.1, 0.2), strict=True):
        deviation = centreline_deviation(np.full((2, 3, 3), offset), np.zeros((2, 3, 3)))
        deviations[candidate.name] = Evaluation(candidate.name, deviation)
    assert Ranking(deviations).best(JOBS, 2) == [JOBS[1], JOBS[2]]
