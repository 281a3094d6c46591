"""A session in another process, looked into while it runs, stalls and dies."""

import json
import os
import signal
import sys
import time

import numpy as np
import pytest

from mu_addon.run.child import Child
from mu_addon.sensing.ring_buffer import Ring
from mu_addon.sensing.session import STATUS
from mu_addon.sensing.watch import Watched
from tests.headless.processes import ROOT


def until(what, seconds=1800.0):
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


def recorder(folder, *more):
    line = [sys.executable, str(ROOT / "headless" / "run.py"), "record", "--simulate", *more]
    line += ["--out", str(folder), "--controlled", "--json"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    return Child(line, folder / "own", environment, ends_with_parent=True)


def test_every_sample_once_with_marks_and_pauses(tmp_path):
    child, watched = recorder(tmp_path / "r"), Watched(tmp_path / "r")
    seen = []
    try:

        def look():
            watched.look()
            child.poll()
            assert child.state == "running", child.error
            seen.append(watched.fresh()[:, 2] if watched.columns else np.empty(0))
            return sum(map(len, seen))

        until(lambda: look() > 50)
        child.send("mark angle 30")
        child.send("pause")
        until(lambda: look() and watched.status["state"] == "paused")
        before = watched.starved_s
        time.sleep(0.3)
        assert watched.starved_s > before
        until(lambda: look() and watched.silent_s < 3.0)
        child.send("resume")
        count = look()
        until(lambda: look() > count + 50)
        child.send("stop")
        until(lambda: child.poll() and child.state != "running")
    finally:
        child.kill()
    assert child.state == "done", child.error
    numbers = np.concatenate(seen)
    assert (np.diff(numbers) > 0).all(), "in order, none twice"
    assert numbers[0] == 0
    assert watched.look()
    assert watched.status["state"] == "ended"
    assert len(watched.fresh()) == 0
    events = [json.loads(line) for line in (tmp_path / "r" / "index.ndjson").read_text().splitlines()]
    assert [e["text"] for e in events if e.get("event") == "mark"] == ["angle 30"]


@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_a_killed_reader_is_told_of_and_its_orders_go_nowhere(tmp_path):
    child, watched = recorder(tmp_path / "r"), Watched(tmp_path / "r")
    try:
        until(lambda: watched.look() and watched.status["rows"] > 10)
        os.kill(child.pid, signal.SIGKILL)
        until(lambda: child.poll() and child.state != "running")
    finally:
        child.kill()
    assert child.state == "failed"
    assert "SIGKILL" in child.error["what"]
    child.send("pause")
    assert watched.status["state"] == "connected", "its last words"


def test_the_session_ends_with_who_holds_its_input(tmp_path):
    child, watched = recorder(tmp_path / "r"), Watched(tmp_path / "r")
    try:
        until(lambda: watched.look() and watched.status["rows"] > 10)
        child._process.stdin.close()
        until(lambda: child.poll() and child.state != "running")
    finally:
        child.kill()
    assert child.state == "done", child.error


def test_half_a_status_garbage_and_a_missing_ring_are_waited_for(tmp_path):
    watched = Watched(tmp_path)
    assert not watched.look()
    assert watched.columns == ()
    assert len(watched.fresh()) == 0
    for text in ("", "{", "[1]", "\x00"):
        (tmp_path / STATUS).write_text(text)
        assert not watched.look()
    columns = ["time_s", "device_s", "sequence", "light_V"]
    (tmp_path / STATUS).write_text(json.dumps({"columns": columns, "live": "live-0.bin"}))
    assert watched.look()
    assert len(watched.fresh()) == 0
    ring = Ring.create(tmp_path / "live-0.bin", 4, capacity=64)
    ring.append(np.arange(40.0).reshape(10, 4))
    assert len(watched.fresh()) == 0
    (tmp_path / STATUS).write_text(json.dumps({"columns": columns, "live": "live-0.bin", "rows": 10}))
    assert watched.look()
    np.testing.assert_array_equal(watched.fresh(), np.arange(40.0).reshape(10, 4))
    assert len(watched.fresh()) == 0
    # It fell behind by more than half a ring: the latest half, and none of it twice.
    ring.append(np.tile(np.arange(100.0)[:, None], 4))
    np.testing.assert_array_equal(watched.fresh()[:, 0], np.arange(68.0, 100.0))
    watched.rewind()
    assert len(watched.fresh()) == 32
    assert watched.latest(5)[-1, 0] == 99.0
    watched.close()
    ring.close()
