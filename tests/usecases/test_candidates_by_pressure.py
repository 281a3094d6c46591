"""A study's sweep: what it solves, what it keeps, and what it does where a path leads elsewhere."""

import time

import attrs
import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.errors import ConvergenceError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.protocol import Protocol
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.candidates import Evaluation, candidate_paths
from mu_addon.placement.deviation import centreline_deviation, deviation_of
from mu_addon.run.cache import Cache
from mu_addon.usecases.simulate_and_place.candidate_pool import Evaluator
from mu_addon.usecases.simulate_and_place.candidates_by_pressure import CandidateSolver
from mu_addon.usecases.simulate_and_place.candidates_in_time import evaluations
from mu_addon.usecases.simulate_and_place.job import Job
from mu_addon.usecases.simulate_and_place.ranking import Ranking, mesh_change_mm

UNIT = load_preset("mu-1.0x")
PRESSURES = np.array([0.0, -10.0, 0.0, 10.0, 20.0])
JOB = Job(
    unit=UNIT,
    protocol=Protocol(np.arange(5.0), PRESSURES),
    mesh=MeshSettings(refine=0.5, order=1),
    times=5,
    stations=21,
    workers=1,
)
JOBS = candidate_paths(anchor_points(UNIT), windows(6))[::3]


@pytest.fixture(scope="module")
def model_a():
    mesh = mesh_unit(UNIT, JOB.mesh)
    return mesh, simulate(Equilibrium(Model(mesh), materials_of(UNIT, mesh)), np.arange(5.0), PRESSURES)


def swept(model_a, folder, **changes):
    mesh, trajectory = model_a
    sweep = CandidateSolver(attrs.evolve(JOB, **changes), Cache(folder), mesh, JOBS, PRESSURES)
    shares = []
    found = sweep.evaluations(trajectory, shares.append, verify=True)
    sweep.close()
    assert shares == sorted(shares) or sweep.not_reached
    return sweep, np.array([e.deviation.delta for e in found])


def test_one_candidate_is_followed_along_its_whole_path(model_a, tmp_path):
    sweep, _ = swept(model_a, tmp_path)
    assert 0 < sweep.path_difference_mm < 1e-6


def test_where_a_path_leads_elsewhere_every_candidate_is_followed(model_a, tmp_path, monkeypatch):
    _, together = swept(model_a, tmp_path / "together")
    monkeypatch.setattr("mu_addon.usecases.simulate_and_place.candidates_by_pressure.PATH_DIFFERENCE_MM", 0.0)
    sweep, along = swept(model_a, tmp_path / "along")
    assert sweep.solved_kPa == pytest.approx([-10, 10, 20])
    solved = [0, 1, 2, 4]
    np.testing.assert_allclose(along[:, solved], together[:, solved], atol=1e-6)
    assert not np.array_equal(along, together)


def test_what_was_solved_is_read_back_to_the_same_digits(model_a, tmp_path):
    _, first = swept(model_a, tmp_path)
    before = {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()}
    _, again = swept(model_a, tmp_path)
    assert np.array_equal(first, again)
    assert {p: p.stat().st_mtime_ns for p in tmp_path.iterdir()} == before


def test_what_is_solved_beside_model_a_is_kept_at_once(model_a, tmp_path):
    mesh, trajectory = model_a
    job, cache = attrs.evolve(JOB, workers=2), Cache(tmp_path)
    sweep = CandidateSolver(job, cache, mesh, JOBS, PRESSURES)
    loaded = [state for state in trajectory.solved if state.pressure_MPa]
    for state in loaded:
        sweep.reached(state)
    for _ in range(600):
        kept = list(tmp_path.glob("sweep-*.npz"))
        if len(kept) >= 2:
            break
        time.sleep(0.1)
    sweep.close()
    assert len(kept) >= 2, "nothing kept after a minute"
    before = {p: p.stat().st_mtime_ns for p in kept}
    _, found = swept(model_a, tmp_path)
    assert {p: p.stat().st_mtime_ns for p in kept} == before
    _, alone = swept(model_a, tmp_path / "alone")
    assert np.array_equal(found, alone)


def test_a_pressure_that_a_path_does_not_reach_is_compared_for_none(model_a, tmp_path, monkeypatch):
    _, whole = swept(model_a, tmp_path / "whole")
    solve = Evaluator.__call__

    def above(limit_MPa):
        def reached(self, way, part=0):
            if way[-1].pressure_MPa < limit_MPa:
                raise ConvergenceError("no step lowers the potential")
            return solve(self, way, part)

        return reached

    monkeypatch.setattr(Evaluator, "__call__", above(0.0))
    sweep, partial = swept(model_a, tmp_path / "partial")
    assert sweep.not_reached == ["at -10 kPa and beyond (one of the paths: no step lowers the potential)"]
    assert sweep.solved_kPa == pytest.approx([10, 20])
    compared = [0, 2, 3, 4]
    assert np.isnan(partial[:, 1]).all()
    np.testing.assert_allclose(partial[:, compared], whole[:, compared], atol=1e-9)
    deviation = deviation_of(partial[0])
    assert deviation.J_hat == pytest.approx(partial[0, compared].mean())
    assert np.isfinite([deviation.J_cont, *deviation.over_length]).all()

    monkeypatch.setattr(Evaluator, "__call__", above(1.0))
    with pytest.raises(ConvergenceError, match="no pressure is reached by all paths"):
        swept(model_a, tmp_path / "none")


def test_a_path_that_ends_on_its_way_from_rest_ends_the_comparison_there(model_a, tmp_path, monkeypatch):
    alone = Evaluator.alone
    monkeypatch.setattr("mu_addon.usecases.simulate_and_place.candidates_by_pressure.PATH_DIFFERENCE_MM", 0.0)

    def ended(self, job, pressures_MPa):
        return alone(self, job, pressures_MPa[pressures_MPa < 0.015] if job == 2 else pressures_MPa)

    monkeypatch.setattr(Evaluator, "alone", ended)
    sweep, found = swept(model_a, tmp_path)
    name = JOBS[2].name
    assert sweep.not_reached == [
        f"at 20 kPa and beyond ({name}: no equilibrium at 20 kPa on its path from rest)"
    ]
    assert sweep.solved_kPa == pytest.approx([-10, 10])
    assert np.isnan(found).all(axis=(0, 2)).tolist() == [False, False, False, False, True]


def test_with_history_instants_count_until_the_first_that_a_path_does_not_reach(
    model_a, tmp_path, monkeypatch
):
    mesh, trajectory = model_a
    points = anchor_points(UNIT)

    def ended(self, job, time_s, pressure_kPa):
        moved = points + 1e-3 * (job + 1) * pressure_kPa[:, None, None]
        return moved[:4] if job == 2 else moved

    monkeypatch.setattr(Evaluator, "simulated_in_time", ended)
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
    for candidate, offset in zip(JOBS, (0.3, 0.1, 0.2, 0.4), strict=True):
        deviation = centreline_deviation(np.full((2, 3, 3), offset), np.zeros((2, 3, 3)))
        deviations[candidate.name] = Evaluation(candidate.name, deviation)
    assert Ranking(deviations).best(JOBS, 2) == [JOBS[1], JOBS[2]]
