"""A process that another one watches: what it says is handed on, what it cannot say is said for it."""

import os
import signal
import subprocess
import sys
import time

import pytest

from mu_addon.run.supervisor import CRASHED, supervised

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are watched where they can fork")
PATIENCE_S = 1800.0

RUN = """
import atexit, ctypes, itertools, os, signal, sys, time
from mu_addon.run.supervisor import supervised

how = sys.argv[1]


def stopped(number, frame):
    print("worker", signal.Signals(number).name, flush=True)
    if how == "waits":
        sys.exit(128 + number)


def work():
    signal.signal(signal.SIGINT, stopped)
    signal.signal(signal.SIGTERM, stopped)
    print(os.getpid(), flush=True)
    if how == "waits" or how == "counts":
        for _ in range(36000):
            time.sleep(0.1)
    if how == "reads nothing":
        ctypes.string_at(0)
    if how == "aborts":
        os.abort()
    if how == "aborts in a thread of a library":
        libc, thread = ctypes.CDLL(None), ctypes.c_ulong()
        libc.pthread_create(ctypes.byref(thread), None, ctypes.cast(libc.abort, ctypes.c_void_p), None)
        time.sleep(3600)
    if how == "reads nothing after gmsh":
        import gmsh
        from mu_addon.meshing.gmsh_model import gmsh_model
        with gmsh_model(gmsh):
            ctypes.string_at(0)
    if how == "starts another":
        import subprocess

        words = "import sys; print('born', flush=True); sys.stdin.read(); raise EOFError"
        half = subprocess.Popen([sys.executable, "-c", words], stdin=subprocess.PIPE)
        time.sleep(3600)
    if how == "ends itself":
        # As a library does: nothing of Python's runs any more.
        ctypes.CDLL(None)._exit(3)
    if how == "crashes late":
        atexit.register(os.abort)
    if how == "refuses":
        sys.exit(2)
    if how == "is wrong":
        raise RuntimeError("a fault")
    if how == "has its own handler":
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        print("ready", flush=True)
        time.sleep(3600)
    if how == "hears nothing":
        # No line of Python's runs, and so no handler.
        sum(itertools.repeat(1))
    if how == "holds the interpreter":
        ctypes.PyDLL(None).sleep(3600)
    return 5


def tell(crash):
    memory = "MB" if crash.memory_MB > 1 else "nothing"
    stack = "stack" if "in work" in crash.stack else "-"
    print("crash", crash.signal, crash.status, memory, stack, *[f"asked:{crash.asked}"] * bool(crash.asked))


sys.exit(supervised(work, tell, ends_with_input=len(sys.argv) > 2))
"""


def start(how, *more):
    process = subprocess.Popen(
        [sys.executable, "-c", RUN, how, *more],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    # Byte by byte: what a buffer held of the next line `communicate` would not find.
    line = b""
    while not line.endswith(b"\n"):
        byte = os.read(process.stdout.fileno(), 1)
        assert byte, process.stderr.read()
        line += byte
    return process, int(line)


def alive(pid):
    """Whether a process is there and has not ended."""
    try:
        with open(f"/proc/{pid}/stat") as stream:
            return stream.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_until_gone(pid):
    end = time.monotonic() + PATIENCE_S
    while alive(pid):
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("how", "status"), [("returns", 5), ("refuses", 2), ("is wrong", 1), ("crashes late", 5)]
)
def test_a_status_is_handed_on(how, status):
    """What crashes while libraries are unloaded takes nothing from a run that has said its end."""
    process, worker = start(how)
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert worker != process.pid
    assert process.returncode == status, errors
    assert "crash" not in output


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ("reads nothing", f"crash {int(signal.SIGSEGV)} 0 MB stack"),
        ("aborts", f"crash {int(signal.SIGABRT)} 0 MB stack"),
        ("aborts in a thread of a library", f"crash {int(signal.SIGABRT)} 0 MB stack"),
        ("reads nothing after gmsh", f"crash {int(signal.SIGSEGV)} 0 MB stack"),
        ("ends itself", "crash 0 3 MB -"),
    ],
)
def test_a_crash_is_told_by_who_watches(how, told):
    process, _ = start(how)
    output, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == CRASHED
    assert output.strip() == told, errors


