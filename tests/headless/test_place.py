"""The main job on a coarse mesh: through plain Python, through bpy, interrupted and resumed."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points
from mu_addon.simulate_and_place.settings import STAGES

from ..report.browser import EXECUTABLE, Browser, complaints, requests
from .processes import PATIENCE_S, ROOT, RUN, UNIT, coarse, command, here, run, worker_of

PATHS = ["alpha1"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory, with_light):
    folder = with_light(tmp_path_factory.mktemp("place") / "out")
    done = here(*coarse(folder), "--workers", "1")
    assert done.returncode == 0, done.stderr
    return folder, done


def quick_in(folder, **changes):
    """Without a second mesh: it shows as well that a run comes to the same digits by another way."""
    return coarse(folder, **({"mesh_check": False} | changes))


@pytest.fixture(scope="module")
def quick(tmp_path_factory, with_light):
    """The same run without a second mesh, for what is compared with itself."""
    folder = with_light(tmp_path_factory.mktemp("quick") / "out")
    done = run(*quick_in(folder), "--no-report")
    assert done.returncode == 0, done.stderr
    return folder


def rows(folder):
    with (folder / "deviation.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_file_is_there(finished):
    folder, _ = finished
    summary = json.loads((folder / "summary.json").read_text())
    chosen = summary["chosen"]
    for name in (
        "unit.stl",
        f"unit_{chosen}.stl",
        "anchors.txt",
        "mesh.vtu",
        "model_a.pvd",
        "motion.csv",
        "deviation.csv",
        "delta.npz",
        "sensitivity.vtu",
        "signals.csv",
        "summary.json",
        "report.html",
        "motion/angle.png",
        "study.toml",
        "unit.toml",
        "protocol.csv",
        "log.ndjson",
    ):
        assert (folder / name).stat().st_size > 0, name
    assert not list(folder.rglob("*.part*"))


def test_deviation_has_a_row_a_path(finished):
    folder, _ = finished
    found = rows(folder)
    assert list(found[0])[:6] == ["path", "start", "length", "J_hat_mm", "J_cont_mm", "rank"]
    assert [row["path"] for row in found] == PATHS
    J = np.array([float(row["J_hat_mm"]) for row in found])
    assert (J > 0).all()
    assert [int(row["rank"]) for row in found] == list(np.argsort(np.argsort(J)) + 1)
    # A path is tied if the mesh's uncertainty does not part it from the chosen one, which is its own.
    summary = json.loads((folder / "summary.json").read_text())
    (limit,) = {float(row["mesh_uncertainty_mm"]) for row in found}
    assert limit == pytest.approx(summary["mesh_uncertainty_mm"], rel=0.01)
    tied = [row["path"] for row in found if row["tied_with_chosen"] == "yes"]
    assert tied == summary["tied_with_chosen"]
    assert all((J[PATHS.index(path)] - J.min()) < 1.01 * limit for path in tied)


def test_delta_agrees_with_the_table(finished):
    folder, _ = finished
    with np.load(folder / "delta.npz", allow_pickle=False) as stored:
        delta, pressure = stored["delta_mm"], stored["pressure_kPa"]
        assert delta.shape == (1, 4, 11)
        np.testing.assert_allclose(pressure, [0, -1, 0, 2])
    J = [float(row["J_hat_mm"]) for row in rows(folder)]
    np.testing.assert_allclose(delta.mean(axis=(1, 2)), J, rtol=1e-8)


def test_light_is_weighed_beside_disturbance(finished):
    folder, _ = finished
    with (folder / "signals.csv").open(newline="") as file:
        found = {row["path"]: row for row in csv.DictReader(file)}
    assert list(found) == PATHS
    front = [row for row in found.values() if row["pareto"] == "1"]
    least = min(found.values(), key=lambda row: float(row["J_hat_mm"]))
    most = max(found.values(), key=lambda row: abs(float(row["sensitivity_per_deg"])))
    assert least in front
    assert most in front
    angles = json.loads((folder / "summary.json").read_text())["angle_deg"].values()
    for row in found.values():
        # Of a slope, per degree: over the whole motion a tenth of the light at most.
        assert 0 < float(row["its_error"]) * (max(angles) - min(angles)) < 0.1
        assert float(row["monotonic_from_deg"]) <= 0 <= float(row["monotonic_to_deg"])
        assert 0 < float(row["transmitted_at_rest"]) < 1


def test_summary_tells_what_a_reader_needs(finished):
    folder, _ = finished
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["status"] == "complete"
    angle = {float(p): a for p, a in summary["angle_deg"].items()}
    assert list(angle) == sorted(angle)
    assert angle[-1.0] < 0 == angle[0.0] < angle[2.0]
    for name in ("parameters", "mesh", "solver", "J_hat_mm", "J_cont_mm", "seconds", "versions", "gates"):
        assert summary[name], name
    assert summary["mesh_uncertainty_mm"] > 0
    assert summary["mesh"]["inverted"] == 0
    assert summary["solver"]["largest_relative_residual"] < 1e-8


def test_mesh_and_motion_open_in_meshio(finished):
    folder, _ = finished
    mesh = meshio.read(folder / "mesh.vtu")
    assert {block.type for block in mesh.cells} == {"tetra10"}
    steps = ET.parse(folder / "model_a.pvd").getroot().findall("Collection/DataSet")
    assert len(steps) == 4
    last = meshio.read(folder / steps[3].get("file"))
    assert np.abs(last.point_data["displacement_mm"]).max() > 0.1


@pytest.mark.skipif(EXECUTABLE is None, reason="no chromium here")
def test_the_report_of_a_real_run_opens_whole_in_a_browser(finished):
    folder, _ = finished
    with Browser() as browser:
        browser.screen(390, 844, True)
        browser.open(folder / "report.html")
        images = browser.evaluate("[...document.images].map(i => i.complete && i.naturalWidth > 0)")
        assert len(images) > 10
        assert all(images)
        assert complaints(browser) == []
        assert requests(browser) == []


@pytest.fixture(scope="module")
def searched(tmp_path_factory, with_light):
    """A search of the whole lattice, with limits that leave few paths, after the same study's windows."""
    folder = with_light(tmp_path_factory.mktemp("search") / "out")
    done = run(
        *quick_in(folder, paths="graph", shortest_cells=2.0, longest_cells=2.0, bend_deg=20.0), "--no-report"
    )
    assert done.returncode == 0, done.stderr
    return folder, done


