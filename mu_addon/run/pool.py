"""Work in separate processes: one pool for candidates, columns and the evidence's simulations."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager
from typing import Any, TypeVar

from ..errors import MuError
from .processes import ctrl_c_held_back, end_with_parent, one_thread_each

Task = TypeVar("Task")
Found = TypeVar("Found")


class WorkerDiedError(MuError):
    """A process of a pool ended before its work."""


class Pool:
    """Processes of one thread each that end with this one; started on demand, until closed.

    what: names their work in errors. start, arguments: called first in each process.
    """

    def __init__(
        self,
        workers: int,
        what: str,
        start: Callable[..., None] | None = None,
        arguments: tuple[Any, ...] = (),
    ) -> None:
        self.workers, self.what = workers, what
        self._begin = start, arguments
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, work: Callable[..., Found], *arguments: Any) -> Future[Found]:
        """Submit `work`, a module-level function, to a process. Raises MuError if a process has died."""
        with one_thread_each():
            _survive_broken_pipes()
            if self._pool is None:
                context = multiprocessing.get_context("spawn")
                self._pool = ProcessPoolExecutor(self.workers, context, _start, self._begin)
            with ctrl_c_held_back(), self._errors():
                return self._pool.submit(work, *arguments)

    def result(self, future: Future[Found]) -> Found:
        """Wait for the result. Raises the work's error, and MuError if a process died."""
        with self._errors():
            return future.result()

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except BrokenProcessPool:
            raise WorkerDiedError(
                "a worker process ended unexpectedly",
                self.what,
                "run the command again, it resumes; if memory is short, use --workers 1",
            ) from None

    def close(self) -> None:
        """End the processes at once, without waiting for their results."""
        if self._pool is None:
            return
        processes = list((self._pool._processes or {}).values())
        self._pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
            process.join()


def each(
    work: Callable[[Task], Found], tasks: Sequence[Task], workers: int, what: str = ""
) -> Iterator[tuple[int, Found]]:
    """Number of each finished task, with the result of `work`, a module-level function.

    what: names the work in errors. The processes end with the iteration. Raises the error of `work`, and
    MuError if a process dies.
    """
    if workers == 1 or len(tasks) < 2:
        for number, task in enumerate(tasks):
            yield number, work(task)
        return
    with closing(Pool(min(workers, len(tasks)), what)) as pool:
        numbers = {pool.submit(work, task): number for number, task in enumerate(tasks)}
        for done in as_completed(numbers):
            yield numbers[done], pool.result(done)


def _start(start: Callable[..., None] | None, arguments: tuple[Any, ...]) -> None:
    end_with_parent()
    # Blocked since this process was made (`ctrl_c_held_back`), but a library may unblock it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if start is not None:
        start(*arguments)


def _survive_broken_pipes() -> None:
    """Ignore SIGPIPE, so that writing to an ended process raises an error and does not end this one.

    The compiler inside Warp resets Python's handler when it starts.
    """
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
