"""What goes wrong, and how it is told: message, exit status, what is kept."""

import json
import resource
import subprocess
import sys

import pytest

from mu_addon.design.parameters import load_preset, read_unit, to_toml
from mu_addon.fem.protocol import read_protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.usecases.simulate_and_place.job import Job, write_study
from mu_addon.usecases.simulate_and_place.settings import STAGES

from .processes import assert_clear_failure, command, here, run


def test_help_names_every_command():
    done = here("--help")
    for name in ("design", "simulate", "place", "presets"):
        assert name in done.stdout
        assert here(name, "--help").returncode == 0


def test_help_loads_nothing_heavy():
    words = [sys.executable, "-X", "importtime", *command("place", "--help")[1:]]
    loaded = subprocess.run(words, capture_output=True, text=True).stderr
    for package in ("warp", "gmsh", "scipy", "matplotlib", "manifold3d"):
        assert f" {package}\n" not in loaded, package


def test_presets_are_listed():
    assert [line.split()[0] for line in here("presets").stdout.splitlines()] == [
        "mu-0.75x",
        "mu-1.0x",
        "mu-1.5x",
        "gripper",
    ]


AT_IMPORT = """
import os, runpy, signal, sys
wanted, sys.argv[:] = sys.argv[1], sys.argv[2:]

def heard(event, arguments):
    if event == "import" and arguments[0] == wanted:
        os.kill(os.getpid(), signal.SIGINT)

sys.addaudithook(heard)
runpy.run_path(sys.argv[0], run_name="__main__")
"""


@pytest.mark.parametrize("command_name", ["presets", "check"])
@pytest.mark.parametrize("module", ["subprocess", "mu_addon.cli.watched", "mu_addon.run.context", "numpy"])
def test_ctrl_c_before_the_run_has_begun(tmp_path, command_name, module):
    """In this process or the one that works, while modules are loaded."""
    words = [] if command_name == "presets" else ["--preset", "mu-1.0x", "--out", str(tmp_path)]
    line = [sys.executable, "-c", AT_IMPORT, module, *command(command_name, *words)[1:]]
    done = subprocess.run(line, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 130
    assert "error: stopped by Ctrl-C" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("words", [("presets",), ("place", "--preset", "mu-1.0x", "--out", "out")])
def test_without_its_packages_it_says_how_to_install_them(tmp_path, words):
    python, script = command()[:2]
    # -S: a Python without site-packages.
    done = subprocess.run(
        [python, "-S", script, *words], capture_output=True, text=True, cwd=tmp_path, env={"PATH": ""}
    )
    assert_clear_failure(done, 1, "package attr", "is not installed", "-m pip install")


PRESET = ("--preset", "mu-1.0x")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("place", "--preset", "mu-2.0x"), ("mu-2.0x", "mu-1.0x")),
        (("place", "--presett", "mu-1.0x"), ("--help",)),
        (("simulate", *PRESET, "--resin", ""), ("it is empty", "where: --resin")),
        (("design", *PRESET, "--path", "alpha11"), ("alpha11", "alpha10")),
        (("simulate", *PRESET, "--protocol", "none.csv"), ("none.csv",)),
        (("simulate", *PRESET, "--times", "1"), ()),
        (("simulate", *PRESET, "--refine", "0"), ()),
        (("simulate", *PRESET, "--refine", "nan"), ()),
        (("place", *PRESET, "--times", "2"), ("none of the 2 samples",)),
        (("place", *PRESET, "--paths", "graph", "--shortest-cells", "40"), ("no path of the lattice",)),
    ],
)
def test_words_that_no_run_can_use_are_refused_before_any_work(tmp_path, words, told):
    assert_clear_failure(here(*words, "--out", tmp_path / "out"), 2, *told, "what to do")
    assert not (tmp_path / "out" / "unit.stl").exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('format = 1\nname = "x"\nscale = = 2\n', ("unit.toml", "line 3")),
        ("format = 1\nscale = 1.0\n\n[chambers]\nwal_mm = 0.7\n", ("line 5", "wall_mm")),
        # The largest wall, a (a + b) / (2 (R - r)) = 3.75 x 6.25 / 12.5 mm.
        ("format = 1\n[chambers]\nwall_mm = 2.5\n", ("wall", "1.87", "cavity")),
    ],
    ids=["malformed", "misspelt", "impossible"],
)
def test_a_units_file_is_refused_in_its_own_words(tmp_path, text, told):
    (tmp_path / "unit.toml").write_text(text)
    done = here("design", "--unit", tmp_path / "unit.toml", "--out", tmp_path / "out")
    assert_clear_failure(done, 2, *told)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time_s,pressure_kPa\n0,0\n1,abc\n", ("line 3", "not a number")),
        ("time_s,pressure_kPa\n0,0\n1,5\n1,6\n", ("line 4", "time does not increase")),
        ("time_s,pressure\n0,0\n1,5\n", ("pressure_kPa", "line 1", "bar, psi")),
        ("time_s,pressure_bar\n0,0\n1,11\n", ("line 3", "a pressure of 1100 kPa")),
        ("time_s,pressure_kPa\n0,0\n1,nan\n", ("line 3", "not finite")),
        ("time_s,pressure_kPa\n0,0\n1,-20000\n", ("line 3", "a pressure of -20000 kPa", "-101.325")),
        ("time_s,pressure_kPa\n0,5\n1,6\n", ("0 kPa",)),
        ("", ("empty",)),
    ],
)
def test_unreadable_protocol_names_its_line(tmp_path, text, words):
    file = tmp_path / "protocol.csv"
    file.write_text(text)
    done = here("simulate", "--preset", "mu-1.0x", "--out", tmp_path / "out", "--protocol", file)
    assert_clear_failure(done, 2, "protocol", *words)


