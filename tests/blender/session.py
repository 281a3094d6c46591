"""Blender in a process of its own: its state is one per process, and a crash there must not end the tests.

MU_BPY names further Pythons that have bpy, those of other versions (`conftest.py`); separated as in PATH.
"""

import importlib.util
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
python = sys.executable
"""The Python that sessions run in; the fixture `each_bpy` sets it."""
OTHERS = [path for path in os.environ.get("MU_BPY", "").split(os.pathsep) if path]
PASSED_ON = "PATH", "LD_LIBRARY_PATH", "LANG", "WARP_CACHE_PATH"
needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")

PRELUDE = """
import sys
import bpy
import mu_addon

bpy.ops.wm.read_factory_settings(use_empty=True)
mu_addon.register()
from mu_addon.blender.unit import object as unit_object
from mu_addon.design.parameters import load_preset


def add(**settings):
    assert bpy.ops.mu.add(**settings) == {"FINISHED"}
    return unit_object.active_root(bpy.context)


def refused(operator, **settings):
    try:
        operator(**settings)
    except RuntimeError as error:
        return str(error)
    raise AssertionError("it was not refused")

"""

# A child that says what a test wants, and the wait for it; the fake's file is the session's first argument.
FAKE = ROOT / "tests" / "run" / "fake_worker.py"
WATCHING = """
import time
from mu_addon.blender.simulate import state as simulation, study_folder as studies

def launch(root, how):
    command = [sys.executable, sys.argv[1], how]
    return simulation.launch(root.mu_unit.uuid, command, studies.folder_of(root) / "blender")

def watch(until, seconds=300):
    # Timers never fire in background: the test is the timer.
    end = time.monotonic() + seconds
    while not until():
        assert time.monotonic() < end
        simulation.poll()
        time.sleep(0.05)

"""

# What panels draw into takes every call and keeps what was said. A test names its panels in PANELS.
DRAWN = """
from unittest.mock import MagicMock

def drawn():
    said, layout = [], MagicMock()
    layout.panel.return_value = (layout, layout)
    for name in ("row", "column", "box", "split", "grid_flow"):
        getattr(layout, name).return_value = layout
    layout.label.side_effect = lambda text="", **_: said.append(text)
    layout.progress.side_effect = lambda factor, text: said.append(f"{factor:.2f} {text}")
    layout.operator.side_effect = lambda name, text="", **_: said.append(text or name) or MagicMock()
    layout.template_icon.side_effect = lambda icon, scale: said.append("a picture")
    for cls in PANELS:
        if getattr(cls, "poll", lambda _: True)(bpy.context):
            seat = MagicMock(layout=layout, seek=getattr(cls, "seek", None))
            seat.show = lambda *a, c=cls: c.show(seat, *a)
            cls.draw(seat, bpy.context)
    return " ".join(said)

"""

# The wheel of 4.5 can hang in its own exit handlers, after Python's.
DRIVER = """
import atexit, os, sys, traceback

status = 1
try:
    exec(compile(sys.stdin.read(), "session", "exec"), {"__name__": "session"})
    print("reached the end")
    status = 0
except BaseException:
    traceback.print_exc()
atexit._run_exitfuncs()
sys.stdout.flush()
os._exit(status)
"""


def blender(code, folder, *arguments, prelude=PRELUDE):
    """Run `code` in a Python with bpy, its user files under `folder`; returns what it printed, or fails."""
    environment = {
        **{name: os.environ[name] for name in PASSED_ON if name in os.environ},
        "HOME": str(folder),
        "BLENDER_USER_RESOURCES": str(folder / "blender"),
        # A session that ends as these do leaves its folder of temporary files.
        "TMPDIR": str(folder),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        [python, "-c", DRIVER, *map(str, arguments)],
        input=prelude + textwrap.dedent(code),
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=environment,
        timeout=600,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "reached the end" in done.stdout, done.stdout + done.stderr
    return done.stdout
