"""A quick ranking: the inputs it is made of, and what its figures say they leave out."""

import json

import attrs
import numpy as np
import pytest
from mu_addon.usecases.simulate_and_place.candidates_by_pressure import solve_candidates
from mu_addon.usecases.simulate_and_place.run import console_summary
from mu_addon.usecases.simulate_and_place.study import Study

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.candidates import candidate_paths
from mu_addon.placement.elimination import Contest
from mu_addon.run.cache import Cache
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress
from mu_addon.studies.unit_inputs import grasp
from mu_addon.studies.unit_ranking import UnitStudy
from mu_addon.studies.use_case import write_study
from mu_addon.usecases.simulate_and_place import report, unit_runs
from mu_addon.usecases.simulate_and_place.comparison import compare
from mu_addon.usecases.simulate_and_place.expected import plan_of
from mu_addon.usecases.simulate_and_place.motion_checks import doubts_of_job

from ..report.report_data import results
from . import made_up

FULL = UnitStudy(load_preset("mu-1.0x"), grasp(), self_contact=True)
LEFT_OUT = "under pressure alone, coarse mesh, no mesh check"


def test_it_is_the_same_study_with_other_inputs():
    one = quick(FULL)
    assert one.samples[0].tolist() == FULL.samples[0].tolist()
    assert one.samples[1].tolist() == np.maximum(FULL.samples[1], 0.0).tolist()
    assert not list(doubts_of_job(one)), "what is left out on purpose is no doubt"
    assert (one.mesh.refine, one.mesh_check, one.self_contact) == (0.35, False, True)
    assert quick(attrs.evolve(FULL, mesh=MeshSettings(refine=0.2))).mesh.refine == 0.2
    # Four of six pressures, and not those where walls touch.
    assert sum(s for _, s in plan_of(one)) < 0.2 * sum(s for _, s in plan_of(FULL))


def test_without_pressure_there_is_none():
    suction = attrs.evolve(FULL, protocol=Protocol(np.arange(3.0), np.array([0.0, -20.0, 0.0])))
    with pytest.raises(InputError, match="no pressure above 0") as refused:
        quick(suction)
    assert "--quick" in refused.value.where


def test_its_run_is_never_taken_for_the_full_one(tmp_path):
    """It has a folder of its own, a name of its own, and hides no full ranking."""
    runs = []
    for job in (FULL, quick(FULL)):
        folder, job = unit_runs.place_of(tmp_path, job)
        write_study(job, folder)
        assert UnitStudy.read(folder).tables() == job.tables()
        (folder / "summary.json").write_text(json.dumps({"status": "complete", "J_hat_mm": {"alpha4": 0.3}}))
        runs.append(unit_runs.read_run(folder))
    full, short = runs
    assert full.folder != short.folder
    assert (full.title, short.title) == ("Ranking", "Quick ranking")
    assert (full.left_out, short.left_out) == ("", LEFT_OUT)
    assert unit_runs.best_of([short, full], full.design) is full
    rows = {row.what: row.values for row in compare(runs)}
    assert rows["without suction"] == ("-", "yes")


def test_its_deviation_is_a_bound_of_the_full_one(tmp_path, monkeypatch):
    """Made-up waveguides: the same choice, less by what the suction would add, and fewer states."""
    monkeypatch.setattr(
        "mu_addon.usecases.simulate_and_place.candidate_pool.PrintedWaveguides", made_up.Waveguides
    )
    full = UnitStudy(made_up.UNIT, grasp(), made_up.MESH, mesh_check=False, workers=1)
    mesh, J = made_up.mesh(), []
    paths = candidate_paths(anchor_points(full.unit), windows(4))
    for n, job in enumerate((full, quick(full))):
        trajectory, cache = made_up.motion(mesh, *job.samples), Cache(tmp_path / str(n))
        found, _ = solve_candidates(job, cache, mesh, trajectory, paths, lambda _: None, contest=Contest(1))
        best = min(found, key=lambda e: e.deviation.J_hat)
        J.append((best.name, best.deviation.J_hat))
    (name, whole), (short_name, short) = J
    assert short_name == name
    assert 0.0 < short < whole
    assert len(list((tmp_path / "1").glob("sweep-*"))) < len(list((tmp_path / "0").glob("sweep-*")))


def test_its_figures_say_what_they_leave_out(tmp_path):
    with run_to_end(Progress([])) as context:
        Study.open(quick(FULL), tmp_path, context)
    assert context.summary["left_out"] == LEFT_OUT
    figures = {"chosen": "alpha4", "J_hat_mm": {"alpha4": 0.3}, "tied_with_chosen": [], "left_out": LEFT_OUT}
    assert console_summary(figures) == [f"best path: alpha4, J_hat 0.3000 mm ({LEFT_OUT})"]
    # The whole report takes seconds.
    assert f"mm ({LEFT_OUT}).</p>" in report._headline(results(left_out=LEFT_OUT, view=None))
