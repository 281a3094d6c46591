"""The main job on a coarse mesh: through plain Python, through bpy, interrupted and resumed."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest

from mu_addon.design.anchors import anchor_points
from mu_addon.simulate_and_place.settings import STAGES

from ..report.browser import EXECUTABLE, Browser, complaints, requests
from .processes import PATIENCE_S, ROOT, RUN, UNIT, coarse, run

PATHS = ["alpha1"]
FILES = """
study.toml unit.toml protocol.csv log.ndjson summary.json report.html unit.stl anchors.txt mesh.vtu
model_a.pvd motion.csv motion/angle.png deviation.csv delta.npz sensitivity.vtu signals.csv
"""


def quick_in(folder, **changes):
    """Without a second mesh: it shows as well that a run comes to the same digits by another way."""
    return coarse(folder, **({"mesh_check": False} | changes))


def rows(folder):
    with (folder / "deviation.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_file_is_there(finished):
    chosen = json.loads((finished / "summary.json").read_text())["chosen"]
    for name in (*FILES.split(), f"unit_{chosen}.stl"):
        assert (finished / name).stat().st_size > 0, name
    assert not list(finished.rglob("*.part*"))


def test_deviation_has_a_row_a_path(finished):
    found = rows(finished)
    assert list(found[0])[:6] == ["path", "start", "length", "J_hat_mm", "J_cont_mm", "rank"]
    assert [row["path"] for row in found] == PATHS
    J = np.array([float(row["J_hat_mm"]) for row in found])
    assert (J > 0).all()
    assert [int(row["rank"]) for row in found] == list(np.argsort(np.argsort(J)) + 1)
    # A path is tied if the mesh's uncertainty does not part it from the chosen one, which is its own.
    summary = json.loads((finished / "summary.json").read_text())
    (limit,) = {float(row["mesh_uncertainty_mm"]) for row in found}
    assert limit == pytest.approx(summary["mesh_uncertainty_mm"], rel=0.01)
    tied = [row["path"] for row in found if row["tied_with_chosen"] == "yes"]
    assert tied == summary["tied_with_chosen"]
    assert all((J[PATHS.index(path)] - J.min()) < 1.01 * limit for path in tied)


def test_delta_agrees_with_the_table(finished):
    with np.load(finished / "delta.npz", allow_pickle=False) as stored:
        delta, pressure = stored["delta_mm"], stored["pressure_kPa"]
        assert delta.shape == (1, 4, 11)
        np.testing.assert_allclose(pressure, [0, -1, 0, 2])
    J = [float(row["J_hat_mm"]) for row in rows(finished)]
    np.testing.assert_allclose(delta.mean(axis=(1, 2)), J, rtol=1e-8)


def test_light_is_weighed_beside_disturbance(finished):
    with (finished / "signals.csv").open(newline="") as file:
        found = {row["path"]: row for row in csv.DictReader(file)}
    assert list(found) == PATHS
    front = [row for row in found.values() if row["pareto"] == "1"]
    least = min(found.values(), key=lambda row: float(row["J_hat_mm"]))
    most = max(found.values(), key=lambda row: abs(float(row["sensitivity_per_deg"])))
    assert least in front
    assert most in front
    angles = json.loads((finished / "summary.json").read_text())["angle_deg"].values()
    for row in found.values():
        # Of a slope, per degree: over the whole motion a tenth of the light at most.
        assert 0 < float(row["its_error"]) * (max(angles) - min(angles)) < 0.1
        assert float(row["monotonic_from_deg"]) <= 0 <= float(row["monotonic_to_deg"])
        assert 0 < float(row["transmitted_at_rest"]) < 1


def test_summary_tells_what_a_reader_needs(finished):
    summary = json.loads((finished / "summary.json").read_text())
    assert summary["status"] == "complete"
    angle = {float(p): a for p, a in summary["angle_deg"].items()}
    assert list(angle) == sorted(angle)
    assert angle[-1.0] < 0 == angle[0.0] < angle[2.0]
    for name in ("parameters", "mesh", "solver", "J_hat_mm", "J_cont_mm", "seconds", "versions", "gates"):
        assert summary[name], name
    assert summary["mesh_uncertainty_mm"] > 0
    assert summary["mesh"]["inverted"] == 0
    assert summary["solver"]["largest_relative_residual"] < 1e-8


@pytest.mark.skipif(EXECUTABLE is None, reason="no chromium here")
def test_the_report_of_a_real_run_opens_whole_in_a_browser(finished):
    with Browser() as browser:
        browser.screen(390, 844, True)
        browser.open(finished / "report.html")
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


def same_delta(one, other):
    """Whether two runs found the same, to the last digit."""
    with np.load(one / "delta.npz") as a, np.load(other / "delta.npz") as b:
        return set(a.files) == set(b.files) and all(np.array_equal(a[n], b[n]) for n in a.files)


@pytest.mark.parametrize(
    "job", ["simulate", pytest.param("place", marks=pytest.mark.nightly("test_it_is_the_same_inside_bpy"))]
)
def test_it_is_the_same_inside_bpy(finished, with_light, tmp_path, job):
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
        assert same_delta(out, finished)
    assert (out / "motion.csv").read_bytes() == (finished / "motion.csv").read_bytes()
