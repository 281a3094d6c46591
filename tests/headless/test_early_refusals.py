"""What no run can use is refused before its folder is made: with its name, what to do, and no file left."""

import numpy as np
import pytest

from .processes import assert_clear_failure, here

UNIT = ("--preset", "mu-0.75x")
BENCH = 'base = ["a", "b"]\ntip = ["c", "d"]\n' + "".join(
    f'[[marker]]\nname = "{name}"\nplace_mm = {place}\n'
    for name, place in (("a", [0.0, 0.0]), ("b", [0.0, 50.0]), ("c", [90.0, 0.0]), ("d", [90.0, 50.0]))
)


@pytest.fixture
def at(tmp_path, monkeypatch):
    """A folder with a file of each kind that is not what it should be."""
    monkeypatch.chdir(tmp_path)
    for name in ("noise.csv", "noise.toml"):
        (tmp_path / name).write_bytes(np.random.default_rng(1).bytes(3000))
    (tmp_path / "note.stl").write_text("dear colleague, the part is attached\n")
    (tmp_path / "bench.toml").write_text(BENCH)
    (tmp_path / "p.csv").write_text("time_s,pressure_kPa\n0,0\n1,-10\n2,0\n")
    (tmp_path / "unnamed.csv").write_text("time_s,x,y\n0,1,2\n1,2,3\n")
    head = ",".join(f"{name} right_px,{name} down_px" for name in "abcd")
    for name, starts_s in (("late.csv", 50), ("good.csv", 0)):
        rows = "".join(f"{starts_s + i},1,2,1,90,150,2,150,90\n" for i in range(3))
        (tmp_path / name).write_text(f"time_s,{head}\n{rows}")
    rows = "".join(f"{i},1,2,1,90\n" for i in range(3))
    (tmp_path / "base.csv").write_text(f"time_s,a right_px,a down_px,b right_px,b down_px\n{rows}")
    (tmp_path / "base_only.toml").write_text(BENCH.replace('tip = ["c", "d"]\n', ""))
    return tmp_path


def track(clip, markers="bench.toml"):
    return "track", clip, "--markers", markers, "--pressure", "p.csv"


REFUSED = {
    "design of a path that is not there": (
        ("design", *UNIT, "--path", "alpha99"),
        ("no path 'alpha99'", "did you mean 'alpha9'?", "where: path", "alpha1 .. alpha10"),
    ),
    "import of a missing file": (("import", "none.csv"), ("where: none.csv", "check path and file")),
    "import of a binary file": (("import", "noise.csv"), ("where: noise.csv", "export it as CSV or text")),
    "check of no STL": (("check", "--stl", "note.stl"), ("where: note.stl", "export it again")),
    "repair of no STL": (("check", "--stl", "note.stl", "--repair"), ("where: note.stl", "export it again")),
    "track of a missing clip": (track("none.csv"), ("where: none.csv", "give a movie")),
    "track of a clip without markers": (track("unnamed.csv"), ("where: unnamed.csv", "NAME right_px")),
    "track of a clip of another time": (track("late.csv"), ("where: late.csv", "give starts_s")),
    "track of the base alone": (track("base.csv", "base_only.toml"), ("angle_deg is missing", "base.csv")),
    "a row beside a named path": (
        ("export", *UNIT, "--path", "alpha1", "--path-row", "path7"),
        ("where: --path-row", "with --path", "leave --path-row out"),
    ),
    "a row without a path": (("export", *UNIT, "--path-row", "path7"), ("where: --path-row", "with --path")),
    "a chain that is not there": (
        ("chain", "none.toml"),
        ("cannot read the chain", "where: none.toml", "give a chain.toml"),
    ),
    "a calibration that is not there": (
        ("stream", "--simulate", "--seconds", "1", "--calibration", "none.toml"),
        ("calibration: No such file or directory", "where: none.toml", "that `calibrate` writes"),
    ),
    "a calibration that is not text": (
        ("stream", "--simulate", "--seconds", "1", "--calibration", "noise.toml"),
        ("it is not UTF-8 text", "where: noise.toml", "that `calibrate` writes"),
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_it_is_refused_at_once_and_leaves_nothing(case, at):
    before = sorted(at.iterdir())
    line, words = REFUSED[case]
    assert_clear_failure(here(*line, "--out", "out"), 2, *words, "what to do: ")
    assert sorted(at.iterdir()) == before


def test_the_clip_would_do_without_the_fault(at):
    """So that it is the fault that is refused, and not the rest of the line."""
    done = here(*track("good.csv"), "--out", "out")
    assert done.returncode == 0, done.stderr
    assert (at / "out" / "experiments.toml").exists()
