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


@pytest.mark.parametrize(("how", "status"), [("wordless", 0), ("lies", 3)])
def test_neither_a_status_nor_a_result_is_believed_without_the_other(start, how, status):
    child = start(how)
    watch(child)
    assert child.state == FAILED
    assert f"exit status {status}" in child.error["what"]


@pytest.mark.parametrize(("how", "fraction", "garbage"), [("garbage", 0.75, 6), ("half_a_line", 0.5, 0)])
def test_garbage_is_passed_over_and_half_a_line_waits_for_the_other_half(start, how, fraction, garbage):
    child = start(how)
    watch(child)
    assert child.state == DONE
    assert (child.progress["fraction"], child.garbage) == (fraction, garbage)


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
