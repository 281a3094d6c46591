"""A unit's runs beside each other: which is found again, which is shown, what is lost with one."""

import json
import os

import attrs
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.lock import FolderLock, InUseError
from mu_addon.studies import unit_runs
from mu_addon.studies.starting import write_study
from mu_addon.studies.unit_comparison import compare
from mu_addon.studies.unit_ranking import UnitStudy

FULL = UnitStudy(unit=load_preset("mu-0.75x"), mesh=MeshSettings())
COARSE = attrs.evolve(FULL, mesh=MeshSettings(refine=0.5))
MOTION = attrs.evolve(FULL, stages=("design", "simulate"))
SHORT = {"status": "complete", "angle_deg": {"-20": -3.0, "40": 6.0}, "seconds": {"Model A": 40.0}}
RANKED = SHORT | {
    "chosen": "alpha4",
    "J_hat_mm": {"alpha4": 0.05, "alpha10": 0.4},
    "seconds": {"Model A": 100.0, "candidates": 380.0},
}


def thicker(job, wall_mm):
    chambers = attrs.evolve(job.unit.chambers, wall_mm=wall_mm)
    return attrs.evolve(job, unit=attrs.evolve(job.unit, chambers=chambers))


def ran(home, job, summary, at_s):
    """A run as a child process would have left it, ended at a time."""
    folder, job = unit_runs.place_of(home, job)
    write_study(job, folder)
    path = folder / "summary.json"
    path.write_text(json.dumps(summary))
    os.utime(path, (at_s, at_s))
    return unit_runs.read_run(folder)


def design_of(job):
    return unit_runs.design_key(job.unit, "", [], {})


def test_every_run_is_kept_and_a_small_one_replaces_no_large_one(tmp_path):
    large = ran(tmp_path, FULL, RANKED, 100)
    coarse = ran(tmp_path, COARSE, RANKED | {"seconds": {"Model A": 20.0}}, 200)
    assert large.folder != coarse.folder
    found = unit_runs.runs(tmp_path)
    assert [run.title for run in found] == ["Ranking", "Ranking"]
    assert [run.seconds for run in found] == [20.0, 480.0]
    best = unit_runs.best_of(found, design_of(FULL))
    assert best.key == large.key
    assert best.ranking == [("alpha4", 0.05), ("alpha10", 0.4)]
    # One that was stopped, or has just begun, does not hide it either.
    ran(tmp_path, attrs.evolve(FULL, times=5), RANKED | {"status": "interrupted"}, 300)
    assert unit_runs.best_of(unit_runs.runs(tmp_path), design_of(FULL)).key == large.key


def test_going_back_to_a_parameter_finds_its_run_again(tmp_path):
    first = ran(tmp_path, FULL, RANKED, 100)
    second = ran(tmp_path, thicker(FULL, 1.0), RANKED, 200)
    found = unit_runs.runs(tmp_path)
    assert unit_runs.best_of(found, design_of(FULL)).key == first.key
    assert unit_runs.best_of(found, design_of(thicker(FULL, 1.0))).key == second.key
    # Of a third design there is none: the latest is shown, and its design says that it is stale.
    third = design_of(thicker(FULL, 1.1))
    shown = unit_runs.best_of(found, third)
    assert shown.key == second.key
    assert shown.design != third
    assert unit_runs.place_of(tmp_path, FULL)[0] == first.folder
    # Nor does one that has just begun take its place, until it has something to show.
    begun = ran(tmp_path, thicker(FULL, 1.1), {"status": "running"}, 300)
    assert unit_runs.best_of(unit_runs.runs(tmp_path), third).key == second.key
    ran(tmp_path, thicker(FULL, 1.1), SHORT | {"status": "running"}, 400)
    assert unit_runs.best_of(unit_runs.runs(tmp_path), third).key == begun.key


@pytest.mark.parametrize(
    ("summary", "words"),
    [
        (RANKED, "complete"),
        ({"status": "cancelled", "angle_deg": {"-40": 9.0, "10": 1.0}}, "cancelled; motion up to -40 kPa"),
        ({"status": "cancelled", "angle_deg": {"-40": 9.0}, "solver": {}}, "cancelled; motion complete"),
        ({"status": "partial", "reason": {"what": "stopped by Ctrl-C"}}, "cancelled; no motion yet"),
        (
            {"status": "partial", "reason": {"what": "no equilibrium"}, "solver": {}, "chosen": "alpha4"},
            "stopped: no equilibrium; ranking complete",
        ),
        # Nobody works in its folder: it was killed.
        ({"status": "running", "solver": {}, "angle_deg": {"-40": 9.0}}, "interrupted; motion complete"),
    ],
)
def test_how_a_run_ended_in_words(tmp_path, summary, words):
    assert ran(tmp_path, FULL, summary, 100).state == words


def test_a_run_that_goes_on_says_so(tmp_path):
    run = ran(tmp_path, FULL, {"status": "running"}, 100)
    lock = FolderLock(run.folder)
    assert run.state == "running; no motion yet"
    lock.release()


def test_runs_are_compared_where_both_have_been(tmp_path):
    far = ran(tmp_path, FULL, {"status": "complete", "angle_deg": {"0": 0.0, "-20": 4.0, "-40": 9.0}}, 100)
    short = ran(
        tmp_path, thicker(FULL, 1.1), {"status": "cancelled", "angle_deg": {"0": 0.0, "-20": 5.0}}, 200
    )
    rows = {row.what: row.values for row in compare([far, short])}
    assert rows["At -20 kPa"] == ("+4.00", "+5.00")
    assert "At -40 kPa" not in rows


