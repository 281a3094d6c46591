"""Candidates on several cores: processes that receive the mesh and the baseline once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, as_completed
from typing import TYPE_CHECKING, Any, NamedTuple

import attrs
import numpy as np

from ...body.candidates import PrintedWaveguides
from ...errors import ConvergenceError
from ...fem.state import State
from ...meshing.mesh import Mesh
from ...placement.candidates import Candidate
from ...run.pool import Pool

if TYPE_CHECKING:
    from .job import Job

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class CandidateProblem:
    """Candidates of a study to be solved; plain data, so that it can be sent to another process.

    mesh: of the job's unit. anchors (p, 3) in mm: the monitored points. whole: the displacement of the whole
    mesh is also kept.
    """

    job: Job
    mesh: Mesh
    anchors: Array
    candidates: tuple[Candidate, ...]
    whole: bool = False


class Moved(NamedTuple):
    """A candidate's results at a state: anchors (p, 3) in mm, and its difference from Model A.

    whole (n, 3) in mm, of the whole mesh in single precision, or (0, 3) where it is not kept.
    """

    anchors: Array
    whole: Array


class Solved(NamedTuple):
    """A candidate's results by pressure in MPa; missed: why it does not reach others."""

    found: dict[float, Moved]
    missed: dict[float, str]


Ways = Sequence[Sequence[State]]
"""For each state that a candidate is solved at: Model A's states from rest to it, in order of pressure."""


class Evaluator:
    """Solves candidates of a setting at states of Model A, having built the last one's model once."""

    def __init__(self, setting: CandidateProblem, threads: int) -> None:
        job = setting.job
        self._whole = setting.whole
        self.printed = PrintedWaveguides(
            job.unit,
            setting.mesh,
            tuple(candidate.points for candidate in setting.candidates),
            setting.anchors,
            job.materials,
            lambda mesh: job.model(mesh, threads),
            job.newton,
            job.body,
        )

    def __call__(self, candidate: int, ways: Ways) -> Solved:
        """Results of a candidate, by number, at the last of the states of each way.

        And at those before it where it had to be followed through them, see `PrintedWaveguides.states`.
        """
        found, missed = dict[float, Moved](), dict[float, str]()
        for way in ways:
            if way[-1].pressure_MPa in found:
                continue
            try:
                states = self.printed.states(candidate, way)
            except ConvergenceError as error:
                missed[way[-1].pressure_MPa] = error.what
                continue
            points = self.printed.points(states)
            for state, own, anchors in zip(way[-len(states) :], states, points, strict=True):
                whole = self.printed.of_unit(candidate, own) - state.u if self._whole else np.empty((0, 3))
                found.setdefault(state.pressure_MPa, Moved(anchors, whole.astype(np.float32)))
        return Solved(found, missed)


_evaluator: Evaluator | None = None


def _start(setting: CandidateProblem) -> None:
    global _evaluator
    _evaluator = Evaluator(setting, threads=1)


def _work(candidate: int, ways: Ways) -> Solved:
    assert _evaluator is not None
    return _evaluator(candidate, ways)


def _work_alone(candidate: int, pressures_MPa: Array) -> Array:
    assert _evaluator is not None
    return _evaluator.printed.alone(candidate, pressures_MPa)


def _work_in_time(candidate: int, time_s: Array, pressure_kPa: Array) -> Array:
    assert _evaluator is not None
    return _evaluator.printed.simulated_in_time(candidate, time_s, pressure_kPa)


class CandidatePool:
    """Processes that solve a setting's candidates at states of Model A; started on demand, until closed."""

    def __init__(self, setting: CandidateProblem, workers: int) -> None:
        self.setting, self.workers = setting, workers
        self._here: Evaluator | None = None
        self._pool = Pool(workers, "candidates", _start, (setting,))
        self._submitted: dict[tuple[int, float], Future[Solved]] = {}

    @property
    def _evaluator(self) -> Evaluator:
        """Evaluator in this process, for one worker."""
        self._here = self._here or Evaluator(self.setting, threads=1)
        return self._here

    def submit(self, candidate: int, ways: Ways) -> list[Future[Solved]]:
        """Submit a task of `solve` to a process, without what was; needs two workers or more."""
        new = [way for way in ways if (candidate, way[-1].pressure_MPa) not in self._submitted]
        if new:
            done = self._pool.submit(_work, candidate, new)
            self._submitted |= {(candidate, way[-1].pressure_MPa): done for way in new}
        return list(dict.fromkeys(self._submitted[candidate, way[-1].pressure_MPa] for way in ways))

    def leave_out(self, pressure_MPa: float) -> None:
        """Drop submitted tasks at a pressure that no process has begun."""
        dropped = {done for (_, p), done in self._submitted.items() if p == pressure_MPa and done.cancel()}
        self._submitted = {one: done for one, done in self._submitted.items() if done not in dropped}

    def alone(self, tasks: Sequence[tuple[int, Array]]) -> list[Array]:
        """Anchors (s, p, 3) in mm that candidates, by number, move along their paths through pressures (s,).

        Of each candidate as far as it has an equilibrium; ConvergenceError for one without any.
        """
        if self.workers == 1:
            return [self._evaluator.printed.alone(*task) for task in tasks]
        waiting = [self._pool.submit(_work_alone, *task) for task in tasks]
        return [self._pool.result(done) for done in waiting]

    def simulated_in_time(
        self, candidates: Sequence[int], time_s: Array, pressure_kPa: Array
    ) -> Iterator[tuple[int, Array]]:
        """Number of each finished candidate, and the anchors (k, p, 3) in mm it moves at k instants.

        Fewer where it has no equilibrium at a later one.
        """
        if self.workers == 1:
            for candidate in candidates:
                yield candidate, self._evaluator.printed.simulated_in_time(candidate, time_s, pressure_kPa)
            return
        waiting = {
            self._pool.submit(_work_in_time, candidate, time_s, pressure_kPa): candidate
            for candidate in candidates
        }
        for done in as_completed(waiting):
            yield waiting[done], self._pool.result(done)

    def solve(self, tasks: Sequence[tuple[int, Ways]]) -> Iterator[tuple[int, Solved]]:
        """Number of a candidate and its results, of each part of some tasks that is finished.

        A task: a candidate's number, and the ways of the states to solve it at. The same for any `workers`.
        """
        if self.workers == 1:
            for candidate, ways in tasks:
                yield candidate, self._evaluator(candidate, ways)
            return
        candidates = {done: candidate for candidate, ways in tasks for done in self.submit(candidate, ways)}
        for done in as_completed(candidates):
            yield candidates[done], self._pool.result(done)

    def close(self) -> None:
        """End the processes at once, without waiting for their results."""
        self._pool.close()
