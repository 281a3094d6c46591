"""A followed video joined with its pressure, in a folder of measured data."""

import json

import attrs
import numpy as np
import pytest

from mu_addon.cli.main import main
from mu_addon.errors import InputError
from mu_addon.files import write_text
from mu_addon.lab_files.tracked_table import read_pixels
from mu_addon.measured import added, read_folder
from mu_addon.measured.bench import Bench, MarkerSettings, entry_of, filmed, pixels_text, read_bench
from mu_addon.measured.video import Tracks
from mu_addon.studies.track import tracks_in

from ..measured.test_video import VIEW, arc, picture

BENCH = """
camera = "-x"
base = ["low", "high"]
tip = ["left", "right"]
ruler = ["zero", "fifty"]
ruler_mm = 50
fps = 25
starts_s = 1.5
marks = "dots"

[experiment]
name = "ladder, slow"
scale = 0.75
orientation_deg = 90.0
specimen = "A"

[[marker]]
name = "low"
pixel = [300, 30.5]
place_mm = [-15, 0]
[[marker]]
name = "high"
pixel = [180, 30]
place_mm = [15, 0.0]
[[marker]]
name = "left"
pixel = [1, 2]
"""

PRESSURE = (np.array([0.0, 1.0, 3.0, 5.0]), np.array([0.0, 0.0, 40.0, 0.0]))


def write_experiment(found, bench, name, folder):
    """Its CSV file and the reader's remarks."""
    entry = entry_of(found, bench, name)
    remarks = entry.tried()
    for file in added([entry]):
        write_text(folder / file.name, file.make(folder / file.name))
    pixels = f"{entry.file.removesuffix('.csv')}.pixels.csv"
    write_text(folder / pixels, pixels_text(found, bench.starts_s))
    return folder / entry.file, remarks


def bend(time_s):
    return 1.2 * np.interp(time_s, *PRESSURE)


def clip(frames=50, starts_s=0.0, fps=10.0):
    time = starts_s + np.arange(frames) / fps
    return Tracks(("a", "b", "c", "d", "e"), picture(arc(bend(time))), fps)


def test_a_description_is_read(tmp_path):
    (tmp_path / "bench.toml").write_text(BENCH)
    bench = read_bench(tmp_path / "bench.toml")
    assert bench.view == attrs.evolve(
        VIEW, base=("low", "high"), tip=("left", "right"), camera="-x", ruler=("zero", "fifty"), ruler_mm=50.0
    )
    assert bench.markers == MarkerSettings({"low": (300, 30.5), "high": (180, 30), "left": (1, 2)}, "dots")
    assert (bench.fps, bench.starts_s) == (25.0, 1.5)
    assert bench.experiment["specimen"] == "A"


@pytest.mark.parametrize(
    ("old", "new", "what", "where"),
    [
        ("fps = 25", "fsp = 25", "did you mean 'fps'", "line 7"),
        ('tip = ["left", "right"]', 'tip = "left"', "tip = 'left' is not a list of 2 texts", "line 4"),
        ('base = ["low", "high"]', "", "base is missing", "bench.toml"),
        ("place_mm = [15, 0.0]", "", "marker 'high' of the base has no place_mm", "bench.toml"),
        ("pixel = [1, 2]", "colour = 3", "unknown key 'colour'", "bench.toml"),
        ('name = "left"', 'name = "low"', "two markers are named 'low'", "bench.toml"),
        ('marks = "dots"', 'marks = "stars"', "marks = 'stars' is not known", "line 9"),
        ("starts_s = 1.5", "pattern_px = 90", "do not fit", "line 8"),
        ("scale = 0.75", "weight = 3", "unknown key 'weight'", "line 13, [experiment]"),
    ],
)
def test_descriptions_that_cannot_be_used(tmp_path, old, new, what, where):
    assert old in BENCH
    (tmp_path / "bench.toml").write_text(BENCH.replace(old, new))
    with pytest.raises(InputError, match=what) as caught:
        read_bench(tmp_path / "bench.toml")
    assert where in caught.value.where


