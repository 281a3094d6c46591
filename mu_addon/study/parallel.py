"""Many candidates on several cores: processes that are each given the mesh and the baseline once."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

import attrs
import numpy as np

from ..errors import MuError
from ..fem.kinematics import probe
from ..fem.model import Materials, Model
from ..fem.trajectory import Trajectory
from ..meshing.mesh import Mesh
from ..placement.candidates import Candidate, Evaluation, evaluate

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Setting:
    """What all candidates of one mesh share; plain data, so that it travels to another process."""

    mesh: Mesh
    materials: Materials
    baseline: Trajectory
    anchors: Array
    radius_mm: float
    sensor_MPa: float
    stations: int


class Evaluator:
    """Evaluates candidates of one setting, building its model once."""

    def __init__(self, setting: Setting, threads: int) -> None:
        self.setting = setting
        self.model = Model(setting.mesh, threads=threads)
        self.monitored = setting.anchors, probe(setting.mesh, setting.anchors)

    def __call__(self, candidate: Candidate, rule: str) -> Evaluation:
        """Evaluate one candidate under one inclusion rule. Raises ConvergenceError."""
        s = self.setting
        return evaluate(
            self.model,
            s.materials,
            s.baseline,
            self.monitored,
            candidate,
            rule,
            s.radius_mm,
            s.sensor_MPa,
            s.stations,
        )


_evaluator: Evaluator | None = None


def _start(setting: Setting) -> None:
    global _evaluator
    # A parent that was killed cannot end its workers.
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _evaluator = Evaluator(setting, threads=1)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(number: int, candidate: Candidate, rule: str) -> tuple[int, Evaluation]:
    assert _evaluator is not None
    return number, _evaluator(candidate, rule)


def _survive_broken_pipes() -> None:
    """Writing to a process that has ended must be an error, as Python has it, not the end of this one.

    The compiler inside Warp resets what Python had set when it starts.
    """
    if hasattr(signal, "SIGPIPE"):
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)


@contextmanager
def _ctrl_c_ignored() -> Iterator[None]:
    """Children born inside inherit this: Ctrl-C reaches a terminal's every process, and one decides."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before if before is not None else signal.SIG_DFL)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Children inherit these: with a process a core, more threads a process only get in each other's way."""
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


def evaluate_all(
    setting: Setting, jobs: Sequence[tuple[Candidate, str]], workers: int
) -> Iterator[tuple[int, Evaluation]]:
    """Number and evaluation of each (candidate, rule) as it is finished, the same for any `workers`.

    Raises the first ConvergenceError of any, and ends the other processes when the caller stops early.
    """
    if workers == 1 or len(jobs) < 2:
        evaluator = Evaluator(setting, threads=1)
        for number, (candidate, rule) in enumerate(jobs):
            yield number, evaluator(candidate, rule)
        return
    context = multiprocessing.get_context("spawn")
    with _one_thread_each():
        _survive_broken_pipes()
        pool = ProcessPoolExecutor(min(workers, len(jobs)), context, _start, (setting,))
        try:
            with _ctrl_c_ignored():
                waiting = [pool.submit(_work, n, *job) for n, job in enumerate(jobs)]
            for done in as_completed(waiting):
                yield done.result()
        except BrokenProcessPool:
            raise MuError(
                "a worker process ended before its time",
                "candidates",
                "run again, it resumes; if memory is short give --workers 1",
            ) from None
        finally:
            # Whoever stops early should not wait for work that nobody will read.
            processes = list((pool._processes or {}).values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in processes:
                process.terminate()
                process.join()
