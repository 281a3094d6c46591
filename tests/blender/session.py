"""Blender in a process of its own: its state is one per process, and a crash there must not end the tests.

MU_BPY names further Pythons that have bpy, those of other versions (`conftest.py`); separated as in PATH.
"""

import importlib.util
import os
import pickle
import subprocess
import threading
from pathlib import Path

import pytest

from .. import costs

ROOT = Path(__file__).resolve().parents[2]
COARSE = Path(__file__).parent / "coarse" / "site-packages"
OTHERS = [path for path in os.environ.get("MU_BPY", "").split(os.pathsep) if path]
PASSED_ON = "PATH", "LD_LIBRARY_PATH", "LANG", "WARP_CACHE_PATH"
PATIENCE_S = 3600.0
"""No measure of speed: a process that hangs must end some time."""
needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")


class Blender:
    """One process with bpy, which calls functions of modules under tests/ one after another; see `worker`."""

    def __init__(self, python, folder):
        self.python, self.folder = python, Path(folder)
        self.process, self.log = None, self.folder / "output.txt"

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
            failure, found, seconds = pickle.load(self.process.stdout)
            costs.elsewhere += seconds
        except (EOFError, BrokenPipeError, pickle.UnpicklingError):
            status = self.close()
            failure, found = f"Blender ended with status {status} in {function}", None
        finally:
            limit.cancel()
        if failure:
            with self.log.open("rb") as file:
                file.seek(start)
                output = file.read().decode(errors="replace")
            pytest.fail(f"{failure}\n-- what Blender printed --\n{output}", pytrace=False)
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
            "PYTHONPATH": os.pathsep.join([str(ROOT), str(COARSE)]),
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
