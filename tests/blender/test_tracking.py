"""Blender's tracker on pictures of a known motion, from the command line."""

import json

import numpy as np
import pytest

from mu_addon.lab_files.tracked_table import read_pixels
from mu_addon.measured import read_folder
from tests.headless.processes import assert_clear_failure, run

from .filming import ANGLES, MM_PER_PIXEL, described, film, pressures
from .session import Blender, needs_bpy

pytestmark = needs_bpy


def tracked(folder, truth, marks, *more):
    described(folder, truth, marks)
    pressures(folder, ANGLES)
    done = run("track", folder / "shot0001.png", "--markers", folder / "bench.toml", *more,
               "--pressure", folder / "pressure.csv", "--out", folder / "measured")  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done, read_folder(folder / "measured").experiments[0]


@pytest.mark.parametrize(
    ("marks", "pixels", "degrees"),
    [
        ("crosses", 0.03, 0.03),
        pytest.param("dots", 0.06, 0.08, marks=pytest.mark.nightly("test_a_known_motion_is_recovered")),
    ],
)
def test_a_known_motion_is_recovered(tmp_path, marks, pixels, degrees):
    """A marker read off the screen to a whole pixel keeps that offset; what counts is how far it strays."""
    truth = film(tmp_path, ANGLES, marks)
    done, e = tracked(tmp_path, truth, marks)
    seen = read_pixels(tmp_path / "measured" / "filmed.pixels.csv").pixels
    along = np.radians(ANGLES)[None, :, None] * (np.arange(4) > 1)[:, None, None]
    start = seen[:, :1] - truth[:, :1]
    turn = (
        np.array([[1, 0], [0, 1]]) * np.cos(along)[..., None]
        + np.array([[0, -1], [1, 0]]) * np.sin(along)[..., None]
    )
    offset = np.einsum("mnij,mkj->mni", turn, start) if marks == "crosses" else start
    strayed = seen - truth - offset
    assert np.sqrt(np.mean(strayed**2)) < pixels
    assert np.sqrt(np.mean((e["angle_deg"] - ANGLES) ** 2)) < degrees
    assert json.loads((tmp_path / "measured" / "summary.json").read_text())["mm_per_pixel"] == pytest.approx(
        MM_PER_PIXEL, rel=0.01
    )
    assert "angle:" in done.stdout


def test_a_marker_that_is_covered_leaves_a_gap(tmp_path):
    """From frame 20 on a hand covers one marker: the tracker must not make something up."""
    truth = film(tmp_path, ANGLES, hidden={(3, frame) for frame in range(20, 40)})
    done, e = tracked(tmp_path, truth, "crosses")
    assert np.isfinite(e["angle_deg"][:20]).all()
    assert np.isnan(e["angle_deg"][21:]).all()
    assert "marker 'tip b' is lost in" in done.stderr
    assert np.isfinite(e.markers[1][:, 1:]).all()


def test_clips_that_cannot_be_used(tmp_path):
    truth = film(tmp_path, ANGLES[:3])
    described(tmp_path, truth)
    pressures(tmp_path, ANGLES[:3])
    words = [
        "--markers",
        tmp_path / "bench.toml",
        "--pressure",
        tmp_path / "pressure.csv",
        "--out",
        tmp_path / "out",
    ]
    (tmp_path / "torn.mp4").write_bytes(b"no film")
    assert_clear_failure(run("track", tmp_path / "torn.mp4", *words), 2, "Blender", "torn.mp4")
    text = (tmp_path / "bench.toml").read_text()
    (tmp_path / "bench.toml").write_text(text.replace("pixel = [", "pixel = [900", 1))
    assert_clear_failure(
        run("track", tmp_path / "shot0001.png", *words), 2, "is outside the picture of 360 x 340"
    )


@pytest.mark.slow
def test_a_compressed_movie_brings_its_own_clock(each_bpy, tmp_path):
    """H.264, as cameras write it: its frame rate is read from it, and compression costs little."""
    truth = film(tmp_path, ANGLES)
    blender = Blender(each_bpy, tmp_path)
    blender.call(
        "tests.blender.inside.movies",
        "write_movie",
        folder=tmp_path,
        shots=tmp_path,
        movie=tmp_path / "bench.mp4",
    )
    blender.close()
    described(tmp_path, truth)
    text = (tmp_path / "bench.toml").read_text()
    (tmp_path / "bench.toml").write_text(text.replace("fps = 10", ""))
    (tmp_path / "pressure.csv").write_text("time_s,pressure_kPa\n0,0\n0.04,0\n0.8,5\n1.56,0\n")
    done = run("track", tmp_path / "bench.mp4", "--markers", tmp_path / "bench.toml",
               "--pressure", tmp_path / "pressure.csv", "--out", tmp_path / "out")  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    (e,) = read_folder(tmp_path / "out").experiments
    np.testing.assert_allclose(e["time_s"], np.arange(40) / 25, atol=1e-6)
    assert np.sqrt(np.mean((e["angle_deg"] - ANGLES) ** 2)) < 0.05
