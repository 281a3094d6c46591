"""An optimisation in its folder: its table and report, resumed without computing again, its words, its
refusals."""

import json
import shutil

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset, to_toml
from mu_addon.errors import InputError
from mu_addon.optimization import unit_body
from mu_addon.optimization.evaluation import Evaluated, Evaluator, evaluate
from mu_addon.optimization.robustness import Verified
from mu_addon.optimization.search import Found, Observed
from mu_addon.run.context import RunContext
from mu_addon.run.progress import Progress
from mu_addon.usecases.optimize import run as optimize_run
from mu_addon.usecases.optimize.job import Job, job_from, mechanics_of, read_job
from mu_addon.usecases.optimize.run import USE_CASE, console_summary
from mu_addon.usecases.optimize.words import changes, outcome, reasons, verdict
from mu_addon.usecases.optimize.worker import Task, run_task

TEXT = """
format = 1
preset = "mu-1.0x"
evaluations = 3
refine = 0.2
check_refine = 0.25

[[target]]
kind = "angle"
pressure_kPa = 2.5
low = 1.2
tolerance = 0.05

[[target]]
kind = "mass"
objective = "minimise"

[[freedom]]
parameter = "chambers.wall_mm"
low = 0.7
high = 1.3
"""


@pytest.fixture
def job(tmp_path):
    """Of three chambers, which bend half as far as six."""
    (tmp_path / "unit.toml").write_text(to_toml(load_preset("mu-1.0x").evolve(count=3)))
    file = tmp_path / "design.toml"
    own = TEXT.replace('preset = "mu-1.0x"', 'unit = "unit.toml"').replace("low = 1.2", "low = 0.6")
    file.write_text(own)
    return job_from(file)


def started(job, folder):
    context = RunContext(Progress([]))
    found = USE_CASE.start(job, folder, context)
    context.write_report("stopped by Ctrl-C")
    page = (folder / "report.html").read_text()
    assert "This run is partial: stopped by Ctrl-C" in page
    context.write_report()
    context.unlock()
    return found, context.summary


@pytest.mark.slow
def test_it_is_resumed_with_the_same_digits_and_nothing_computed_twice(job, tmp_path, monkeypatch):
    folder = tmp_path / "out"
    found, summary = started(job, folder)
    assert found.computed == len(found.search.observed) == summary["designs"]
    table = (folder / "designs.csv").read_text()
    page = (folder / "report.html").read_text()
    assert "Optimisation of" in page
    assert "wall_mm" in page
    assert (folder / "proposed-1.toml").is_file()
    assert (folder / "front.png").read_bytes().startswith(b"\x89PNG")
    # Each is its own: a thinner wall bends further and is lighter.
    values = np.array([o.values for o in found.search.observed])
    walls = np.array([o.design[0] for o in found.search.observed])
    order = np.argsort(walls)
    assert (np.diff(values[order, 0]) < 0).all()
    assert (np.diff(values[order, 1]) > 0).all()
    proposal = found.proposals[0]
    assert (proposal.checked.error >= proposal.checked.by_mesh).all()
    assert proposal.checked.by_print[0] > 0
    assert any("wall_mm" in words for words in proposal.changes)
    lines = console_summary(summary)
    assert str(summary["designs"]) in lines[1]

    with monkeypatch.context() as patch:
        patch.setattr(optimize_run, "verified", None)
        again, _ = started(read_job(folder), folder)
    assert again.computed == 0
    assert (folder / "designs.csv").read_text() == table

    # Killed: some of what was computed is lost, and comes back the same.
    kept = sorted((folder / "cache").glob("unit-*.npz"))
    for path in kept[::3]:
        path.unlink()
    third, _ = started(read_job(folder), folder)
    assert third.computed == len(kept[::3])
    assert (folder / "designs.csv").read_text() == table
    shutil.rmtree(folder)


@pytest.mark.slow
def test_a_worker_finds_what_the_run_does(job):
    files = tuple(sorted(job.texts().items()))
    row = run_task(Task(to_toml(job.design.unit), files))
    evaluator = Evaluator(job.design.targets, job.design.freedoms, mechanics_of(job.design, None)[0])
    [own] = evaluator.of([job.design.unit])
    assert row["status"] == "done"
    assert row["values"] == own.plain()["values"]
    assert json.loads(json.dumps(row))["gradient"] == own.plain()["gradient"]


@pytest.mark.slow
def test_a_robust_search_judges_by_the_finer_mesh_and_within_its_uncertainty(tmp_path):
    unit = load_preset("mu-1.0x").evolve(count=3)
    job = Job(job_from_text("robust = true\n" + TEXT, unit))
    run = optimize_run._Run(job, tmp_path, RunContext(Progress([]), folder=tmp_path), 0.3)
    mechanics, _ = mechanics_of(job.design, None)
    uncertainty = job.design.uncertainty
    run.evaluator = Evaluator(job.design.targets, job.design.freedoms, mechanics, uncertainty=uncertainty)
    run.mesh_change = run.change_by_mesh(run.candidate(job.design.start, job.design.unit))
    [observed] = run.observe([job.design.start])
    raw = run.rows[0][1]
    finer, _ = mechanics_of(job.design, None, job.design.check_refine)
    fine = evaluate(job.design.unit, job.design.targets, (), finer).values
    judged = [i for i, t in enumerate(job.design.targets) if t.quantity is not None]
    # Of the start it is exact.
    np.testing.assert_allclose(observed.values[judged], fine[judged], rtol=1e-9)
    for i in judged:
        expected = (fine[i] - raw.values[i]) ** 2 + raw.by_print[i] ** 2 + raw.by_resin[i] ** 2
        assert observed.margins[i] == pytest.approx(2.0 * expected**0.5, rel=1e-6)
    # A modulus 10 % higher bends the unit as a pressure does that is 10 % lower.
    sides = []
    for pressure in (2.25, 2.75):
        other = job_from_text(TEXT.replace("pressure_kPa = 2.5", f"pressure_kPa = {pressure}"), unit)
        sides.append(evaluate(unit, other.targets[:1], (), mechanics).values[0])
    assert raw.by_resin[judged[0]] == pytest.approx((sides[1] - sides[0]) / 2, rel=0.02)
    assert (raw.by_print[judged] >= 0).all()
    assert raw.by_print[judged[0]] > 0


