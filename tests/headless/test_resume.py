"""`resume`: a folder is enough to go on with a study, after kill -9 too; one process has it at a time."""

import json
import os
import signal
import subprocess
import time

import attrs
import numpy as np
import pytest

from mu_addon.run.folder import keep_inputs

from .processes import JOB, ROOT, assert_clear_failure, command, here, is_running, run, worker_of

# Without a second mesh: it shows as well that a run comes to the same digits by another way.
QUICK = attrs.evolve(JOB, mesh_check=False)


def resumed(folder):
    done = here("resume", folder, "--no-report", "--workers", "1", "--json")
    assert done.returncode == 0, done.stdout
    return json.loads(done.stdout.splitlines()[-1])["summary"]


@pytest.mark.parametrize(("given", "report"), [((), False), (("--report",), True)])
def test_it_keeps_the_options_of_the_command(tmp_path, given, report):
    """Those that decide no result are in no file of inputs; the command's own options come before them."""
    data = ROOT / "assets" / "examples" / "paper-moduli"
    assert here("diagnose", data, "--no-report", "--out", tmp_path).returncode == 0
    assert here("resume", tmp_path, *given).returncode == 0
    assert (tmp_path / "report.html").exists() == report


def test_a_folder_chooses_no_scheduler(tmp_path):
    """Workers run what a scheduler sends: a folder from a stranger would run code. It is said how to."""
    assert here("design", "--preset", "mu-0.75x", "--no-report", "--out", tmp_path).returncode == 0
    path = tmp_path / "summary.json"
    summary = json.loads(path.read_text())
    summary["options"] = {"report": False, "scheduler": "tcp://there:8786", "workers": 2}
    path.write_text(json.dumps(summary))
    done = here("resume", tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"resume {tmp_path} --scheduler tcp://there:8786" in done.stderr
    summary["options"] = {"device": 7}
    path.write_text(json.dumps(summary))
    assert_clear_failure(here("resume", tmp_path), 2, "device")


def group_runs(group):
    """Whether any process of a group still runs."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


NIGHTLY = pytest.mark.nightly("test_killed_at_any_stage_it_goes_on_to_the_same_digits")


@pytest.mark.parametrize(
    "pattern",
    [
        pytest.param("unit.stl", marks=NIGHTLY),
        pytest.param("cache/meshed-*", marks=NIGHTLY),
        pytest.param("cache/states-*", marks=NIGHTLY),
        "cache/candidates-*",
    ],
)
def test_killed_at_any_stage_it_goes_on_to_the_same_digits(finished, with_light, tmp_path, pattern):
    """It leaves no process behind, and does not pass for complete."""
    expected = json.loads((finished / "summary.json").read_text())
    keep_inputs(with_light(tmp_path), QUICK.texts())
    words = command("resume", tmp_path, "--no-report")
    process = subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    while not list(tmp_path.glob(pattern)):
        assert process.poll() is None
        time.sleep(0.002)
    worker = worker_of(tmp_path)
    # Whoever watches, and the group of those who work.
    groups = process.pid, os.getpgid(worker)
    assert groups[0] != groups[1]
    process.kill()
    process.wait()
    # It ends once its input does, and has the folder until then.
    while is_running(worker) or any(map(group_runs, groups)):
        time.sleep(0.002)
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "running"
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "cache").glob("*.npz")}
    found = resumed(tmp_path)
    assert found["J_hat_mm"] == expected["J_hat_mm"]
    assert found["angle_deg"] == expected["angle_deg"]
    with np.load(tmp_path / "delta.npz") as a, np.load(finished / "delta.npz") as b:
        assert a.files == b.files
        assert all(np.array_equal(a[name], b[name]) for name in a.files)
    # What was finished was not computed again.
    for name, written in kept.items():
        assert (tmp_path / "cache" / name).stat().st_mtime_ns == written, name


def test_a_second_run_in_the_folder_is_refused_and_names_the_first(tmp_path):
    keep_inputs(tmp_path, QUICK.texts())
    first = subprocess.Popen(
        command("resume", tmp_path, "--no-report"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while not list(tmp_path.glob("cache/meshed-*")):
        assert first.poll() is None
        time.sleep(0.01)
    worker = worker_of(tmp_path)
    os.kill(worker, signal.SIGSTOP)  # it holds its lock however long the second takes to start
    second = run("design", "--preset", "mu-0.75x", "--out", tmp_path)
    assert first.poll() is None
    assert_clear_failure(second, 2, "another run uses this folder", f"process {first.pid} ", "what to do")
    assert not (tmp_path / "stale").exists()
    first.kill()
    first.wait()


def test_a_folder_without_a_study_is_told(tmp_path):
    assert_clear_failure(here("resume", tmp_path), 2, "this folder contains no study", "study.toml")
