"""Tasks on a Dask cluster: one in this process by default, or that of a scheduler at an address.

Where Dask is not installed, as in Blender, this machine's processes do them.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import attrs

from ...errors import InputError, MuError
from ...run.pool import each
from .point import stop_points

if TYPE_CHECKING:
    from distributed import Client

    from .point import Task

# How often a task is given to another worker when the one that had it was lost, as the scheduler counts.
ATTEMPTS = 5
# Seconds that a scheduler may be away, as when it is restarted.
PATIENCE_S = 60.0
# Seconds without any worker after which that is told.
ALONE_S = 10.0
# Tasks that wait at the scheduler for every thread of its workers.
AHEAD = 3
Work = Callable[["Task"], dict[str, Any]]


@attrs.frozen
class Processes:
    """A number of processes on this machine, without Dask."""

    workers: int

    def results(
        self, tasks: Sequence[Task], work: Work, warn: Callable[[str], None]
    ) -> Generator[tuple[int, dict[str, Any]]]:
        """As `Cluster.results`; raises the errors of `work`, and MuError if a process dies."""
        yield from each(work, tasks, self.workers, "parameter study")

    def close(self) -> None:
        """Do nothing: processes end with the iteration over `results`."""


def cluster_at(scheduler: str | None, workers: int) -> Cluster | Processes:
    """The scheduler at an address, or `workers` here. Raises InputError and MuError."""
    if scheduler is None and find_spec("distributed") is None:
        return Processes(workers)
    return Cluster(scheduler, workers)


class Cluster:
    """A connection to a scheduler, renewed when it is lost."""

    def __init__(self, scheduler: str | None, workers: int) -> None:
        """Connect to the scheduler at an address, or start `workers` here. Raises InputError and MuError."""
        try:
            import distributed
        except ImportError as error:
            raise InputError(
                "parameter studies need Dask, which is not installed", "", "pip install 'mu_addon[sweeps]'"
            ) from error
        self._distributed = distributed
        self._gone = (distributed.CancelledError, distributed.scheduler.KilledWorker)
        self.scheduler = scheduler
        self._local: Any = None
        if scheduler is None:
            # Threads are enough: each task is a process of its own already.
            self._local = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=False,
                dashboard_address="127.0.0.1:0",
                memory_limit=0,
            )
        self.client = self._connected(PATIENCE_S)

    def _connected(self, patience_s: float) -> Client:
        address = self._local if self._local is not None else self.scheduler
        try:
            return self._distributed.Client(address, timeout=patience_s)
        except (OSError, ValueError, TypeError) as error:
            raise MuError(
                f"no scheduler answers: {error}",
                self.scheduler or "this machine",
                "start one with `dask scheduler`, and give its address as --scheduler tcp://host:8786",
            ) from error

    def reconnect(self) -> None:
        """Connect again to a restarted scheduler. Raises MuError after a timeout."""
        with suppress(Exception):
            self.client.close(timeout=1)
        end = time.monotonic() + PATIENCE_S
        while True:
            try:
                self.client = self._connected(5.0)
                return
            except MuError:
                if time.monotonic() > end:
                    raise
                time.sleep(1.0)

    @property
    def threads(self) -> int:
        """Number of threads of all present workers."""
        return sum(self.client.nthreads().values())

    def close(self) -> None:
        """Leave the scheduler, and end the workers started here with their tasks."""
        _quieten()
        if self._local is not None:
            stop_points()
        with suppress(Exception):
            self.client.close(timeout=2)
        if self._local is not None:
            with suppress(Exception):
                self._local.close(timeout=2)
            # Those that began in the meantime, in the place of the stopped.
            stop_points()

    def results(
        self, tasks: Sequence[Task], work: Work, warn: Callable[[str], None]
    ) -> Generator[tuple[int, dict[str, Any]]]:
        """Number of each finished task, with the result of `work` or its failure, in any order.

        A task whose worker is lost goes to another; a restarted scheduler gets all unfinished ones again.
        Raises MuError if it stays away.
        """
        waiting = list(range(len(tasks)))[::-1]
        attempts = dict.fromkeys(waiting, 0)
        running: dict[Any, int] = {}
        alone_since: float | None = None
        while waiting or running:
            try:
                threads = self.threads
                if threads:
                    alone_since = None
                elif alone_since is None:
                    alone_since = time.monotonic()
                elif time.monotonic() - alone_since > ALONE_S:
                    alone_since = float("inf")
                    warn(
                        "no worker is connected to the scheduler: the parameter study waits for one (`dask "
                        "worker`)"
                    )
                while waiting and len(running) < max(AHEAD * threads, 1):
                    number = waiting.pop()
                    name = f"point-{tasks[number].name}-{number}-{attempts[number]}-{time.time_ns()}"
                    running[self.client.submit(work, tasks[number], key=name, pure=False)] = number
                self._wait(list(running))
                gone = self.client.status not in ("running", "connecting")
            except OSError:
                gone = True
            lost = [n for future, n in running.items() if gone or future.status in ("cancelled", "lost")]
            if not gone:
                yield from self._ended(running)
            running = {future: n for future, n in running.items() if n not in lost}
            for number in lost:
                attempts[number] += 1
                if attempts[number] > ATTEMPTS:
                    yield number, _lost("the scheduler abandoned it repeatedly")
                else:
                    waiting.append(number)
            if lost:
                warn(f"the scheduler was lost, and {len(lost)} points with it: they are submitted again")
            if gone:
                self.reconnect()

    def _ended(self, running: dict[Any, int]) -> Iterator[tuple[int, dict[str, Any]]]:
        """Number and row of each ended task, which is removed from those that run."""
        for future, number in list(running.items()):
            if future.status == "finished":
                try:
                    found = future.result(timeout=PATIENCE_S)
                except (OSError, *self._gone):
                    # Its worker was lost before it was asked; the scheduler has it done again.
                    continue
            elif future.status == "error":
                found = self._failed(future)
            else:
                continue
            del running[future]
            yield number, found

    def _wait(self, futures: list[Any]) -> None:
        """Wait until one of them is done, or for a second."""
        with suppress(TimeoutError, self._distributed.CancelledError):
            self._distributed.wait(futures, timeout=1.0, return_when="FIRST_COMPLETED")

    def _failed(self, future: Any) -> dict[str, Any]:
        error = future.exception()
        if isinstance(error, self._distributed.scheduler.KilledWorker):
            return _lost("every worker that ran it was lost")
        if isinstance(error, MuError):
            return _lost(error.what, error.where, error.remedy)
        return _lost(f"{type(error).__name__}: {error}")


def _quieten() -> None:
    """Silence Dask's tracebacks at shutdown, of abandoned tasks."""
    for name in list(logging.root.manager.loggerDict):
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _lost(
    what: str, where: str = "worker", remedy: str = "see the worker's log; run again"
) -> dict[str, Any]:
    # Not the study's own doing: the next run tries again.
    return {"status": "failed", "what": what, "where": where, "what_to_do": remedy, "again": True}
