"""A worker that says nothing is said to go on by who watches it."""

import json
import os
import subprocess
import sys

import pytest

from mu_addon.run.heartbeat import PATIENCE_S, Heartbeat, to_watcher
from mu_addon.run.progress import Progress

from .clock import Clock

# Holds the interpreter for five seconds, so that no thread of it runs, and begins with a silence as long;
# its watcher is less patient.
HELD = """
import ctypes, sys
from mu_addon.cli import main, studies
from mu_addon.cli.watched import run_watched
from mu_addon.run import heartbeat

heartbeat.PATIENCE_S = 1.0


def run(kind, name, options, context):
    ctypes.PyDLL(None).sleep(5)
    context.progress.plan([("mesh", 100.0)])
    with context.progress.stage("mesh"):
        context.progress.update(0.5)
        ctypes.PyDLL(None).sleep(5)


studies._run = run
words = sys.argv[1:]
sys.exit(run_watched(words, lambda: main.main(words)))
"""


@pytest.fixture
def clock():
    return Clock()


def test_the_last_step_is_repeated_with_its_time_gone_on(clock):
    shown, words = [], []
    heart = Heartbeat(shown.append, words.append, clock)
    progress = Progress([to_watcher(heart.hear, clock)], clock)
    clock.now = PATIENCE_S
    heart.hear(b"")
    assert words == [f"start: for {PATIENCE_S:.1f} s"]
    progress.plan([("mesh", 40.0), ("solve", 60.0)])
    with progress.stage("mesh"):
        clock.now += 20.0
        progress.update(0.5)
        for _ in range(20):
            clock.now += 1.0
            heart.hear(b"")
        # A second is what it is woken by.
        assert [m["seconds"] for m in shown] == [27.0, 34.0]
        assert [m["whole"] for m in shown] == [0.2, 0.2]
        assert shown[0]["whole_seconds_left"] - shown[1]["whole_seconds_left"] == pytest.approx(7.0)
        # What the worker then says itself is no less.
        progress.update(0.6)
    assert progress.estimate.fraction == 0.4
    clock.now += PATIENCE_S
    heart.hear(b"")
    assert words[-1] == f"after mesh: for {PATIENCE_S:.1f} s"


def test_the_watcher_knows_every_percent_that_a_terminal_shows(clock):
    """It repeated 2 % as 0 %: what had come half a second after another message was kept from it."""
    heard = []
    progress = Progress([to_watcher(heard.append, clock)], clock)
    progress.plan([("mesh", 1.0), ("solve", 99.0)])
    with progress.stage("solve"):
        for share in (0.1, 0.101, 0.3):
            progress.update(share)
    assert [round(100 * json.loads(line)["whole"]) for line in heard if b"whole" in line] == [
        1,
        11,
        11,
        31,
        100,
    ]


def test_words_come_in_pieces_of_any_size_and_nonsense_is_left_out(clock):
    shown = []
    heart = Heartbeat(shown.append, shown.append, clock)
    lines = []
    progress = Progress([to_watcher(lines.append, clock)], clock)
    with progress.stage("mesh"):
        for byte in b"".join([b"no message\n", *lines]):
            heart.hear(bytes([byte]))
        clock.now += PATIENCE_S
        heart.hear(b"")
    assert [m["stage"] for m in shown] == ["mesh"]


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are watched where they can fork")
def test_a_library_that_holds_the_interpreter_does_not_silence_a_command(tmp_path):
    words = [sys.executable, "-c", HELD, "design", "--preset", "mu-1.0x", "--out", str(tmp_path)]
    ran = subprocess.run(words, capture_output=True, text=True, timeout=600)
    assert ran.returncode == 0, ran.stderr
    lines = ran.stderr.splitlines()
    assert any(line.startswith("start: for ") for line in lines)
    assert any(line.startswith(" 50 %  mesh: for ") for line in lines)
    quiet = subprocess.run([*words, "--quiet"], capture_output=True, text=True, timeout=600)
    assert (quiet.returncode, quiet.stderr) == (0, "")
