"""Work in a forked process that this one watches, so that a crash never ends a command without a message.

A native library (CHOLMOD, BLAS, gmsh, Manifold, Warp) without memory or with a fault ends its process by a
signal, and no Python in it runs again. Therefore another process, which loads no library, waits for it and
reports its end. Both act as one: Ctrl-C, SIGTERM and Ctrl-Z reach the worker once, its exit status is passed
on, and neither survives the other's `kill -9`.
"""

from __future__ import annotations

import faulthandler
import os
import select
import signal
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

from .processes import end_with_input

CRASHED = 71
"""Exit status of a command whose process was ended by a signal, or by a library without a message."""
INTERRUPTED = 130
"""Exit status after Ctrl-C."""
TERMINATED = 143
"""Exit status after SIGTERM."""
GRACE_S = {signal.SIGTERM: 1.0, signal.SIGINT: 2.5}
"""Seconds that a worker asked to stop has to save its results: it answers a cancel in two, Ctrl-C in five. A
library may hold the interpreter for longer, and a report takes longer."""
_PASSED_ON = ("SIGINT", "SIGTERM", "SIGTSTP")
_watcher: list[int] = []
_messages_to: list[int] = []
"""File descriptor for a worker's messages to its watcher."""
_stack_to: list[int] = []
"""File descriptor for Python's stack of a crashing worker: the end of the pipe to its watcher."""


class Crash(NamedTuple):
    """A worker that ended without reporting its exit status.

    signal: its number, or 0 for a library that ended the process itself, with exit status `status`.
    memory_MB: peak of the process. stack: Python's, at the crash, or "". asked: the signal that asked it to
    stop, SIGINT or SIGTERM, whose end is no crash, else 0.
    """

    signal: int
    status: int
    memory_MB: float
    stack: str
    asked: int = 0


def supervised(
    work: Callable[[], int],
    tell: Callable[[Crash], object],
    ends_with_input: bool = False,
    hear: Callable[[bytes], object] | None = None,
) -> int:
    """Run `work` in a fork of this process; return its exit status, or `CRASHED` if it gave none.

    A worker that does not end within `GRACE_S` of Ctrl-C or SIGTERM is killed: status 128 + that signal.
    tell: called in this process, after an unreported end. ends_with_input: end both once standard input
    closes. hear: gets the bytes that the worker sends, and b"" after each second without any. Without fork
    (Windows), or if the system refuses one, `work` runs in this process.
    """
    if not hasattr(os, "fork"):
        return _alone(work, ends_with_input)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    # Linux closes what a process that ends has open from the highest number down. The group has to be told
    # before the worker is gone, through which it is told.
    ends = *os.pipe(), *os.pipe(), *os.pipe(), *os.pipe()
    alive, keep_alive, group_alive, keep_group, status_read, status_write, message_read, message_write = ends
    passed_on = {getattr(signal, name) for name in _PASSED_ON}
    # Until both have their own handlers, neither may receive a signal.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, passed_on)
    try:
        worker = os.fork()
    except OSError:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for end in ends:
            os.close(end)
        return _alone(work, ends_with_input)
    if not worker:
        for end in (keep_group, keep_alive, status_read, message_read):
            os.close(end)
        _become_worker(group_alive, alive, status_write, message_write)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        return _report_status(work, status_write)
    for end in (group_alive, alive, status_write, message_write):
        os.close(end)
    asked: list[int] = []
    before = _pass_on_signals(worker, asked)
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    if ends_with_input:
        end_with_input()
    try:
        ended, usage = _wait_for(worker, message_read, hear)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        os.set_blocking(status_read, False)
        report = b""
        with suppress(BlockingIOError):
            report = os.read(status_read, 1 << 16)
        return _outcome(report, os.waitstatus_to_exitcode(ended), usage, next(iter(asked), 0), tell)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for end in (keep_group, keep_alive, status_read, message_read):
            os.close(end)


def _wait_for(worker: int, messages: int, hear: Callable[[bytes], object] | None) -> tuple[int, Any]:
    """Wait until a worker has ended, passing on its messages; return its wait status and usage."""
    while True:
        if hear is not None:
            ready, _, _ = select.select([messages], [], [], 1.0)
            words = os.read(messages, 1 << 16) if ready else b""
            if ready and not words:
                # Nobody is left who could speak.
                hear = None
            else:
                hear(words)
        # Processes of its own may keep the pipe open.
        number, ended, usage = os.wait4(worker, 0 if hear is None else os.WNOHANG)
        if number:
            return ended, usage


def _alone(work: Callable[[], int], ends_with_input: bool) -> int:
    if ends_with_input:
        end_with_input()
    return work()


def _report_status(work: Callable[[], int], status_write: int) -> int:
    """Run the work and report its exit status to the watcher, before libraries unload and may crash."""
    status = 1
    try:
        status = work()
        return status
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        raise
    finally:
        os.write(status_write, f"status {status}\n".encode())


