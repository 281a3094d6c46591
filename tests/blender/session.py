"""Blender in a process of its own: its state is one per process, and a crash there must not end the tests.

MU_BPY names further Pythons that have bpy, those of other versions (`conftest.py`); separated as in PATH.
"""

import importlib.util
import os
import pickle
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
OTHERS = [path for path in os.environ.get("MU_BPY", "").split(os.pathsep) if path]
PASSED_ON = "PATH", "LD_LIBRARY_PATH", "LANG", "WARP_CACHE_PATH"
PATIENCE_S = 3600.0
"""No measure of speed: a process that hangs must end some time."""
python = sys.executable
needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")


class Blender:
    """One process with bpy, which calls functions of modules under tests/ one after another; see `worker`."""

    def __init__(self, python, folder):
        self.python, self.folder = python, Path(folder)
        self.process, self.log = None, self.folder / "said.txt"

    def call(self, module, function, *, registered=True, **arguments):
        """What `function` returns in a Blender as new; a failure there is a failure here."""
        if self.process is None:
            self._start()
        start = self.log.stat().st_size
        limit = threading.Timer(PATIENCE_S, self.process.kill)
        limit.start()
        try:
            pickle.dump((module, function, registered, arguments), self.process.stdin)
            self.process.stdin.flush()
            failure, found = pickle.load(self.process.stdout)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError):
            status = self.close()
            failure, found = f"Blender ended with status {status} in {function}", None
        finally:
            limit.cancel()
        if failure:
            with self.log.open("rb") as file:
                file.seek(start)
                said = file.read().decode(errors="replace")
            pytest.fail(f"{failure}\n-- what Blender printed --\n{said}", pytrace=False)
        return found

    def _start(self):
        self.folder.mkdir(parents=True, exist_ok=True)
        environment = {
            **{name: os.environ[name] for name in PASSED_ON if name in os.environ},
            "HOME": str(self.folder),
            "BLENDER_USER_RESOURCES": str(self.folder / "blender"),
            # A process that ends as these do leaves its folder of temporary files.
            "TMPDIR": str(self.folder),
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONPATH": str(ROOT),
        }
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                [self.python, "-m", "tests.blender.worker"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                cwd=self.folder,
                env=environment,
            )

    def close(self):
        """End the process as Blender ends; returns its exit status."""
        if self.process is None:
            return None
        process, self.process = self.process, None
        process.stdin.close()
        process.stdout.close()
        limit = threading.Timer(PATIENCE_S, process.kill)
        limit.start()
        status = process.wait()
        limit.cancel()
        return status


# --- strings, until every file is converted ---
PRELUDE = """
import sys
import bpy
import mu_addon
import mu_addon.blender

bpy.ops.wm.read_factory_settings(use_empty=True)
mu_addon.register()
from mu_addon.blender.unit import object as unit_object
from mu_addon.design.parameters import load_preset


def add(**settings):
    assert bpy.ops.mu.add(**settings) == {"FINISHED"}
    return unit_object.active_root(bpy.context)


def operators():
    modules = mu_addon.blender._modules()
    classes = [cls for module in modules for cls in getattr(module, "CLASSES", ())]
    return [cls for cls in classes if issubclass(cls, bpy.types.Operator)]


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
from mu_addon.run.child import Child
from mu_addon.blender.jobs import start_child as jobs
from mu_addon.blender.simulate import study_folder as studies
from mu_addon.blender.simulate.job import SIMULATION

def launch(root, how):
    command = [sys.executable, sys.argv[1], how]
    return launch_as(SIMULATION, root, command)

def launch_as(kind, root, command, folder=None):
    folder = folder or kind.folder_of(root) / "blender"
    return jobs.watch(kind.key(root), Child(command, folder, jobs.environment()))

def watch(until, seconds=300):
    # Timers never fire in background: the test is the timer.
    end = time.monotonic() + seconds
    while not until():
        assert time.monotonic() < end
        jobs.poll()
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
            seat = MagicMock(layout=layout, find_root=getattr(cls, "find_root", None))
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
