"""A simulation's process, watched without waiting: what it says, how it ends, how it is stopped."""

import os
import sys
import time
from pathlib import Path

import pytest

from mu_addon.errors import MuError
from mu_addon.run import child as module
from mu_addon.run.child import CANCELLED, DONE, FAILED, RUNNING, Child

FAKE = str(Path(__file__).with_name("fake_worker.py"))


@pytest.fixture
def start(tmp_path):
    started = []

    def start(how):
        started.append(Child([sys.executable, FAKE, how], tmp_path / "study", os.environ))
        return started[-1]

    yield start
    for child in started:
        child.kill()


def watch(child, until=lambda child: child.state != RUNNING, longest=0.0):
    """Poll until something holds; returns the longest that one poll took, in seconds of processor time."""
    end = time.monotonic() + 1800.0
    while not until(child):
        assert time.monotonic() < end, "it never came"
        before = time.process_time()
        child.poll()
        longest = max(longest, time.process_time() - before)
        time.sleep(0.02)
    return longest


def test_a_good_run_is_heard(start):
    child = start("good")
    assert child.state == RUNNING
    watch(child)
    assert child.state == DONE
    assert child.progress["fraction"] == 0.75
    assert child.warnings == ["a small thing"]
    assert child.error is None


def test_an_error_is_passed_on_in_its_own_words(start):
    child = start("reported_error")
    watch(child)
    assert child.state == FAILED
    assert (child.error["what"], child.error["where"]) == ("no equilibrium", "at 12 kPa")
    assert child.error["what_to_do"] == "thicker wall"


def test_a_crash_is_told_with_signal_and_last_words(start):
    child = start("crash")
    watch(child)
    assert child.state == FAILED
    assert "without a message" in child.error["what"]
    assert "SIGSEGV" in child.error["what"]
    assert "out of luck" in child.error["what"]
    assert child.error["what_to_do"]
    assert Path(child.error["where"]).is_file()


def test_an_end_without_a_word_is_a_failure_even_with_status_0(start):
    child = start("wordless")
    watch(child)
    assert child.state == FAILED
    assert "exit status 0" in child.error["what"]


def test_a_result_is_not_believed_beside_a_bad_status(start):
    child = start("lies")
    watch(child)
    assert child.state == FAILED
    assert "exit status 3" in child.error["what"]


def test_garbage_is_passed_over(start):
    child = start("garbage")
    watch(child)
    assert child.state == DONE
    assert child.garbage == 6
    assert child.progress["fraction"] == 0.75


def test_half_a_line_waits_for_the_other_half(start):
    child = start("half_a_line")
    watch(child)
    assert child.state == DONE
    assert child.progress["fraction"] == 0.5
    assert child.garbage == 0


def test_a_flood_neither_blocks_the_child_nor_its_parent(start):
    child = start("flood")
    time.sleep(2.0)  # a pipe would be full by now, and the child stuck
    longest = watch(child)
    assert child.state == DONE
    assert longest < 2.0


def test_polling_a_silent_child_does_not_wait(start):
    child = start("hang")
    watch(child, lambda child: child.progress)
    before, worked = time.monotonic(), time.process_time()
    for _ in range(100):
        assert not child.poll()
    assert time.process_time() - worked < 0.5
    # It hangs for ten minutes: that long a poll would wait, however busy the machine.
    assert time.monotonic() - before < 300
    assert child.state == RUNNING


def test_cancel_ends_it(start):
    child = start("hang")
    watch(child, lambda child: child.progress)
    child.cancel()
    assert child.stopping
    watch(child)
    assert child.state == CANCELLED
    assert child.error is None
    child.cancel()  # a second press does nothing


def test_a_deaf_child_is_killed_when_patience_ends(start, monkeypatch):
    monkeypatch.setattr(module, "PATIENCE_S", 3600.0)
    child = start("deaf")
    watch(child, lambda child: child.progress)
    child.cancel()
    time.sleep(0.15)
    child.poll()
    assert child.stopping
    monkeypatch.setattr(module, "PATIENCE_S", 0.3)
    watch(child)
    assert child.state == CANCELLED


def test_kill_leaves_no_process(start):
    child = start("deaf")
    watch(child, lambda child: child.progress)
    child.kill()
    assert child.state == FAILED
    assert child._process.returncode is not None


def test_what_cannot_start_says_why(tmp_path):
    with pytest.raises(MuError, match="cannot start: No such file"):
        Child([str(tmp_path / "no such program")], tmp_path, os.environ)