def test_a_kill_of_the_worker_is_told():
    process, worker = start("waits")
    os.kill(worker, signal.SIGKILL)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == CRASHED
    assert output.startswith(f"crash {int(signal.SIGKILL)} 0")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("to_group", [False, True], ids=["the process", "its group, as a terminal does"])
def test_a_request_to_stop_comes_once(number, to_group):
    process, worker = start("waits")
    if to_group:
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 128 + number
    assert output.split() == ["worker", signal.Signals(number).name]
    assert not alive(worker)


@pytest.mark.parametrize(
    ("numbers", "within_s"),
    [([signal.SIGTERM], 2.0), ([signal.SIGINT], 5.0), ([signal.SIGINT, signal.SIGINT], 2.0)],
)
def test_a_worker_that_hears_nothing_is_ended_all_the_same(numbers, within_s):
    """A library holds the interpreter for minutes; whoever cancels does not wait for it."""
    process, worker = start("hears nothing")
    began = time.monotonic()
    for number in numbers:
        process.send_signal(number)
        time.sleep(0.2)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert time.monotonic() - began < within_s
    assert process.returncode == 128 + numbers[0]
    assert output.split()[-1] == f"asked:{int(numbers[0])}"
    assert not alive(worker)


def test_a_library_that_put_the_signals_own_handler_back_is_no_crash():
    process, worker = start("has its own handler")
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert output.split()[-1] == f"asked:{int(signal.SIGINT)}"
    assert not alive(worker)


def test_every_request_is_passed_on():
    process, worker = start("counts")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
        process.send_signal(number)
        assert process.stdout.readline() == f"worker {signal.Signals(number).name}\n"
    process.kill()
    process.communicate(timeout=PATIENCE_S)
    wait_until_gone(worker)


@pytest.mark.skipif(sys.platform != "linux", reason="/proc tells how a process is")
@pytest.mark.parametrize("how", ["waits", "holds the interpreter"])
def test_the_worker_ends_with_who_watches(how):
    """Also where a library holds the interpreter, so that no thread of Python's runs."""
    process, worker = start(how)
    assert alive(worker)
    process.kill()
    process.communicate(timeout=PATIENCE_S)
    wait_until_gone(worker)


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel ends a group with a pipe on Linux only")
def test_a_process_that_the_worker_was_starting_shows_no_stack_after_a_kill():
    """It waits for words that end half way when its parent is gone."""
    process, _ = start("starts another")
    assert process.stdout.readline() == "born\n"
    process.kill()
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert errors == ""


@pytest.mark.skipif(sys.platform != "linux", reason="/proc tells how a process is")
def test_both_end_with_the_input_of_who_watches():
    process, worker = start("waits", "ends with input")
    assert alive(worker)
    process.stdin.close()
    assert process.wait(timeout=PATIENCE_S) == 1
    process.stdout.close()
    process.stderr.close()
    wait_until_gone(worker)


def state_of(pid):
    with open(f"/proc/{pid}/stat") as stream:
        return stream.read().rpartition(")")[2].split()[0]


@pytest.mark.skipif(sys.platform != "linux", reason="/proc tells how a process is")
def test_paused_and_gone_on_with_as_one():
    process, worker = start("waits")
    end = time.monotonic() + PATIENCE_S
    for number, states in ((signal.SIGTSTP, "T"), (signal.SIGCONT, "RS")):
        process.send_signal(number)
        while not all(state_of(pid) in states for pid in (process.pid, worker)):
            assert time.monotonic() < end
            time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 143


def test_without_a_second_process_the_work_is_done_here(monkeypatch):
    def refused():
        raise BlockingIOError("no process more")

    monkeypatch.setattr(os, "fork", refused)
    before = len(os.listdir("/dev/fd")), signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert supervised(os.getpid, print) == os.getpid()
    assert (len(os.listdir("/dev/fd")), signal.pthread_sigmask(signal.SIG_BLOCK, ())) == before
    monkeypatch.delattr(os, "fork")
    assert supervised(os.getpid, print) == os.getpid()
