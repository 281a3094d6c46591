"""Workers leave Ctrl-C to their parent."""

import os
import signal
import subprocess
import sys
import threading
from contextlib import closing

import pytest

from mu_addon.run import processes
from mu_addon.run.pool import Pool
from mu_addon.run.processes import ctrl_c_held_back, slowed_so_far

WORK = "import sys, time; print('ready', flush=True); time.sleep(3600)"


def child():
    process = subprocess.Popen([sys.executable, "-c", WORK], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "ready\n"
    return process


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")
def test_a_child_born_inside_outlives_ctrl_c_and_one_born_outside_does_not():
    # A shell's background jobs are born deaf to Ctrl-C, and so would be their children.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with ctrl_c_held_back():
        inside = child()
    outside = child()
    try:
        for process in (inside, outside):
            process.send_signal(signal.SIGINT)
        outside.wait(1800)
        with pytest.raises(subprocess.TimeoutExpired):
            inside.wait(1)
    finally:
        signal.signal(signal.SIGINT, before)
        for process in (inside, outside):
            process.kill()
            process.communicate()


def test_the_parent_s_own_handler_is_back_afterwards():
    before = signal.getsignal(signal.SIGINT)
    with ctrl_c_held_back():
        assert signal.getsignal(signal.SIGINT) is not before
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for one process")
def test_ctrl_c_inside_is_not_lost_but_comes_afterwards():
    came, before = [], signal.signal(signal.SIGINT, lambda number, frame: came.append("now"))
    try:
        with ctrl_c_held_back():
            os.kill(os.getpid(), signal.SIGINT)
            came.append("inside")
        assert came == ["inside", "now"]
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_thread_that_may_not_set_signals_goes_on_without():
    done = []

    def work():
        with ctrl_c_held_back():
            done.append(True)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [True]


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory are counted in another way")
@pytest.mark.parametrize(("limit", "option"), [("RLIMIT_DATA", "-d"), ("RLIMIT_AS", "-v")])
def test_a_limit_in_which_libraries_crash_is_refused_before_they_do(limit, option):
    """Within 90 MB OpenBLAS asks for memory for ever, within 150 Manifold ends the process by a signal."""
    code = f"""
import resource
from mu_addon.errors import MuError
from mu_addon.run.processes import require_memory
require_memory()
resource.setrlimit(resource.{limit}, (90_000_000, resource.RLIM_INFINITY))
try:
    require_memory()
except MuError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "this process may use up to 90 MB" in done.stdout, done.stderr
    assert f"ulimit {option} " in done.stdout


def test_a_process_that_hardly_ran_goes_by_the_load(monkeypatch):
    assert slowed_so_far() >= 1.0
    monkeypatch.setattr(processes, "RAN_NS", float("inf"))
    monkeypatch.setattr(processes, "slowed_by_load", lambda: 2.5)
    assert slowed_so_far() == 2.5


def interrupted():
    """Start of a process whose library unblocks Ctrl-C just as it comes."""
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    os.kill(os.getpid(), signal.SIGINT)


@pytest.mark.skipif(os.name == "nt", reason="Windows blocks no signals")
def test_a_process_of_a_pool_leaves_ctrl_c_to_its_parent_whatever_a_library_unblocks():
    with closing(Pool(1, "work", interrupted)) as pool:
        assert pool.result(pool.submit(abs, -3)) == 3