def _outcome(report: bytes, ended: int, usage: Any, asked: int, tell: Callable[[Crash], object]) -> int:
    """Exit status reported by a worker, else that of a crash."""
    if report.startswith(b"status "):
        return int(report.split()[1])
    if ended == INTERRUPTED:
        # By Ctrl-C before its run began, which it has reported.
        return ended
    # Kilobytes, but on macOS, where they are bytes.
    memory = usage.ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)
    # A library may have put the signal's own handler back, which ends a process where it stands.
    asked = asked or (-ended if -ended in GRACE_S else 0)
    tell(Crash(max(-ended, 0), max(ended, 0), memory, report.decode("utf-8", "replace"), asked))
    return 128 + asked if asked else CRASHED


def _become_worker(group_alive: int, alive: int, status_write: int, message_write: int) -> None:
    # A group of its own: what a terminal sends comes once, from who watches.
    os.setpgid(0, 0)
    # A terminal may stop whoever writes from another group than its own.
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    _watcher[:] = [os.getppid()]
    _end_with(group_alive, alive)
    _stack_to[:] = [status_write]
    # Words are dropped rather than waited for: who watches may be paused.
    os.set_blocking(message_write, False)
    _messages_to[:] = [message_write]
    write_stack_at_crash()


def send(words: bytes) -> None:
    """Tell the process that watches this one, its `hear`, something; no effect without one."""
    for descriptor in _messages_to:
        with suppress(OSError):
            os.write(descriptor, words)


def watcher() -> int:
    """Number of the process that watches this one, to which a request to stop is sent; else of this one."""
    return _watcher[0] if _watcher else os.getpid()


def write_stack_at_crash() -> None:
    """Let this process, if it is a worker, write Python's stack when it crashes.

    To be called again after a library that takes over the signals of crashes, as gmsh does.
    """
    for descriptor in _stack_to:
        # Once enabled it takes no signal back.
        faulthandler.disable()
        with suppress(OSError, ValueError):
            # All threads: the one that crashes may be a library's own, which has no stack of Python's.
            faulthandler.enable(descriptor, all_threads=True)


def _end_with(group_alive: int, alive: int) -> None:
    """Kill this process once the other end of a pipe is closed, as when its holder ends.

    Its process group ends with it: a process that was just starting would otherwise read half of its input
    and print a traceback. They get SIGTERM, which the process that removes shared resources after the others'
    end ignores.
    """
    threading.Thread(target=_wait_for_end, args=(alive,), daemon=True).start()
    if sys.platform == "linux":
        # The thread waits for the interpreter, which a library may hold for minutes; the kernel does not.
        with suppress(OSError):
            _signal_at_end(group_alive, -os.getpgrp(), signal.SIGTERM)
            _signal_at_end(alive, os.getpid(), signal.SIGKILL)


def _signal_at_end(pipe: int, to: int, number: int) -> None:
    """Let the kernel send a signal to a process, or to a group by its negative, when a pipe's end closes."""
    import fcntl

    fcntl.fcntl(pipe, fcntl.F_SETOWN, to)
    fcntl.fcntl(pipe, fcntl.F_SETSIG, number)
    fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)


def _wait_for_end(alive: int) -> None:
    with suppress(OSError):
        os.read(alive, 1)
    os._exit(1)


def _pass_on_signals(worker: int, asked: list[int]) -> dict[int, Any]:
    """Pass signals that ask this process to stop on to the worker; return the former handlers.

    asked: gets the first signal to stop, from which the worker has `GRACE_S` left; a second one leaves it no
    more than SIGTERM does.
    """

    def stop(number: int, frame: Any) -> None:
        left, _ = signal.getitimer(signal.ITIMER_REAL)
        grace = GRACE_S[signal.SIGTERM if asked else signal.Signals(number)]
        if not asked or left > grace:
            signal.setitimer(signal.ITIMER_REAL, grace)
        asked.append(number)
        with suppress(ProcessLookupError):
            os.kill(worker, number)

    def end(number: int, frame: Any) -> None:
        # Its own processes first: they would write to one that is gone.
        with suppress(ProcessLookupError):
            os.killpg(worker, signal.SIGTERM)
            os.kill(worker, signal.SIGKILL)

    def pause(number: int, frame: Any) -> None:
        with suppress(ProcessLookupError):
            os.killpg(worker, signal.SIGSTOP)
        os.kill(os.getpid(), signal.SIGSTOP)
        with suppress(ProcessLookupError):
            os.killpg(worker, signal.SIGCONT)

    handlers = {signal.SIGINT: stop, signal.SIGTERM: stop, signal.SIGALRM: end}
    # Without anyone to resume it, it must not pause.
    if signal.getsignal(signal.SIGTSTP) is not signal.SIG_IGN:
        handlers[signal.SIGTSTP] = pause
    return {number: signal.signal(number, handler) for number, handler in handlers.items()}