def test_a_binary_protocol(tmp_path):
    binary = tmp_path / "binary.csv"
    binary.write_bytes(bytes(range(256)))
    done = here("simulate", *PRESET, "--out", tmp_path / "out", "--protocol", binary)
    assert_clear_failure(done, 2, "not a text file")


def three_chambers(folder):
    """A unit's file."""
    unit = folder / "unit.toml"
    unit.write_text("format = 1\n[chambers]\ncount = 3\n")
    return unit


def test_a_protocol_that_bursts_the_unit_keeps_the_states_before(tmp_path):
    file, unit = tmp_path / "burst.csv", three_chambers(tmp_path)
    file.write_text("time_s,pressure_kPa\n0,0\n1,1000\n")
    out = tmp_path / "out"
    job = Job(read_unit(unit), read_protocol(file), MeshSettings(refine=0.35), times=21, stages=STAGES[:2])
    write_study(job, out)
    done = here("resume", out)
    assert_clear_failure(done, 4, "no equilibrium at", "kPa", "mm", "what to do")
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] == "partial"
    assert len(summary["angle_deg"]) > 1
    assert "This run is partial" in (out / "report.html").read_text()
    assert (out / "model_a.pvd").exists()


def test_a_full_disk_is_told_and_leaves_no_half_file(tmp_path):
    """A limit on file size stands for the disk: writes fail in the same place, with an OSError."""
    out = tmp_path / "out"

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000))

    done = run("design", "--unit", three_chambers(tmp_path), "--out", out, preexec_fn=limit)
    assert_clear_failure(done, 5, "unit.stl", "cannot write", "what to do")
    assert not (out / "unit.stl").exists()
    assert not list(out.glob(".*"))
    assert json.loads((out / "summary.json").read_text())["status"] == "partial"


def test_a_folder_in_the_way_of_a_file(tmp_path):
    (tmp_path / "file").write_text("mine")
    done = here("design", "--preset", "mu-1.0x", "--out", tmp_path / "file")
    assert_clear_failure(done, 5, "what to do")
    assert (tmp_path / "file").read_text() == "mine"


def test_json_messages_end_with_one_terminal_message(tmp_path):
    unit = three_chambers(tmp_path)
    good = here("design", "--unit", unit, "--out", tmp_path / "out", "--json", "--no-report")
    messages = [json.loads(line) for line in good.stdout.splitlines()]
    assert {m["type"] for m in messages[:-1]} == {"plan", "progress"}
    assert messages[-1]["type"] == "result"
    bad = here("design", "--preset", "nothing", "--out", tmp_path / "out", "--json")
    assert json.loads(bad.stdout.splitlines()[-1])["type"] == "error"


def test_a_folder_with_somebody_elses_files_is_left_alone(tmp_path):
    (tmp_path / "unit.stl").write_text("mine")
    assert_clear_failure(
        here("design", "--preset", "mu-1.0x", "--out", tmp_path), 2, "unit.stl", "what to do"
    )
    assert (tmp_path / "unit.stl").read_text() == "mine"
    assert not (tmp_path / "summary.json").exists()


def test_files_from_a_windows_editor_are_read(tmp_path):
    file = tmp_path / "unit.toml"
    file.write_bytes(b"\xef\xbb\xbf" + to_toml(load_preset("mu-1.0x")).replace("\n", "\r\n").encode())
    assert read_unit(file) == load_preset("mu-1.0x")
