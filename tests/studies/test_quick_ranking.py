"""A quick ranking: the inputs it is made of, and what its figures say they leave out."""

import json
from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.deviation import deviation_of
from mu_addon.placement.deviation_bounds import Contest
from mu_addon.run.parts import Sentence
from mu_addon.simulate_and_place.motion_checks import doubts_of_protocol
from mu_addon.simulate_and_place.ranking import Ranking
from mu_addon.studies import unit_runs
from mu_addon.studies.starting import write_study
from mu_addon.studies.unit_comparison import compare
from mu_addon.studies.unit_ranking import UnitStudy

from .test_candidates import ranked, solutions

FULL = UnitStudy(unit=load_preset("mu-1.0x"), self_contact=True)
LEFT_OUT = "under pressure alone, coarse mesh, no mesh check"


def quick(study):
    return attrs.evolve(study, quick=True).complete()


def test_it_is_the_same_study_with_other_inputs():
    one = quick(FULL)
    assert one.samples.time_s.tolist() == FULL.samples.time_s.tolist()
    assert one.samples.pressure_kPa.tolist() == np.maximum(FULL.samples.pressure_kPa, 0.0).tolist()
    assert not list(doubts_of_protocol(one.driven, one.samples)), "what is left out on purpose is no doubt"
    assert (one.mesh.refine, one.mesh_check, one.self_contact) == (0.35, False, True)
    assert quick(attrs.evolve(FULL, mesh=MeshSettings(refine=0.2))).mesh.refine == 0.2
    # Four of six pressures, and not those where walls touch.
    assert sum(one.expected().values()) < 0.2 * sum(FULL.expected().values())


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
        assert UnitStudy.read(folder).tables == job.tables
        (folder / "summary.json").write_text(json.dumps({"status": "complete", "J_hat_mm": {"alpha4": 0.3}}))
        runs.append(unit_runs.read_run(folder))
    full, short = runs
    assert full.folder != short.folder
    assert (full.title, short.title) == ("Ranking", "Quick ranking")
    assert (full.left_out, short.left_out) == ("", LEFT_OUT)
    assert unit_runs.best_of([short, full], full.design) is full
    rows = {row.what: row.values for row in compare(runs)}
    assert rows["without suction"] == ("no", "yes")


def test_its_deviation_is_a_bound_of_the_full_one():
    """Made-up waveguides: the same choice, less by what the suction would add, and fewer states."""
    whole, short = (ranked(Contest(1), 3, job.samples.pressure_kPa) for job in (FULL, quick(FULL)))
    (name, full), (short_name, less) = (
        min(((n, d.J_hat) for n, d in one.deviations.items()), key=lambda pair: pair[1])
        for one in (whole, short)
    )
    assert short_name == name
    assert 0.0 < less < full
    assert solutions(short) < solutions(whole)


def test_its_figures_say_what_they_leave_out():
    study, delta = quick(FULL), np.full((13, 51), 0.3)
    assert [part.value for part in study.quickly()] == [LEFT_OUT]
    ranking = Ranking({f"alpha{n}": deviation_of(n * delta) for n in range(1, 11)})
    answer = study.answer(SimpleNamespace(vertices=np.zeros((1, 3))), ranking)
    told = [part.text for part in answer if isinstance(part, Sentence)]
    assert any(text.endswith(f"0.300 mm ({LEFT_OUT}).") for text in told), "in the report"
    assert f"best path: alpha1, J_hat 0.3000 mm ({LEFT_OUT})" in told, "in the terminal"
