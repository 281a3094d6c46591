"""Blender in a process of its own: its state is one per process, and a crash there must not end the tests."""

import importlib.util
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")

PRELUDE = """
import sys
import bpy
import mu_addon

bpy.ops.wm.read_factory_settings(use_empty=True)
mu_addon.register()
from mu_addon.blender import unit_object
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
        **{name: os.environ[name] for name in ("PATH", "LD_LIBRARY_PATH", "LANG") if name in os.environ},
        "HOME": str(folder),
        "BLENDER_USER_RESOURCES": str(folder / "blender"),
        "OPENBLAS_NUM_THREADS": "1",
        "PYTHONPATH": str(ROOT),
    }
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, *map(str, arguments)],
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