def test_further_stages_and_a_new_name_take_up_the_run_of_the_same_inputs(tmp_path):
    run = ran(tmp_path, MOTION, SHORT, 100)
    assert unit_runs.place_of(tmp_path, FULL)[0] == run.folder
    renamed = attrs.evolve(FULL, unit=attrs.evolve(FULL.unit, name="renamed"))
    folder, job = unit_runs.place_of(tmp_path, renamed)
    assert folder == run.folder
    (folder / "motion.csv").write_text("found")
    write_study(job, folder)
    assert (folder / "motion.csv").read_text() == "found", "a new name sets nothing aside"
    assert design_of(renamed) == run.design
    assert unit_runs.place_of(tmp_path, attrs.evolve(FULL, times=5))[0] != run.folder


def test_names_and_stars(tmp_path):
    run = ran(tmp_path, FULL, RANKED, 100)
    assert (run.title, run.starred) == ("Ranking", False)
    unit_runs.label(run, " thin wall ", True)
    (run,) = unit_runs.runs(tmp_path)
    assert (run.title, run.starred) == ("thin wall", True)
    for name in ("x" * 81, "two\nlines"):
        with pytest.raises(InputError, match="name of a run"):
            unit_runs.label(run, name, False)
    unit_runs.label(run, "", False)
    (run,) = unit_runs.runs(tmp_path)
    assert (run.title, run.starred) == ("Ranking", False)


def test_a_removed_run_frees_its_folder_and_nothing_else(tmp_path):
    kept = ran(tmp_path, FULL, RANKED, 100)
    gone = ran(tmp_path, COARSE, SHORT, 200)
    (gone.folder / "motion").mkdir()
    (gone.folder / "motion" / "mesh.npz").write_bytes(b"x" * 5000)
    assert unit_runs.bytes_of(gone) > 5000
    lock = FolderLock(gone.folder)
    with pytest.raises(InUseError):
        unit_runs.remove(gone)
    lock.release()
    assert (gone.folder / "motion" / "mesh.npz").exists()
    unit_runs.remove(gone)
    assert [path.name for path in (tmp_path / "runs").iterdir()] == [kept.key]
    assert [run.key for run in unit_runs.runs(tmp_path)] == [kept.key]


def test_what_an_older_version_left_is_listed_and_removed_alone(tmp_path):
    write_study(FULL, tmp_path)
    (tmp_path / "summary.json").write_text(json.dumps(RANKED))
    write_study(thicker(FULL, 1.0), tmp_path)  # sets the first aside
    (tmp_path / "summary.json").write_text(json.dumps(SHORT))
    (tmp_path / "evidence").mkdir()
    (tmp_path / "evidence" / "verdict.json").write_text("{}")
    found = unit_runs.runs(tmp_path)
    assert {run.key for run in found} == {"home", "stale"}
    assert unit_runs.best_of(found, design_of(FULL)).key == "stale"
    assert unit_runs.place_of(tmp_path, thicker(FULL, 1.0))[0] == tmp_path
    new = ran(tmp_path, thicker(FULL, 1.1), RANKED, 300)
    assert new.folder.parent == tmp_path / "runs"
    unit_runs.remove(next(run for run in found if run.key == "home"))
    assert {run.key for run in unit_runs.runs(tmp_path)} == {"stale", new.key}
    assert not (tmp_path / "study.toml").exists()
    assert (tmp_path / "evidence" / "verdict.json").exists()


def test_what_is_no_run_is_left_out(tmp_path):
    run = ran(tmp_path, FULL, RANKED, 100)
    broken = tmp_path / "runs" / "broken"
    broken.mkdir()
    (broken / "study.toml").write_text("nonsense [")
    (tmp_path / "runs" / "note.txt").write_text("the user's own")
    assert [found.key for found in unit_runs.runs(tmp_path)] == [run.key]
    with pytest.raises(InputError):
        unit_runs.read_run(broken)
    (run.folder / "summary.json").write_text("[1, 2")
    (damaged,) = unit_runs.runs(tmp_path)
    assert (damaged.complete, damaged.angles) == (False, [])
    assert unit_runs.runs(tmp_path / "nowhere") == []


def test_a_home_moves_whole_or_not_at_all(tmp_path):
    old, new = tmp_path / "unsaved", tmp_path / "seat.mu" / "unit"
    run = ran(old, FULL, RANKED, 100)
    lock = FolderLock(run.folder)
    assert not unit_runs.move_home(old, new)
    lock.release()
    assert unit_runs.move_home(old, new)
    assert not old.exists()
    assert [found.key for found in unit_runs.runs(new)] == [run.key]
    assert [path.name for path in new.parent.iterdir()] == ["unit"]
    ran(old, FULL, SHORT, 200)
    assert not unit_runs.move_home(old, new), "what is there is not replaced"
    assert unit_runs.runs(new)[0].ranking


def test_runs_side_by_side(tmp_path):
    one = ran(tmp_path, FULL, RANKED, 100)
    other = ran(tmp_path, thicker(MOTION, 1.0), SHORT | {"angle_deg": {"-20": -2.0, "40": 4.5}}, 200)
    rows = {row.what: row for row in compare([one, other])}
    assert rows["wall"].values == ("0.9", "1")
    assert rows["wall"].unit == "mm"
    assert rows["job"].values == ("ranking", "motion")
    assert rows["At 40 kPa"].values == ("+6.00", "+4.50")
    assert rows["Its deviation"].values == ("0.0500", "-")
    assert rows["Time taken"].values == ("480", "40")
    # What they share is not listed.
    assert {"scale", "cell", "element order", "protocol", "paths"}.isdisjoint(rows)
