"""The command line as a user runs it: a process of its own."""

from __future__ import annotations

import contextlib
import io
import json
import subprocess
import sys
from pathlib import Path

import attrs
import pytest

from mu_addon.cli.main import main
from mu_addon.design.parameters import load_preset
from mu_addon.meshing import settings
from mu_addon.meshing.settings import FIDELITY, HOMOGENISED, SELF_CONTACT, MeshSettings
from mu_addon.usecases.graph import orders
from mu_addon.usecases.grip import job as grip_job
from mu_addon.usecases.parameter_study import plan
from mu_addon.usecases.simulate_and_place.job import Job, grasp, write_study

ROOT = Path(__file__).resolve().parents[2]
# No measure of speed: what hangs must end some time.
PATIENCE_S = 3600.0
RUN = ROOT / "headless" / "run.py"
# Four chambers, three paths: as many stages as six and ten have.
UNIT = load_preset("mu-1.0x")
UNIT = attrs.evolve(UNIT, chambers=attrs.evolve(UNIT.chambers, count=4))


def coarse(folder, unit=UNIT, **changes):
    """Write the main job, small, into a folder, and return the command that runs it.

    A homogenised lattice, coarse elements and seven instants: the stages of a printed body in seconds.
    """
    folder.mkdir(parents=True, exist_ok=True)
    small = {"mesh": MeshSettings(refine=0.5), "times": 7, "stations": 11}
    write_study(Job(unit, grasp(), **(small | changes)), folder)
    return "resume", folder


@contextlib.contextmanager
def homogenised(**more):
    """Let commands of this process simulate a homogenised lattice, which has no struts that touch.

    more: other settings of its mesh.
    """
    with pytest.MonkeyPatch.context() as patch:
        for module in (settings, orders, grip_job):
            patch.setattr(module, "fidelity_of", lambda solid_struts: HOMOGENISED)
        patch.setattr(plan, "FIDELITY", FIDELITY._replace(default=HOMOGENISED))
        patch.setattr(plan, "SELF_CONTACT", SELF_CONTACT._replace(default=False))
        if more:
            patch.setattr(settings, "MeshSettings", lambda **given: MeshSettings(**(given | more)))
        yield


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
