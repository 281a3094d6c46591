"""The built .zip in a real Blender: installed by Blender's own command, used as a designer would, removed.

MU_BLENDER is the command of a Blender (`blender`, or several words); MU_BLENDER_UI one that opens a window:
it is given a Python file, a .png for a picture of the screen and a number of seconds, and starts that Blender
with --enable-event-simulate. MU_ARCHIVE is an archive that is built already, for its Python; without it one
is built here, which compiles Warp's library.
"""

import json
import os
import shlex
import subprocess
import sys
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from tests.headless.processes import coarse

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).parent
BLENDER = shlex.split(os.environ.get("MU_BLENDER", ""))
WINDOW = shlex.split(os.environ.get("MU_BLENDER_UI", ""))
MISSING = "NOT TESTED in a real Blender: set MU_BLENDER to the command of one"

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not BLENDER, reason=MISSING)]
if not BLENDER:
    warnings.warn(MISSING, stacklevel=1)


@pytest.fixture(scope="module")
def each_bpy():
    """None here: these tests are of a whole Blender."""


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return tmp_path_factory.mktemp("home")


def call(home, *arguments, command=BLENDER):
    done = subprocess.run(
        [*command, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "BLENDER_USER_RESOURCES": str(home), "OPENBLAS_NUM_THREADS": "1"},
        timeout=3600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def archive(home, tmp_path_factory):
    if os.environ.get("MU_ARCHIVE"):
        return Path(os.environ["MU_ARCHIVE"])
    output = call(home, "-b", "--python-expr", "import sys; print('Python %d.%d.' % sys.version_info[:2])")
    python = output.split("Python ")[1].split(".\n")[0]
    out = tmp_path_factory.mktemp("built")
    build = [ROOT / ".ci" / "extension.py", out, "--bundle", "--platform", "linux-x64", "--python", python]
    done = subprocess.run([sys.executable, *build], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert json.loads((out / "index.json").read_text())["data"][0]["id"] == "mu_addon"
    (path,) = out.glob("*.zip")
    return path


@pytest.fixture(scope="module")
def installed(home, archive):
    call(home, "--command", "extension", "install-file", "-r", "user_default", "-e", archive)
    return home / "extensions"


def test_wheels_are_inside_and_numpy_is_not(archive):
    wheels = [name for name in zipfile.ZipFile(archive).namelist() if name.endswith(".whl")]
    packages = {Path(name).name.split("-")[0] for name in wheels}
    assert {"attrs", "manifold3d", "scipy", "warp_lang", "gmsh", "pytetwild"} <= packages
    assert not {"numpy", "bpy"} & packages


def test_a_designers_day(installed, home, tmp_path):
    output = call(home, "-b", "--python-exit-code", "4", "-P", HERE / "designers_day.py", "--", tmp_path)
    assert "the day is over" in output, output
    assert (tmp_path / "unit.stl").stat().st_size > 1_000_000


def test_the_command_line_gives_the_same_digits_as_plain_python(installed, home, tmp_path):
    """Blender has a CHOLMOD of its own loaded, of another version than the one in the extension's wheels."""
    run = ROOT / "headless" / "run.py"
    inside, outside = (coarse(tmp_path / name, times=5, mesh_check=False) for name in ("blender", "plain"))
    call(home, "-b", "--python-exit-code", "4", "-P", run, "--", *inside)
    (packages,) = installed.glob(".local/lib/python*/site-packages")
    # By the Python that this Blender runs on, in a process that never saw Blender. Its packages lie as
    # Blender unpacked them, which this file of the extension's knows.
    line = [str(ROOT / "mu_addon/blender/jobs/child_main.py"), *map(str, outside)]
    plain = f"""
import os, subprocess, sys
path = os.pathsep.join([{str(packages)!r}, *(p for p in sys.path if p.endswith("-packages"))])
subprocess.run([sys.executable, *{line!r}], env={{**os.environ, "PYTHONPATH": path}}, check=True)
"""
    call(home, "-b", "--python-exit-code", "4", "--python-expr", plain)
    with np.load(tmp_path / "blender" / "delta.npz") as a, np.load(tmp_path / "plain" / "delta.npz") as b:
        assert set(a.files) == set(b.files)
        assert all(np.array_equal(a[name], b[name]) for name in a.files)


def test_an_upgrade_keeps_the_users_presets(installed, home, archive):
    save = "bpy.ops.mu.add(); bpy.ops.mu.preset_save(name='mine')"
    call(home, "-b", "--python-exit-code", "4", "--python-expr", f"import bpy; {save}")
    call(home, "--command", "extension", "install-file", "-r", "user_default", "-e", archive)
    load = "bpy.ops.mu.add(preset='user:mine')"
    call(home, "-b", "--python-exit-code", "4", "--python-expr", f"import bpy; {load}")


@pytest.mark.skipif(not WINDOW, reason="NOT TESTED with mouse and keys: set MU_BLENDER_UI")
@pytest.mark.parametrize("script", ["trees_by_mouse.py", "gestures_in_window.py"])
def test_mouse_and_keys(script, installed, home, tmp_path):
    os.environ["MU_TEST_FOLDER"] = str(tmp_path)
    call(home, HERE / script, tmp_path / "screen.png", 1800, command=WINDOW)
    assert (tmp_path / "outcome.txt").read_text() == "all went well", (tmp_path / "outcome.txt").read_text()


def test_removed_without_residue(installed, home):
    """Last: the fixtures above need it installed."""
    call(home, "--command", "extension", "remove", "mu_addon")
    assert not (installed / "user_default" / "mu_addon").exists()
    # Blender leaves the folder of compiled top-level modules that its wheels held, empty of ours or not.
    left = {p.name for p in installed.glob(".local/lib/python*/site-packages/*")}
    assert left <= {"__pycache__"}