def test_frames_and_pressure_meet_by_time(tmp_path):
    """The camera starts 0.4 s before the pressure's record and stops after it."""
    found = filmed(clip(70, -0.4), Bench(VIEW, MarkerSettings({}), starts_s=-0.4), PRESSURE)
    assert found.time_s[0] == pytest.approx(0.0)
    assert found.time_s[-1] == pytest.approx(5.0)
    assert "19 of 70 frames are outside" in found.remarks[0].what
    np.testing.assert_allclose(found.motion.angle_deg, bend(found.time_s), atol=1e-6)
    table, remarks = write_experiment(found, Bench(VIEW, MarkerSettings({})), "ladder / 1", tmp_path)
    assert table.name == "ladder-1.csv"
    assert remarks == ()
    (e,) = read_folder(tmp_path).experiments
    assert (e.name, e.kind, e.role) == ("ladder / 1", "unit_pressure", "fit")
    np.testing.assert_allclose(e["angle_deg"], bend(e["time_s"]), atol=1e-6)
    np.testing.assert_allclose(e["pressure_kPa"], np.interp(e["time_s"], *PRESSURE), atol=1e-6)
    # The clamp's markers are not the unit's: tip and middle are left.
    assert list(e.markers) == [1, 2, 3]
    np.testing.assert_allclose(e.markers[3][:, 1:], arc(bend(e["time_s"]))[4], atol=1e-6)
    assert np.isnan(e.markers[3][:, 0]).all()


def test_lost_markers_leave_empty_rows_that_diagnose_may_read(tmp_path):
    tracks = clip()
    tracks.pixels[3, 20:23] = np.nan
    found = filmed(tracks, Bench(VIEW, MarkerSettings({})), PRESSURE)
    _, remarks = write_experiment(found, Bench(VIEW, MarkerSettings({})), "gap", tmp_path)
    (e,) = read_folder(tmp_path).experiments
    assert np.flatnonzero(np.isnan(e["angle_deg"])).tolist() == [20, 21, 22]
    assert any("marker 'd' is lost in 3 of 50 frames, 2 to 2.2 s" in r.what for r in found.remarks)
    assert any("3 of 50 values of angle_deg are missing" in r.what for r in remarks)


def test_never_at_rest_is_told():
    found = filmed(clip(20, 2.0), Bench(VIEW, MarkerSettings({}), starts_s=2.0), PRESSURE)
    assert "no frame shows the unit at rest; angles are relative to 20 kPa at 2 s" in found.remarks[0].what
    assert found.motion.angle_deg[0] == pytest.approx(0.0, abs=1e-9)


def test_a_clip_without_a_clock_and_one_at_another_time():
    with pytest.raises(InputError, match="has no frame rate"):
        filmed(attrs.evolve(clip(), fps=0.0), Bench(VIEW, MarkerSettings({})), PRESSURE)
    with pytest.raises(InputError, match=r"from 100 to 104\.9 s, the pressure record from 0 to 5 s"):
        filmed(clip(), Bench(VIEW, MarkerSettings({}), starts_s=100.0), PRESSURE)


def test_clips_share_a_folder_and_a_name_is_taken_once(tmp_path):
    bench = Bench(VIEW, MarkerSettings({}), experiment={"specimen": "A", "scale": 0.75})
    found = filmed(clip(), bench, PRESSURE)
    write_experiment(found, bench, "one", tmp_path)
    write_experiment(found, attrs.evolve(bench, experiment={"role": "held_out"}), "two", tmp_path / "other")
    later = filmed(clip(40), bench, PRESSURE)
    write_experiment(later, bench, "two", tmp_path)
    text = (tmp_path / "experiments.toml").read_text()
    write_experiment(later, bench, "one", tmp_path)  # made anew
    assert (tmp_path / "experiments.toml").read_text() == text
    assert {e.name: len(e) for e in read_folder(tmp_path).experiments} == {"one": 40, "two": 40}
    with pytest.raises(InputError, match=r"an experiment named 'one', in one\.csv, already exists"):
        write_experiment(found, attrs.evolve(bench, experiment={"scale": 1.5}), "one", tmp_path)
    with pytest.raises(InputError, match="scale"):
        write_experiment(found, attrs.evolve(bench, experiment={"scale": -1}), "three", tmp_path)
    assert sorted(p.name for p in tmp_path.glob("*.csv")) == [
        "one.csv",
        "one.pixels.csv",
        "two.csv",
        "two.pixels.csv",
    ]


