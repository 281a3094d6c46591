"""Blender's tracker on pictures of a known motion, by its editor's operators and from the command line."""

import json

import numpy as np
import pytest

from mu_addon.measured import read_folder
from mu_addon.usecases.track_video.run import read_pixels
from tests.headless.processes import assert_clear_failure, run

from .filming import MM_PER_PIXEL, described, film, pressures
from .session import blender, needs_bpy

pytestmark = needs_bpy

TURN = np.linspace(0.0, 2 * np.pi, 38)
# Three frames of rest, then a swing to either side, by up to 8 degrees a frame.
ANGLES = np.concatenate([[0.0, 0.0], 40.0 * np.sin(TURN) - 10.0 * (1.0 - np.cos(TURN))])


def tracked(folder, truth, marks, *more):
    described(folder, truth, marks)
    pressures(folder, ANGLES)
    done = run("track", folder / "shot0001.png", "--markers", folder / "bench.toml", *more,
               "--pressure", folder / "pressure.csv", "--out", folder / "measured")  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done, read_folder(folder / "measured").experiments[0]


@pytest.mark.parametrize(("marks", "pixels", "degrees"), [("crosses", 0.03, 0.03), ("dots", 0.06, 0.08)])
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


MOVIE = """
import os
scene = bpy.context.scene
shots = sorted(name for name in os.listdir(sys.argv[1]) if name.endswith(".png"))
editor = scene.sequence_editor_create()
strips = editor.strips if hasattr(editor, "strips") else editor.sequences
strip = strips.new_image("bench", os.path.join(sys.argv[1], shots[0]), 1, 1)
for name in shots[1:]:
    strip.elements.append(name)
scene.frame_end, scene.render.fps, scene.view_settings.view_transform = len(shots), 25, "Standard"
scene.render.resolution_x, scene.render.resolution_y = 360, 340
settings = scene.render.image_settings
if hasattr(settings, "media_type"):
    settings.media_type = "VIDEO"
settings.file_format, scene.render.filepath = "FFMPEG", sys.argv[2]
scene.render.ffmpeg.format, scene.render.ffmpeg.codec = "MPEG4", "H264"
scene.render.ffmpeg.constant_rate_factor = "HIGH"
bpy.ops.render.render(animation=True)
"""


@pytest.mark.slow
def test_a_compressed_movie_brings_its_own_clock(tmp_path):
    """H.264, as cameras write it: its frame rate is read from it, and compression costs little."""
    truth = film(tmp_path, ANGLES)
    blender(MOVIE, tmp_path, tmp_path, tmp_path / "bench.mp4")
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


EDITOR = """
def editor(clip):
    window = bpy.context.window_manager.windows[0]
    area = window.screen.areas[0]
    area.ui_type = "CLIP_EDITOR"
    area.spaces.active.clip = clip
    region = next(r for r in area.regions if r.type == "WINDOW")
    return bpy.context.temp_override(window=window, area=area, region=region)

from mu_addon.blender.track import properties as bench, state as tracking
from mu_addon.usecases.track_video.run import Marks
"""


def test_the_clip_editors_operators(tmp_path):
    """Markers as the user places them, roles chosen in the sidebar, saved and loaded, written twice."""
    truth = film(tmp_path / "clip", ANGLES)
    pressures(tmp_path, ANGLES)
    at = {name: (float(x), float(y)) for name, (x, y) in zip("abcd", truth[:, 0], strict=True)}
    blender(
        EDITOR
        + f"""
at = {at!r}
folder = {str(tmp_path)!r}
root = add()
clip = bpy.data.movieclips.load(folder + "/clip/shot0001.png")
with editor(clip):
    assert not bpy.ops.mu.track.poll() and not bpy.ops.mu.track_write.poll()
    assert "Place markers first" in bench.missing(clip)
    for name, pixel in at.items():
        tracking._place(clip, name, pixel, Marks({{}}), "")
    assert bpy.ops.mu.track() == {{"FINISHED"}}
settings = clip.mu_bench
settings.base_1 = "a"
assert "Base: choose two" in bench.missing(clip)
settings.base_2, settings.tip_1, settings.tip_2 = "b", "c", "d"
assert "Give the places" in bench.missing(clip)
settings.base_1_mm, settings.base_2_mm = (-15, 0), (15, 0)
assert "frames a second" in bench.missing(clip)
settings.fps = 10
assert "pressure" in bench.missing(clip)
settings.pressure = folder + "/pressure.csv"
bpy.ops.wm.save_as_mainfile(filepath=folder + "/bench.blend")
assert "folder to write into" in bench.missing(clip)
settings.folder = "//measured"
settings.title, settings.role, settings.specimen = "by hand", "held_out", "B"
bpy.ops.wm.save_mainfile()
bpy.ops.wm.open_mainfile(filepath=folder + "/bench.blend")
(clip,) = bpy.data.movieclips
assert clip.mu_bench.tip_2 == "d" and not bench.missing(clip)
with editor(clip):
    assert bpy.ops.mu.track_write() == {{"FINISHED"}}
assert unit_object.active_root(bpy.context).mu_evidence.folder == "//measured"
assert bpy.ops.mu.track_write(clip=clip.name) == {{"FINISHED"}}
clip.mu_bench.tip_2 = "c"
assert "Tip: choose two" in refused(bpy.ops.mu.track_write, clip=clip.name)
assert "There is no clip" in refused(bpy.ops.mu.track_write, clip="none")
""",
        tmp_path,
    )
    (e,) = read_folder(tmp_path / "measured").experiments
    assert (e.name, e.role, e.specimen) == ("by hand", "held_out", "B")
    assert np.abs(e["angle_deg"] - ANGLES).max() < 0.1
