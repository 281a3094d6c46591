"""However a run ends, it leaves a message, an exit status and a summary.json, and never a traceback."""

import json
import signal
import subprocess
import sys

import pytest

RUN = """
import signal, sys, time
from pathlib import Path
from mu_addon.errors import ConvergenceError
from mu_addon.files import write_text
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress, terminal

how, folder = sys.argv[1], Path(sys.argv[2])
progress = Progress([terminal(sys.stderr)])
with run_to_end(progress) as ending:

    def last_words(stopped):
        if how == "patience":
            print("saving", flush=True)
            time.sleep(60)
        write_text(folder / "last_words.txt", stopped)

    ending.report = last_words
    if how != "early":
        ending.open_folder(folder)
    ending.summary["angle_deg"] = [1.0, 2.0]
    with progress.stage("model A"):
        write_text(folder / "mesh.txt", "kept")
        if how == "mu":
            raise ConvergenceError("no equilibrium", "at 37 kPa", "thicken the wall")
        if how in ("bug", "early"):
            raise RuntimeError("a bug")
        if how in ("wait", "patience"):
            print("ready", flush=True)
            time.sleep(60)
sys.exit(ending.status)
"""


def start(how, folder):
    return subprocess.Popen(
        [sys.executable, "-c", RUN, how, str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(process, folder):
    _, output = process.communicate(timeout=1800)
    assert "Traceback" not in output
    summary = folder / "summary.json"
    log = folder / "log.ndjson"
    return (
        process.returncode,
        output,
        json.loads(summary.read_text()) if summary.exists() else None,
        [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else [],
    )


def test_complete(tmp_path):
    status, output, summary, log = finish(start("well", tmp_path), tmp_path)
    assert status == 0
    assert "error" not in output
    assert summary["status"] == "complete"
    assert summary["angle_deg"] == [1.0, 2.0]
    assert list(summary["seconds"]) == ["model A"]
    assert log[-1]["type"] == "result"
    assert not (tmp_path / "last_words.txt").exists()


def test_a_known_failure(tmp_path):
    status, output, summary, log = finish(start("mu", tmp_path), tmp_path)
    assert status == 4
    assert "error: no equilibrium\n  where: at 37 kPa\n  what to do: thicken the wall" in output
    assert summary["status"] == "partial"
    assert summary["reason"] == {
        "what": "no equilibrium",
        "where": "at 37 kPa",
        "what_to_do": "thicken the wall",
    }
    assert summary["angle_deg"] == [1.0, 2.0]
    assert log[-1]["type"] == "error"
    assert (tmp_path / "mesh.txt").read_text() == "kept"
    assert (tmp_path / "last_words.txt").read_text() == "no equilibrium"


def test_a_fault_of_ours(tmp_path):
    status, output, summary, log = finish(start("bug", tmp_path), tmp_path)
    assert status == 70
    assert "RuntimeError: a bug" in output
    assert summary["status"] == "partial"
    traces = [m["text"] for m in log if m["type"] == "traceback"]
    assert len(traces) == 1
    assert 'raise RuntimeError("a bug")' in traces[0] or "RuntimeError: a bug" in traces[0]


def test_a_fault_before_there_is_a_folder(tmp_path):
    status, output, summary, log = finish(start("early", tmp_path), tmp_path)
    assert (status, summary, log) == (70, None, [])
    assert "RuntimeError: a bug" in output


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)], ids=["ctrl-c", "terminate"]
)
def test_stopped_from_outside(tmp_path, number, status):
    process = start("wait", tmp_path)
    assert process.stdout.readline() == "ready\n"
    assert json.loads((tmp_path / "summary.json").read_text()) == {"status": "running"}
    process.send_signal(number)
    found, output, summary, log = finish(process, tmp_path)
    assert found == status
    assert "error: stopped by" in output
    assert summary["status"] == "partial"
    assert log[-1]["status"] == status
    assert (tmp_path / "mesh.txt").read_text() == "kept"


def test_a_second_ctrl_c_cuts_short_what_takes_long(tmp_path):
    process = start("patience", tmp_path)
    for word in ("ready", "saving"):
        assert process.stdout.readline() == word + "\n"
        process.send_signal(signal.SIGINT)
    status, output, summary, _ = finish(process, tmp_path)
    assert status == 130
    assert "error: stopped by Ctrl-C" in output
    assert summary["status"] == "partial"
    assert not (tmp_path / "last_words.txt").exists()


def test_handlers_are_put_back():
    from mu_addon.run.context import run_to_end
    from mu_addon.run.progress import Progress

    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with run_to_end(Progress()) as context:
        raise KeyboardInterrupt
    assert context.status == 130
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_a_full_disk_still_ends_with_its_message(tmp_path, monkeypatch):
    import os

    from mu_addon.run.context import run_to_end
    from mu_addon.run.progress import Progress

    messages = []
    with run_to_end(Progress([messages.append])) as context:
        context.open_folder(tmp_path)

        def full(_):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(os, "fsync", full)
        from mu_addon.files import write_text

        write_text(tmp_path / "a.csv", "x")
    assert context.status == 5
    assert messages[-1]["type"] == "error"
    assert "free some space" in messages[-1]["what_to_do"]
