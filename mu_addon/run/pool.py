"""Independent tasks in worker processes."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from ..errors import MuError
from .processes import ctrl_c_ignored, end_with_parent, one_thread_each

Task = TypeVar("Task")
Found = TypeVar("Found")


def each(work: Callable[[Task], Found], tasks: Sequence[Task], workers: int) -> Iterator[tuple[int, Found]]:
    """Number of each task as it is done, and what `work`, a module's own function, found.

    Whoever stops listening ends the processes. Raises what `work` raises, and MuError where a process dies.
    """
    if workers == 1 or len(tasks) < 2:
        for number, task in enumerate(tasks):
            yield number, work(task)
        return
    context = multiprocessing.get_context("spawn")
    with one_thread_each():
        pool = ProcessPoolExecutor(min(workers, len(tasks)), context, end_with_parent)
        try:
            with ctrl_c_ignored():
                numbers = {pool.submit(work, task): number for number, task in enumerate(tasks)}
            for done in as_completed(numbers):
                yield numbers[done], done.result()
        except BrokenProcessPool:
            raise MuError(
                "a worker process ended unexpectedly",
                work.__name__,
                "run the command again, it resumes; if memory is short, use --workers 1",
            ) from None
        finally:
            processes = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.terminate()
                process.join()
