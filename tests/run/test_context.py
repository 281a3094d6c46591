"""However a run ends, it leaves a message, an exit status and a summary.json, and never a traceback."""

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mu_addon.files import write_text
from mu_addon.run import summary as summary_module
from mu_addon.run.context import run_to_end
from mu_addon.run.progress import Progress

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
        write_text(folder / "last_words.txt", f"{stopped}, hurried: {ending.hurried}")

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
    assert (tmp_path / "last_words.txt").read_text() == "no equilibrium, hurried: False"


def test_a_fault_of_ours(tmp_path):
    status, output, summary, log = finish(start("bug", tmp_path), tmp_path)
    assert status == 70
    assert "RuntimeError: a bug" in output
    assert summary["status"] == "partial"
    traces = [m["text"] for m in log if m["type"] == "traceback"]
    assert len(traces) == 1
    assert 'raise RuntimeError("a bug")' in traces[0] or "RuntimeError: a bug" in traces[0]


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("Unable to allocate 3 GiB"),
        RuntimeError("Failed to allocate 3000000 bytes on device 'cpu'"),
        ImportError("manifold3d.so: failed to map segment from shared object"),
        RuntimeError("std::bad_alloc"),
    ],
)
def test_libraries_that_are_refused_memory(tmp_path, error):
    messages = []
    with run_to_end(Progress([messages.append])) as context:
        context.open_folder(tmp_path)
        raise error
    assert context.status == 1
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "partial"
    assert messages[-1]["what"] == "out of memory"
    assert "coarser mesh" in messages[-1]["what_to_do"]
    assert "traceback" not in (tmp_path / "log.ndjson").read_text()


def test_a_fault_before_there_is_a_folder(tmp_path):
    status, output, summary, log = finish(start("early", tmp_path), tmp_path)
    assert (status, summary, log) == (70, None, [])
    assert "RuntimeError: a bug" in output


@pytest.mark.parametrize(
    ("number", "status", "state", "reason"),
    [(signal.SIGINT, 130, "partial", "stopped by Ctrl-C"), (signal.SIGTERM, 143, "cancelled", "cancelled")],
    ids=["ctrl-c", "terminate"],
)
def test_stopped_from_outside(tmp_path, number, status, state, reason):
    process = start("wait", tmp_path)
    assert process.stdout.readline() == "ready\n"
    # What was found before the stage is on disk, whatever becomes of the process.
    assert json.loads((tmp_path / "summary.json").read_text()) == {
        "status": "running",
        "angle_deg": [1.0, 2.0],
    }
    process.send_signal(number)
    found, output, summary, log = finish(process, tmp_path)
    assert found == status
    assert ("error: stopped by" in output) == (number == signal.SIGINT)
    assert summary["status"] == state
    assert log[-1]["status"] == status
    assert (tmp_path / "mesh.txt").read_text() == "kept"
    # Who asked for the end waits for it.
    assert (tmp_path / "last_words.txt").read_text() == f"{reason}, hurried: True"


def test_a_full_disk_that_a_library_meets():
    with run_to_end(Progress()) as context:
        raise OSError(errno.ENOSPC, "No space left on device", "cache/kernels.o")
    assert context.status == 5


def test_ctrl_c_that_a_library_makes_another_error_of():
    """numpy does, where it comes in the middle of its import."""
    with run_to_end(Progress()) as context:
        try:
            os.kill(os.getpid(), signal.SIGINT)
        except KeyboardInterrupt as error:
            raise ImportError("do not import numpy from its source directory") from error
    assert context.status == 130


def test_a_second_ctrl_c_cuts_short_what_takes_long(tmp_path):
    process = start("patience", tmp_path)
    for word in ("ready", "saving"):
        assert process.stdout.readline() == word + "\n"
        process.send_signal(signal.SIGINT)
    status, output, summary, _ = finish(process, tmp_path)
    assert status == 130
    assert "error: stopped by Ctrl-C" in output
    # Said before the report is written, or nobody would know of the second one.
    assert "press Ctrl-C again for a short one" in output.partition("error: stopped")[0]
    assert summary["status"] == "partial"
    assert not (tmp_path / "last_words.txt").exists()


def test_handlers_are_put_back():
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with run_to_end(Progress()) as context:
        raise KeyboardInterrupt
    assert context.status == 130
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def full_below(monkeypatch, folder, reserved):
    """Writing as on a disk on which files of `folder` that are there have taken all room but a few bytes."""
    room = sum(path.stat().st_size for path in folder.iterdir()) + reserved

    def write(path, data):
        taken = sum(found.stat().st_size for found in path.parent.iterdir())
        with path.open("wb") as stream:
            stream.write(data[: max(0, room - taken)])
        if len(data) > room - taken:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return len(data)

    monkeypatch.setattr(Path, "write_bytes", write)


@pytest.mark.parametrize(
    ("figures", "kept"), [({"angle_deg": 4.0}, {"angle_deg": 4.0}), ({"rows": list(range(5000))}, {})]
)
def test_a_run_that_fills_the_disk_does_not_pass_for_one_that_goes_on(tmp_path, monkeypatch, figures, kept):
    """Its last summary gets the room that was kept for it; one too long for that says why the run ended."""
    with run_to_end(Progress()) as context:
        context.open_folder(tmp_path)
        assert json.loads((tmp_path / "summary.json").read_text())["status"] == "running"
        full_below(monkeypatch, tmp_path, reserved=0)
        context.summary |= figures
        write_text(tmp_path / "mesh.txt", "too much")
    assert context.status == 5
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["status"] == "partial"
    assert summary["reason"]["what"] == "cannot write mesh.txt: No space left on device"
    assert {name: summary[name] for name in figures if name in summary} == kept
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log.ndjson", "run.lock", "summary.json"]


def test_where_not_even_the_reason_can_be_written_no_summary_stays(tmp_path, monkeypatch):
    with run_to_end(Progress()) as context:
        context.open_folder(tmp_path)
        full_below(monkeypatch, tmp_path, reserved=-summary_module.RESERVED)
        write_text(tmp_path / "mesh.txt", "too much")
    assert context.status == 5
    assert not (tmp_path / "summary.json").exists()


def test_a_run_is_not_complete_before_its_figures_are_written(tmp_path, monkeypatch):
    with run_to_end(Progress()) as context:
        context.open_folder(tmp_path)
        full_below(monkeypatch, tmp_path, reserved=0)
        context.summary["rows"] = list(range(5000))
    assert context.status == 5
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "partial"


def test_a_run_that_was_killed_is_told_by_the_next_one_in_its_folder(tmp_path):
    """The lock is free, so that a summary which says "running" is of a run that is gone."""
    process = start("wait", tmp_path)
    assert process.stdout.readline() == "ready\n"
    process.kill()
    process.communicate()
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "running"
    warned = []
    for _ in range(2):
        messages = []
        with run_to_end(Progress([messages.append])) as context:
            context.open_folder(tmp_path)
        assert context.status == 0
        warned.append([m["what"] for m in messages if m["type"] == "warning"])
    assert ["was interrupted" in what for what in warned[0]] == [True]
    assert warned[1] == []