def described(tmp_path):
    """Files of a run: the markers as another tracker followed them, a description, and the pressure."""
    tracks = clip()
    tracks.pixels[2, 7] = np.nan
    found = filmed(tracks, Bench(VIEW, MarkerSettings({})), PRESSURE)
    write_experiment(found, Bench(VIEW, MarkerSettings({})), "source", tmp_path)
    markers = "\n".join(
        f'[[marker]]\nname = "{name}"\nplace_mm = [{y}, {z}]'
        for name, (y, z) in zip("ab", VIEW.places_mm, strict=True)
    )
    (tmp_path / "bench.toml").write_text(f'base = ["a", "b"]\ntip = ["c", "d"]\nfps = 10\n{markers}\n')
    rows = zip(*PRESSURE, strict=True)
    (tmp_path / "p.csv").write_text(
        "# the regulator\ntime_s,pressure_kPa\n" + "".join(f"{t},{p}\n" for t, p in rows)
    )
    return tracks


def test_pixels_are_written_as_they_are_read(tmp_path):
    tracks = described(tmp_path)
    again = read_pixels(tmp_path / "source.pixels.csv")
    assert again.names == tracks.names
    np.testing.assert_allclose(again.pixels, tracks.pixels, atol=1e-6)
    (tmp_path / "bad.csv").write_text("frame,a right_px\n0,1\n1,2\n")
    with pytest.raises(InputError, match="column 'a down_px' is missing"):
        read_pixels(tmp_path / "bad.csv")


def test_the_command_line_from_followed_pixels(tmp_path, capsys):
    described(tmp_path)
    line = ["track", str(tmp_path / "source.pixels.csv"), "--markers", str(tmp_path / "bench.toml")]
    line += ["--pressure", str(tmp_path / "p.csv"), "--out", str(tmp_path / "out")]
    assert main(line) == 0
    printed = capsys.readouterr()
    assert "angle: +0.00 to +48.00 deg" in printed.out
    assert "lost: c in 1 frames" in printed.out
    assert "marker 'c' is lost in 1 of 50 frames" in printed.err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["status"] == "complete"
    assert summary["mm_per_pixel"] == pytest.approx(0.25)
    (e,) = read_folder(tmp_path / "out").experiments
    assert np.nanmax(np.abs(e["angle_deg"] - bend(e["time_s"]))) < 1e-5


def test_without_blender_a_movie_is_refused_with_what_to_do(tmp_path, capsys, monkeypatch):
    described(tmp_path)
    (tmp_path / "bench.mp4").write_bytes(b"")
    markers = (tmp_path / "bench.toml").read_text().replace("place_mm", "pixel = [1, 2]\nplace_mm")
    (tmp_path / "bench.toml").write_text(markers.replace('tip = ["c", "d"]', ""))
    monkeypatch.setattr("mu_addon.studies.track.find_spec", lambda name: None)
    line = ["track", str(tmp_path / "bench.mp4"), "--markers", str(tmp_path / "bench.toml")]
    assert main([*line, "--pressure", str(tmp_path / "p.csv"), "--out", str(tmp_path / "out")]) == 2
    assert "tracking markers needs Blender" in capsys.readouterr().err


def test_a_marker_without_a_pixel_is_named(tmp_path):
    described(tmp_path)
    bench = read_bench(tmp_path / "bench.toml")
    (tmp_path / "bench.mp4").write_bytes(b"")
    with pytest.raises(InputError, match="marker 'a' has no pixel"):
        tracks_in(tmp_path / "bench.mp4", bench)