@pytest.mark.nightly(
    "tests/placement/test_search.py::test_paths_that_cannot_be_made_are_left_out_and_the_best_of_the_rest_is_found"
)
def test_the_whole_lattice_is_searched_for_the_best_path(searched):
    folder, done = searched
    found = json.loads((folder / "summary.json").read_text())["search"]
    with (folder / "paths.csv").open(newline="") as file:
        paths = list(csv.DictReader(file))
    assert len(paths) == found["paths"] >= found["checked"] >= 2
    solved = [float(p["J_hat_mm"]) for p in paths if p["J_hat_mm"]]
    assert len(solved) == found["checked"]
    assert paths[0]["path"] == found["best"]["name"]
    assert solved[0] == pytest.approx(found["best"]["J_hat_mm"]) == min(solved)
    assert found["best"]["name"] in done.stdout
    low, high = 2 * 12.5, 2 * 12.5
    assert all(low - 1e-6 <= float(p["length_mm"]) <= high + 1e-6 for p in paths)


@pytest.mark.nightly("tests/studies/test_motion.py::test_a_path_off_the_mirror_plane_moves_both_sides_apart")
def test_a_window_of_anchors_is_one_of_the_lattices_paths(searched):
    """The same path by two ways: the half mesh for windows, the whole one for the lattice's."""
    folder, _ = searched
    with (folder / "paths.csv").open(newline="") as file:
        solved = {p["points_mm"]: p["J_hat_mm"] for p in csv.DictReader(file)}
    with (folder / "anchors.txt").open() as file:
        assert file.read()
    every = {row["path"]: float(row["J_hat_mm"]) for row in rows(folder)}
    points = anchor_points(UNIT)
    text = "; ".join(" ".join(f"{c:.6g}" for c in point) for point in points)
    assert float(solved[text]) == pytest.approx(every["alpha1"], rel=2e-3)


