"""What a command says whose process is ended by a signal, as by a library that is refused memory."""

import json
import os
import resource
import signal
import subprocess
import time

import attrs
import pytest

from mu_addon.cli.watched import tell_crash
from mu_addon.design.parameters import load_preset, to_toml
from mu_addon.run.child import FAILED, RUNNING, Child
from mu_addon.run.context import run_to_end
from mu_addon.run.folder import keep_inputs
from mu_addon.run.progress import Progress
from mu_addon.run.summary import RESERVED, record_crash
from mu_addon.run.supervisor import CRASHED, Crash

from .processes import JOB, PATIENCE_S, assert_clear_failure, command, run, worker_of

SIMULATION = attrs.evolve(JOB, stages=("design", "simulate"))


@pytest.mark.slow
def test_it_says_where_it_stood(tmp_path):
    """A run that a signal ended says so, in its last message, summary and log."""
    keep_inputs(tmp_path, SIMULATION.texts())
    words = command("resume", tmp_path, "--no-report", "--json")
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not list(tmp_path.glob("cache/states-*")):
        assert process.poll() is None
        time.sleep(0.002)
    os.kill(worker_of(tmp_path), signal.SIGSEGV)
    output, errors = process.communicate(timeout=PATIENCE_S)
    # Its last message is for programs, too.
    last = json.loads(output.splitlines()[-1])
    assert (last["type"], last["status"]) == ("error", CRASHED)
    assert last["where"]
    assert last["what_to_do"]
    done = subprocess.CompletedProcess(words, process.returncode, output, errors)
    words = ("SIGSEGV", "in stage Model A", "nodes and", "MB of memory", "resume")
    assert_clear_failure(done, CRASHED, *words)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["status"] == "partial"
    assert "SIGSEGV" in summary["reason"]["what"]
    assert json.loads((tmp_path / "log.ndjson").read_text().splitlines()[-1])["status"] == CRASHED


@pytest.mark.slow
def test_a_child_of_blender_or_a_sweep_tells_it(tmp_path):
    keep_inputs(tmp_path, SIMULATION.texts())
    words = [command()[0], "-m", "mu_addon.cli", "resume", str(tmp_path), "--json", "--no-report"]
    child = Child(words, tmp_path / "words", os.environ, ends_with_parent=True)
    end = time.monotonic() + PATIENCE_S
    while not (tmp_path / "unit.stl").exists():
        assert time.monotonic() < end
        time.sleep(0.002)
    os.kill(worker_of(tmp_path), signal.SIGSEGV)
    while child.state == RUNNING:
        child.poll()
        assert time.monotonic() < end
        time.sleep(0.02)
    assert child.state == FAILED
    assert "SIGSEGV" in child.error["what"]
    assert child.error["status"] == CRASHED
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "partial"


@pytest.mark.slow
def test_a_solid_that_finds_no_memory(tmp_path):
    """Manifold, refused memory by the system, ends its process by a signal or is told of by C++."""
    file = tmp_path / "unit.toml"
    file.write_text(to_toml(attrs.evolve(load_preset("mu-1.0x"), scale=2.5)))
    most = 520_000_000

    def limit():
        resource.setrlimit(resource.RLIMIT_DATA, (most, most))

    words = ("export", "--unit", file, "--path", "alpha4", "--formats", "stl", "--out", tmp_path / "out")
    done = run(*words, preexec_fn=limit)
    assert done.returncode in (1, CRASHED), done.stderr
    assert_clear_failure(done, done.returncode, "memory", "what to do")
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["status"] == "partial"
    assert not list((tmp_path / "out").rglob("*.part*"))


def test_who_was_asked_to_stop_and_could_not_answer_is_cancelled_with_what_it_had(tmp_path, capsys):
    (tmp_path / "summary.json").write_text('{"status": "running", "angle_deg": {"40": 30.5}}')
    asked = Crash(signal.SIGKILL, 0, 900.0, "", asked=signal.SIGTERM)
    for _ in range(2):
        tell_crash(["resume", str(tmp_path), "--json"], asked)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["status"], summary["angle_deg"]) == ("cancelled", {"40": 30.5})
    assert "memory" not in str(summary)
    (said,) = capsys.readouterr().out.splitlines()
    assert (json.loads(said)["what"], json.loads(said)["status"]) == ("cancelled", 143)


def test_after_ctrl_c_a_run_that_could_not_answer_leaves_a_report_that_says_so(tmp_path, capsys):
    """Its tables are shown; the next start removes it: it never passes for that of a run that ended."""
    (tmp_path / "summary.json").write_text('{"status": "running", "seconds": {"mesh <1>": 61.0}}')
    (tmp_path / "designs.csv").write_text("# of a search\nwall_mm,mass_g\n" + "0.9,31.5\n" * 25)
    (tmp_path / "report.html").write_text("<html>that of a run before</html>")
    tell_crash(["resume", str(tmp_path)], Crash(signal.SIGKILL, 0, 900.0, "", asked=signal.SIGINT))
    assert "error: stopped by Ctrl-C" in capsys.readouterr().err
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["status"], summary["reason"]["what"]) == ("partial", "stopped by Ctrl-C")
    report = (tmp_path / "report.html").read_text()
    for words in ("This run is partial: stopped by Ctrl-C", "mesh &lt;1&gt;", "1 min 01 s", "5 rows more"):
        assert words in report
    assert report.count("31.5") == 20
    with run_to_end(Progress()) as context:
        context.open_folder(tmp_path)
    assert not (tmp_path / "report.html").exists()
    # Without a report where none is wanted.
    (tmp_path / "summary.json").write_text('{"status": "running"}')
    tell_crash(["resume", str(tmp_path), "--no-report"], Crash(9, 0, 900.0, "", asked=signal.SIGINT))
    assert not (tmp_path / "report.html").exists()


def test_a_folder_whose_run_has_ended_or_another_has_is_left_as_it_is(tmp_path):
    from mu_addon.errors import MuError
    from mu_addon.run.lock import FolderLock

    error = MuError("crashed", "there", "this")
    record_crash(tmp_path, error)
    assert not list(tmp_path.iterdir())
    (tmp_path / "summary.json").write_text('{"status": "complete"}')
    record_crash(tmp_path, error)
    assert (tmp_path / "summary.json").read_text() == '{"status": "complete"}'
    running = '{"status": "running"}'.ljust(RESERVED)
    (tmp_path / "summary.json").write_text(running)
    lock = FolderLock(tmp_path)
    record_crash(tmp_path, error)
    assert (tmp_path / "summary.json").read_text() == running
    lock.release()
    record_crash(tmp_path, error, "a stack")
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "partial"
    kinds = [json.loads(line)["type"] for line in (tmp_path / "log.ndjson").read_text().splitlines()]
    assert kinds == ["traceback", "error"]


@pytest.mark.parametrize("words", [("--help",), ("place", "--help"), ("presets",)])
def test_what_solves_nothing_is_not_watched(words, tmp_path):
    """One process, as the system counts it: no second one is paid for."""
    code = "import os, runpy, sys; os.fork = None; sys.argv[0] = sys.argv[1]; del sys.argv[1]; "
    code += "runpy.run_path(sys.argv[0], run_name='__main__')"
    python, script = command()[:2]
    done = subprocess.run([python, "-c", code, script, *words], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
