"""Tasks on the workers of a Dask scheduler, each done even if its worker or the scheduler is lost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from ..errors import InputError, MuError

if TYPE_CHECKING:
    from distributed import Client

# How often a task is given to another worker when the one that had it was lost, as the scheduler counts.
ATTEMPTS = 5
# Seconds that a scheduler may be away, as when it is restarted.
PATIENCE_S = 60.0
# Seconds without any worker after which that is told.
ALONE_S = 10.0
# Tasks that wait at the scheduler for every thread of its workers.
AHEAD = 3


class LostError(MuError):
    """A task could not be done by any worker; the next run tries again."""

    def __init__(self, what: str) -> None:
        super().__init__(what, "worker", "see the worker's log; run again")


class Cluster:
    """A connection to a scheduler, renewed when it is lost. Raises InputError and MuError."""

    def __init__(self, scheduler: str) -> None:
        try:
            import distributed
        except ImportError as error:
            raise InputError(
                "a scheduler needs Dask, which is not installed",
                "--scheduler",
                "pip install 'mu_addon[sweeps]'",
            ) from error
        self._distributed = distributed
        self._gone = (distributed.CancelledError, distributed.scheduler.KilledWorker)
        self.scheduler = scheduler
        self.client = self._connected(PATIENCE_S)

    def _connected(self, patience_s: float) -> Client:
        try:
            return self._distributed.Client(self.scheduler, timeout=patience_s)
        except (OSError, ValueError, TypeError) as error:
            raise MuError(
                f"no scheduler answers: {error}",
                self.scheduler,
                "start one with `dask scheduler`, and give its address as --scheduler tcp://host:8786",
            ) from error

    def reconnect(self) -> None:
        """Connect again to a restarted scheduler. Raises MuError after a timeout."""
        self.close()
        end = time.monotonic() + PATIENCE_S
        while True:
            try:
                self.client = self._connected(5.0)
                return
            except MuError:
                if time.monotonic() > end:
                    raise
                time.sleep(1.0)

    def close(self) -> None:
        """Leave the scheduler, which drops what it was given."""
        with suppress(Exception):
            self.client.close(timeout=1)

    def results(
        self, tasks: Sequence[tuple[Any, ...]], work: Callable[..., Any], warn: Callable[[str], None]
    ) -> Iterator[tuple[int, Any]]:
        """Number of each finished task in any order, with the result of `work` or the MuError that it raised.

        tasks: values for `work`. A task whose worker is lost goes to another; a restarted scheduler gets all
        unfinished ones again. Raises MuError if it stays away.
        """
        waiting = list(range(len(tasks)))[::-1]
        attempts = dict.fromkeys(waiting, 0)
        running: dict[Any, int] = {}
        alone_since: float | None = None
        while waiting or running:
            try:
                threads = sum(self.client.nthreads().values())
                if threads:
                    alone_since = None
                elif alone_since is None:
                    alone_since = time.monotonic()
                elif time.monotonic() - alone_since > ALONE_S:
                    alone_since = float("inf")
                    warn("no worker is connected to the scheduler: the run waits for one (`dask worker`)")
                while waiting and len(running) < max(AHEAD * threads, 1):
                    number = waiting.pop()
                    name = f"mu-{number}-{attempts[number]}-{time.time_ns()}"
                    running[self.client.submit(work, *tasks[number], key=name, pure=False)] = number
                with suppress(TimeoutError, self._distributed.CancelledError):
                    self._distributed.wait(list(running), timeout=1.0, return_when="FIRST_COMPLETED")
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
                    yield number, LostError("the scheduler abandoned it repeatedly")
                else:
                    waiting.append(number)
            if lost:
                warn(f"the scheduler was lost, and {len(lost)} tasks with it: they are submitted again")
            if gone:
                self.reconnect()

    def _ended(self, running: dict[Any, int]) -> Iterator[tuple[int, Any]]:
        """Number and result of each ended task, which is removed from those that run."""
        for future, number in list(running.items()):
            if future.status == "finished":
                try:
                    found = future.result(timeout=PATIENCE_S)
                except (OSError, *self._gone):
                    # Its worker was lost before it was asked; the scheduler has it done again.
                    continue
            elif future.status == "error":
                found = self._failed(future.exception())
            else:
                continue
            del running[future]
            yield number, found

    def _failed(self, error: BaseException) -> MuError:
        if isinstance(error, self._distributed.scheduler.KilledWorker):
            return LostError("every worker that ran it was lost")
        return error if isinstance(error, MuError) else LostError(f"{type(error).__name__}: {error}")