def started(out):
    words = command(*quick_in(out))
    return subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )


def wait_for_a_state_swept(process, out):
    deadline = time.monotonic() + PATIENCE_S
    while not list((out / "cache").glob("candidates-*")) and time.monotonic() < deadline:
        assert process.poll() is None, "it ended before it could be stopped"
        time.sleep(0.05)


def alive(group):
    """Whether any process of a group still runs."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_killed_it_leaves_no_process_behind_and_does_not_pass_for_complete(tmp_path):
    out = tmp_path / "out"
    process = started(out)
    wait_for_a_state_swept(process, out)
    # Whoever watches, and the group of those who work.
    groups = process.pid, os.getpgid(worker_of(out))
    assert groups[0] != groups[1]
    process.kill()
    process.communicate(timeout=PATIENCE_S)
    deadline = time.monotonic() + PATIENCE_S
    while any(map(alive, groups)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(map(alive, groups))
    assert json.loads((out / "summary.json").read_text())["status"] == "running"


@pytest.fixture
def interrupted(tmp_path, with_light):
    """Folder of a run that was stopped among its candidates, and what it said."""
    for attempt in range(3):
        out = with_light(tmp_path / str(attempt))
        process = started(out)
        wait_for_a_state_swept(process, out)
        # As a terminal does it: to every process of the group.
        os.killpg(process.pid, signal.SIGINT)
        in_time = not (out / "report.html").exists()
        output, errors = process.communicate(timeout=PATIENCE_S)
        # On a busy machine the run may have got further than its candidates.
        if in_time:
            break
    assert process.returncode == 130, errors
    return out, output + errors


def test_interrupted_it_keeps_what_it_has(interrupted):
    out, said = interrupted
    assert "Traceback" not in said
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "partial"
    assert "Ctrl-C" in summary["reason"]["what"]
    report = (out / "report.html").read_text()
    assert "This run is partial" in report
    # They take most of its time, and somebody waits.
    assert "This report has no pictures" in report
    assert "image/png" not in report
    assert (out / "unit.stl").exists()


def same_delta(one, other):
    """Whether two runs found the same, to the last digit."""
    with np.load(one / "delta.npz") as a, np.load(other / "delta.npz") as b:
        return set(a.files) == set(b.files) and all(np.array_equal(a[n], b[n]) for n in a.files)


@pytest.mark.parametrize(
    "job", ["simulate", pytest.param("place", marks=pytest.mark.nightly("test_it_is_the_same_inside_bpy"))]
)
def test_it_is_the_same_inside_bpy(request, with_light, tmp_path, job):
    pytest.importorskip("bpy", reason="the bpy wheel is for Python 3.11 only")
    out, stages = with_light(tmp_path / "out"), STAGES[: STAGES.index(job) + 1]
    words = [str(word) for word in quick_in(out, stages=stages)]
    script = f"""
import bpy, runpy, sys
sys.argv = ["blender", "-b", "-P", {str(RUN)!r}, "--", *{words!r}, "--no-report"]
runpy.run_path({str(RUN)!r}, run_name="__main__")
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=PATIENCE_S, cwd=ROOT.parent
    )
    assert done.returncode == 0, done.stderr
    if job == "place":
        other = request.getfixturevalue("quick")
        assert same_delta(out, other)
    else:
        other = tmp_path / "here"
        assert here(*quick_in(other, stages=stages), "--no-report").returncode == 0
    assert (out / "motion.csv").read_bytes() == (other / "motion.csv").read_bytes()
