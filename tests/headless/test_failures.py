"""What goes wrong, and how it is told: message, exit status, what is kept."""

import json
import resource
import subprocess
import sys

import attrs
import pytest

from mu_addon.design.parameters import load_preset, read_unit, to_toml
from mu_addon.fem.protocol import read_protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.simulate_and_place import mechanics
from mu_addon.simulate_and_place.settings import STAGES
from mu_addon.studies.starting import write_study
from mu_addon.studies.unit_ranking import UnitStudy

from .processes import assert_clear_failure, command, here, run


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


def test_a_search_without_a_path_is_refused_before_any_work(tmp_path):
    words = ("--preset", "mu-0.75x", "--paths", "graph", "--shortest-cells", "40", "--out", tmp_path / "out")
    assert_clear_failure(here("place", *words), 2, "no path of the lattice", "what to do")
    assert not (tmp_path / "out" / "unit.stl").exists()


def three_chambers(folder):
    """A unit's file."""
    unit = folder / "unit.toml"
    unit.write_text("format = 1\n[chambers]\ncount = 3\n")
    return unit


def test_a_protocol_that_bursts_the_unit_keeps_the_states_before(tmp_path, monkeypatch):
    # To find the limit point itself takes half a minute; tests/fem/test_limit_points.py does.
    soon = attrs.evolve(mechanics.BODY_NEWTON, follow_snaps=False, min_step_MPa=2e-3)
    monkeypatch.setattr(mechanics, "BODY_NEWTON", soon)
    file, unit = tmp_path / "burst.csv", three_chambers(tmp_path)
    file.write_text("time_s,pressure_kPa\n0,0\n1,60\n")
    out = tmp_path / "out"
    job = UnitStudy(
        unit=read_unit(unit).evolve(membrane_modulus_kPa=250.0),
        protocol=read_protocol(file),
        mesh=MeshSettings(refine=0.2),
        times=21,
        stages=STAGES[:2],
        self_contact=False,
    )
    write_study(job, out)
    done = here("resume", out, "--workers", "1")
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