@pytest.mark.slow
def test_a_unit_straight_under_its_weight_is_asked_for_by_an_angle_at_rest():
    text = "orientation_deg = 90\n" + TEXT.replace("pressure_kPa = 2.5", "pressure_kPa = 0")
    design = job_from_text(text, load_preset("mu-1.0x").evolve(count=3))
    [found] = Evaluator(design.targets, design.freedoms, mechanics_of(design, None)[0]).of([design.unit])
    hanging = attrs.evolve(design, orientation_deg=0.0)
    [other] = Evaluator(design.targets, design.freedoms, mechanics_of(hanging, None)[0]).of([design.unit])
    # Level, with the side of more lattice up, it sags away from it; hanging its weight bends it less.
    assert found.values[0] < -0.3
    assert abs(other.values[0]) < 0.3 * abs(found.values[0])
    assert np.isfinite(found.gradient[0]).all()


def test_its_folder_holds_all_that_a_run_needs(job, tmp_path):
    for name, text in job.texts().items():
        (tmp_path / name).write_text(text)
    again = read_job(tmp_path)
    assert again.texts() == job.texts()
    assert again.design.start == job.design.start


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot read the design"):
        job_from(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="UTF-8"):
        job_from(tmp_path / "bad.toml")


def test_a_design_that_breaks_a_rule_is_a_row_and_not_the_end(job, tmp_path):
    context = RunContext(Progress([]), folder=tmp_path)
    run = optimize_run._Run(job, tmp_path, context, 0.3)
    run.evaluator = Evaluator(job.design.targets, job.design.freedoms, mechanics_of(job.design, None)[0])
    [observed] = run.observe([(50.0,)])
    assert not observed.sound
    assert "breaks a rule of units" in (tmp_path / "designs.csv").read_text()


def test_a_unit_that_does_not_bear_its_pressure_is_an_answer(monkeypatch):
    # To find the limit point itself takes half a minute.
    soon = attrs.evolve(unit_body.RESOLVED_NEWTON, follow_snaps=False, min_step_MPa=2e-3)
    monkeypatch.setattr(unit_body, "RESOLVED_NEWTON", soon)
    design = job_from_text(TEXT.replace("pressure_kPa = 2.5", "pressure_kPa = 60"))
    unit = design.unit.evolve(count=3, membrane_modulus_kPa=50.0)
    [found] = Evaluator(design.targets, design.freedoms, mechanics_of(design, None)[0]).of([unit])
    assert not found.sound
    assert "no equilibrium" in found.why
    assert np.isnan(found.values).all()


def job_from_text(text, unit=None):
    from mu_addon.optimization.design_file import parse_design

    return parse_design(text, "design.toml", unit)


def test_words_say_what_changed_and_what_moved_it(job):
    d = job.design
    observed = Observed((0.7,), np.array([6.0, 18.0]), np.array([[-10.0], [5.0]]))
    assert changes(d.freedoms, (0.9,), (0.7,)) == ["chambers.wall_mm: 0.9 to 0.7 mm (its lower bound)"]
    assert reasons(d.freedoms, d.targets, observed, (0.9,)) == [
        "angle at 2.5 kPa: chambers.wall_mm by +2 deg",
        "mass: chambers.wall_mm by -1 g",
    ]
    missed = Found(
        (Observed((0.7,), np.array([0.4, 18.0]), np.zeros((2, 1))),), (0,), False, ("angle at 2.5 kPa",)
    )
    words = outcome(missed, d.targets)
    assert "angle at 2.5 kPa is 0.4 instead of at least 0.6 deg" in words
    assert "Without angle at 2.5 kPa the others can be met" in words
    failed = Found((Observed((0.7,), np.full(2, np.nan), np.zeros((2, 1)), False),), (0,), False)
    assert "could be simulated" in outcome(failed, d.targets)


def test_what_the_print_check_refuses_is_in_the_outcome():
    yes, zero = np.ones(2, bool), np.zeros(2)
    good = Verified(zero, zero, zero, zero, yes, yes)
    refused = Verified(zero, zero, zero, zero, np.array([True, False]), np.array([True, False]), "", "error")
    assert verdict([]) == ""
    assert verdict([good]) == "Met in full on a finer mesh: 1 of 1 proposed, robustly 1."
    words = verdict([good, refused])
    assert words.startswith("Met in full on a finer mesh: 1 of 2")
    assert words.endswith("refuses 1.")


def test_what_was_kept_of_a_unit_is_what_was_found(job):
    from mu_addon.optimization.evaluation import restored

    unit = job.design.unit
    found = Evaluated(unit, np.array([1.5, np.nan]), np.array([[2.0], [np.nan]]), "", 3)
    again = restored(unit, json.loads(json.dumps(found.plain())))
    np.testing.assert_array_equal(again.values, found.values)
    np.testing.assert_array_equal(again.gradient, found.gradient)
    assert (again.why, again.model_a) == ("", 3)
