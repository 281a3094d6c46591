"""The command line as a user runs it: a process of its own."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path

import attrs
import numpy as np

from mu_addon.cli.main import main
from mu_addon.design.parameters import load_preset
from mu_addon.fem.protocol import Protocol
from mu_addon.meshing.settings import MeshSettings
from mu_addon.studies.starting import write_study
from mu_addon.studies.unit_ranking import UnitStudy

ROOT = Path(__file__).resolve().parents[2]
# No measure of speed: what hangs must end some time.
PATIENCE_S = 3600.0
RUN = ROOT / "headless" / "run.py"
# Three chambers, one path, small pressures: all stages of a study in seconds.
UNIT = load_preset("mu-1.0x").evolve(count=3)
MILD = Protocol(np.arange(4.0), np.array([0.0, -1.0, 0.0, 2.0]))


JOB = UnitStudy(unit=UNIT, protocol=MILD, mesh=MeshSettings(refine=0.35), times=4, stations=11)


def coarse(folder, **changes):
    """Write the main job, small, into a folder, and return the command that runs it."""
    folder.mkdir(parents=True, exist_ok=True)
    write_study(attrs.evolve(JOB, **changes), folder)
    return "resume", folder


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


def is_running(process):
    """True until a process has closed its files, and so let its folder go: all its threads are zombies."""
    states = []
    for thread in Path(f"/proc/{process}/task").glob("*/stat"):
        with contextlib.suppress(OSError):
            states.append(thread.read_text().rpartition(")")[2].split()[0])
    return any(state not in "ZX" for state in states)


def assert_clear_failure(done, status, *words):
    """It ended with `status`, said every word, and showed no traceback."""
    text = done.stdout + done.stderr
    assert done.returncode == status, text
    assert "Traceback" not in text
    for word in words:
        assert word in text, f"{word!r} not in:\n{text}"
