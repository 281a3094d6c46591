"""Limits and signals of processes that share cores and a parent."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import MuError

# With less memory or address space, libraries end a process by a signal or wait for ever.
_LEAST_MB = {"RLIMIT_DATA": 500, "RLIMIT_AS": 2000}
# Time on a core, in ns, after which what a process waited for one says how busy the machine is.
RAN_NS = 3e8
# Simulating a unit takes half a gigabyte a process; more processes than this wait for memory, not for cores.
MOST_WORKERS = 16


def cores() -> int:
    """Number of cores for this process, at most `MOST_WORKERS`: one process for each pays."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(allowed, MOST_WORKERS)


def slowed_by_load() -> float:
    """Factor by which the machine's other work slows a new process, by the load of the last minute.

    Half of the system's load: that also counts work that waits for a disk or has a lower priority.
    """
    load = os.getloadavg()[0] / cores() if hasattr(os, "getloadavg") else 1.0
    return max(0.5 + 0.5 * load, 1.0)


def slowed_so_far() -> float:
    """Factor by which other work slows this process: by its wait for a core, and by the load.

    Their geometric mean, as its wait is that of a second or two. By the load alone where the system does not
    count waits, or this process has hardly run yet.
    """
    try:
        with open("/proc/self/schedstat", encoding="ascii") as file:
            ran_ns, waited_ns, _ = map(int, file.read().split())
    except (OSError, ValueError):
        return slowed_by_load()
    by_wait = (ran_ns + waited_ns) / ran_ns if ran_ns > RAN_NS else slowed_by_load()
    return math.sqrt(by_wait * slowed_by_load())


def end_with_parent() -> None:
    """End this process as soon as its parent has ended, also a killed one."""
    threading.Thread(target=_wait_for_parent, daemon=True).start()


def _wait_for_parent() -> None:
    # Imported late: the command line begins with this module, and loads little.
    import multiprocessing

    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def end_with_input() -> None:
    """End this process as soon as its standard input closes: the other end's holder was killed, or is done.

    Works on every system and without a signal, for a child with a pipe that stays empty.
    """
    threading.Thread(target=_wait_for_input, daemon=True).start()


def _wait_for_input() -> None:
    while os.read(0, 4096):
        pass
    os._exit(1)


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Context whose child processes use one thread each: with a process a core, more only compete."""
    names = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def ctrl_c_held_back() -> Iterator[None]:
    """Context that delays Ctrl-C; child processes started inside never get it, as one process decides for
    all.

    In a terminal it reaches every process. If it were ignored instead, one inside the body would be lost.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: came.append(number))
    # Children inherit what is blocked, not a handler. Python unblocks SIGINT when it starts its tracker of
    # shared resources, which therefore has to be there before.
    if hasattr(signal, "pthread_sigmask"):
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        signal.signal(signal.SIGINT, before if before is not None else signal.SIG_DFL)
        if came:
            signal.raise_signal(signal.SIGINT)


def limit_memory(megabytes: int) -> None:
    """Limit the memory of this process and its future children, in MB; 0 means no limit.

    On Linux only, where memory requested and never touched counts as well; no effect on other systems.
    """
    if megabytes > 0 and sys.platform == "linux":
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (megabytes * 1_000_000, megabytes * 1_000_000))


def require_memory() -> None:
    """Raise MuError if this process has too little memory for its libraries to fail cleanly.

    Without memory, OpenBLAS retries for ever and Manifold crashes; neither can be detected here.
    """
    if sys.platform == "win32":
        return
    import resource

    for name, least in _LEAST_MB.items():
        limit, _ = resource.getrlimit(getattr(resource, name))
        if limit != resource.RLIM_INFINITY and limit < least * 1_000_000:
            option = {"RLIMIT_DATA": "-d", "RLIMIT_AS": "-v"}[name]
            raise MuError(
                f"out of memory: this process may use up to {limit / 1e6:.0f} MB",
                f"the system's limit {name}",
                f"allow {least} MB or more: `ulimit {option} {least * 1000}`, or memory_MB of a sweep",
            )
