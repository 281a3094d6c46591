"""The command line as a user runs it: a process of its own."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path

from mu_addon.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
# No measure of speed: what hangs must end some time.
PATIENCE_S = 3600.0
RUN = ROOT / "headless" / "run.py"
# The main job, small: coarse elements, seven instants, two processes.
COARSE = ("--fidelity", "homogenised", "--refine", "0.5", "--times", "7", "--stations", "11")


def command(*arguments):
    """The words of one command line."""
    return [sys.executable, str(RUN), *map(str, arguments)]


def run(*arguments, **options):
    """Run to the end; output as text."""
    return subprocess.run(
        command(*arguments),
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        stdin=subprocess.DEVNULL,
        **options,
    )


def here(*arguments):
    """Run to the end in this process, as a second of start-up is saved; output as text."""
    words, out, errors = [str(word) for word in arguments], io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        try:
            status = main(words)
        except SystemExit as end:  # of the parser
            status = end.code
    return subprocess.CompletedProcess(words, status, out.getvalue(), errors.getvalue())


def worker_of(folder):
    """Number of the process that works in a folder: the command's own only watches it."""
    return int(json.loads((folder / "run.lock").read_text())["process"])


def assert_clear_failure(done, status, *words):
    """It ended with `status`, said every word, and showed no traceback."""
    text = done.stdout + done.stderr
    assert done.returncode == status, text
    assert "Traceback" not in text
    for word in words:
        assert word in text, f"{word!r} not in:\n{text}"
