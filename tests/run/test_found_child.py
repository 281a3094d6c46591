"""A run that goes on without the process that started it: watched, stopped and judged by its folder alone."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mu_addon.run.child import CANCELLED, DONE, FAILED, MESSAGES, RUNNING
from mu_addon.run.found_child import FoundChild
from mu_addon.run.lock import FolderLock, holder

ROOT = Path(__file__).resolve().parents[2]
WORKER = Path(__file__).with_name("locked_worker.py")
# No measure of speed: what hangs must end some time.
PATIENCE_S = 600.0


@pytest.fixture
def started(tmp_path):
    own = tmp_path / "own"
    own.mkdir()
    with (own / MESSAGES).open("wb") as out:
        process = subprocess.Popen(
            [sys.executable, str(WORKER), str(tmp_path)],
            stdout=out,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
    yield process, FoundChild(tmp_path, own, [("Model A", 8.0)], time.time())
    process.kill()
    process.wait()


def until(child, condition):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end
        child.poll()
        time.sleep(0.02)


def test_its_progress_is_read_and_its_process_known(started, tmp_path):
    process, child = started
    until(child, lambda: child.progress)
    assert (child.state, child.pid, child.estimate.fraction) == (RUNNING, process.pid, 0.25)
    (tmp_path / "end").write_text("well")
    until(child, lambda: child.state != RUNNING)
    assert child.state == DONE
    assert child.pid == 0


def test_it_can_be_cancelled(started):
    process, child = started
    until(child, lambda: child.progress)
    child.cancel()
    assert child.stopping
    until(child, lambda: child.state != RUNNING)
    assert child.state == CANCELLED
    assert process.wait() == 143


def test_one_that_ends_without_a_word_has_failed(started, tmp_path):
    process, child = started
    until(child, lambda: child.progress)
    process.kill()
    process.wait()
    until(child, lambda: child.state != RUNNING)
    assert child.state == FAILED
    assert "no Blender watched it" in child.error["what"]


def test_one_that_ended_before_it_was_found_is_judged_by_its_last_word(tmp_path):
    (tmp_path / MESSAGES).write_text(
        '{"type": "progress", "stage": "mesh"}\n{"type": "result", "summary": {}}\n'
    )
    child = FoundChild(tmp_path, tmp_path, (), time.time() - 5.0)
    assert child.poll()
    assert child.state == DONE
    assert child.seconds >= 5.0


def test_a_run_that_loads_its_solver_is_waited_for(tmp_path):
    (tmp_path / MESSAGES).write_text("")
    young, old = (FoundChild(tmp_path, tmp_path, (), time.time() - age) for age in (0.0, 3600.0))
    assert (young.poll(), young.state) == (False, RUNNING)
    assert (old.poll(), old.state) == (True, FAILED)


def test_who_holds_a_lock(tmp_path):
    assert holder(tmp_path) is None
    lock = FolderLock(tmp_path)
    assert holder(tmp_path) == os.getpid()
    lock.release()
    assert holder(tmp_path) is None
    assert holder(tmp_path) is None, "and looking takes nothing"
