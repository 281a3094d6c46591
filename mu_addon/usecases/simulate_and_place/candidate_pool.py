"""Candidates on several cores: processes that receive the mesh and the baseline once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, as_completed
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import attrs
import numpy as np

from ...errors import ConvergenceError
from ...fem.kinematics import probe
from ...fem.materials import Materials
from ...fem.model import Model
from ...fem.state import State
from ...meshing.mesh import Mesh
from ...placement.batch import CandidateBatch
from ...placement.candidates import Candidate, roi
from ...resolved.candidates import PrintedWaveguides
from ...run.pool import Pool

if TYPE_CHECKING:
    from .job import Job

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class CandidateProblem:
    """Candidates of a study to be solved; plain data, so that it can be sent to another process.

    anchors (p, 3) in mm: the monitored points. whole: the displacement of the whole mesh is also kept. job:
    with the unit's effects and obstacles; without it only pressure acts.
    """

    mesh: Mesh
    materials: Materials
    anchors: Array
    candidates: tuple[Candidate, ...]
    radius_mm: float
    sensor_MPa: float
    whole: bool = False
    job: Job | None = None

    @property
    def parts(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the candidates that are solved together: each printed waveguide has a separate mesh."""
        every = tuple(range(len(self.candidates)))
        return tuple((candidate,) for candidate in every) if self.mesh.resolved else (every,)


class Moved(NamedTuple):
    """A part's results at a state: anchors (c, p, 3) in mm of c candidates, differences of the whole mesh.

    whole: displacements (w, n, 3) in mm against Model A's, single precision; w: c or 0.
    """

    anchors: Array
    whole: Array


class PrintedEvaluator:
    """Evaluator of printed waveguides, on a mesh of the printed unit; otherwise as `Evaluator`."""

    def __init__(self, setting: CandidateProblem, threads: int) -> None:
        job = setting.job
        assert job is not None
        self._candidates = PrintedWaveguides(
            job.unit,
            setting.mesh,
            tuple(candidate.points for candidate in setting.candidates),
            setting.anchors,
            job.materials,
            lambda mesh: job.model(mesh, threads),
            job.newton,
            job.body,
        )
        self._setting = setting

    def __call__(self, way: Sequence[State], part: int) -> list[Moved]:
        """Results of a part's one candidate at the last of some states of Model A, or at each of them.

        At each where the candidate had to be followed from rest, see `PrintedWaveguides.states`. Raises
        ConvergenceError.
        """
        (candidate,) = self._setting.parts[part]
        found = []
        states = self._candidates.states(candidate, way)
        for state, own in zip(way[-len(states) :], states, strict=True):
            whole = [self._candidates.of_unit(candidate, own) - state.u] if self._setting.whole else []
            shape = -1, *state.u.shape
            found.append(Moved(self._candidates.points([own]), np.array(whole, np.float32).reshape(shape)))
        return found

    def alone(self, candidate: int, pressures_MPa: Array) -> Array:
        """Anchors (s, p, 3) in mm that a candidate moves from rest on, see `CandidatePool.alone`."""
        return self._candidates.alone(candidate, pressures_MPa)

    def simulated_in_time(self, candidate: int, time_s: Array, pressure_kPa: Array) -> Array:
        """Anchors (k, p, 3) in mm that one moves at k instants, see `CandidatePool.simulated_in_time`."""
        return self._candidates.simulated_in_time(candidate, time_s, pressure_kPa)


def evaluator_of(setting: CandidateProblem, threads: int) -> Evaluator | PrintedEvaluator:
    """Evaluator of a setting's candidates on its mesh."""
    return (PrintedEvaluator if setting.mesh.resolved else Evaluator)(setting, threads)


class Evaluator:
    """Solves all candidates of a setting at one state of Model A, having built its model once."""

    def __init__(self, setting: CandidateProblem, threads: int) -> None:
        s = setting
        shares = [roi(s.mesh, one, s.radius_mm).share for one in s.candidates]
        monitored = s.anchors, probe(s.mesh, s.anchors)
        model = Model(s.mesh, threads=threads) if s.job is None else s.job.model(s.mesh, threads)
        newton = None if s.job is None else s.job.effects.newton
        self._sweep = CandidateBatch(model, s.materials, monitored, shares, s.sensor_MPa, newton)
        self._whole = s.whole

    def __call__(self, way: Sequence[State], part: int = 0) -> list[Moved]:
        """Results of all candidates, in one part, at the last of some states of Model A. ConvergenceError."""
        state = way[-1]
        states = self._sweep.states(state)
        apart = [(own.u - state.u).astype(np.float32) for own in states if self._whole]
        whole = np.array(apart, np.float32).reshape(-1, *state.u.shape)
        return [Moved(self._sweep.points(states), whole)]

    def alone(self, candidate: int, pressures_MPa: Array) -> Array:
        """Anchors (s, p, 3) in mm that a candidate moves from rest on, see `CandidatePool.alone`."""
        return self._sweep.alone(candidate, pressures_MPa)

    def simulated_in_time(self, candidate: int, time_s: Array, pressure_kPa: Array) -> Array:
        """Anchors (k, p, 3) in mm that one moves at k instants, see `CandidatePool.simulated_in_time`."""
        return self._sweep.simulated_in_time(candidate, time_s, pressure_kPa)


_evaluator: Evaluator | PrintedEvaluator | None = None


def _start(setting: CandidateProblem) -> None:
    global _evaluator
    _evaluator = evaluator_of(setting, threads=1)


def _work(way: Sequence[State], part: int) -> list[Moved]:
    assert _evaluator is not None
    return _evaluator(way, part)


def _work_alone(candidate: int, pressures_MPa: Array) -> Array:
    assert _evaluator is not None
    return _evaluator.alone(candidate, pressures_MPa)


def _work_in_time(candidate: int, time_s: Array, pressure_kPa: Array) -> Array:
    assert _evaluator is not None
    return _evaluator.simulated_in_time(candidate, time_s, pressure_kPa)


def _found_or_why(solve: Callable[[], list[Moved]]) -> list[Moved] | ConvergenceError:
    try:
        return solve()
    except ConvergenceError as error:
        return error


class CandidatePool:
    """Processes that solve a setting's candidates at states of Model A; started on demand, until closed."""

    def __init__(self, setting: CandidateProblem, workers: int) -> None:
        self.setting, self.workers = setting, workers
        self._alone: Evaluator | PrintedEvaluator | None = None
        self._pool = Pool(workers, "candidates", _start, (setting,))
        self._submitted: dict[tuple[float, int], Future[list[Moved]]] = {}

    def submit(self, way: Sequence[State], part: int) -> Future[list[Moved]]:
        """Submit a task of `solve` to a process unless it was; needs two workers or more."""
        name = way[-1].pressure_MPa, part
        if name not in self._submitted:
            self._submitted[name] = self._pool.submit(_work, way, part)
        return self._submitted[name]

    def leave_out(self, pressure_MPa: float) -> None:
        """Drop submitted tasks at a pressure that no process has begun."""
        for (pressure, _), done in self._submitted.items():
            if pressure == pressure_MPa:
                done.cancel()

    def alone(self, tasks: Sequence[tuple[int, Array]]) -> list[Array]:
        """Anchors (s, p, 3) in mm that candidates, by number, move along their paths through pressures (s,).

        Of each candidate as far as it has an equilibrium; ConvergenceError for one without any.
        """
        if self.workers == 1:
            self._alone = self._alone or evaluator_of(self.setting, threads=1)
            return [self._alone.alone(*task) for task in tasks]
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
                self._alone = self._alone or evaluator_of(self.setting, threads=1)
                yield candidate, self._alone.simulated_in_time(candidate, time_s, pressure_kPa)
            return
        waiting = {
            self._pool.submit(_work_in_time, candidate, time_s, pressure_kPa): candidate
            for candidate in candidates
        }
        for done in as_completed(waiting):
            yield waiting[done], self._pool.result(done)

    def solve(
        self, tasks: Sequence[tuple[Sequence[State], int]]
    ) -> Iterator[tuple[int, list[Moved] | ConvergenceError]]:
        """Number of each finished task, and the results of its candidates, or the reason of its failure.

        A task: Model A's states on one side of rest, in order of pressure, and a part. Its candidates are
        solved at the last of these, and possibly at all before it. The same for any `workers`.
        """
        if self.workers == 1:
            for number, (way, part) in enumerate(tasks):
                self._alone = self._alone or evaluator_of(self.setting, threads=1)
                yield number, _found_or_why(partial(self._alone, way, part))
            return
        for task in tasks:
            self.submit(*task)
        numbers = {self._submitted[way[-1].pressure_MPa, part]: n for n, (way, part) in enumerate(tasks)}
        for done in as_completed(numbers):
            yield numbers[done], _found_or_why(partial(self._pool.result, done))

    def close(self) -> None:
        """End the processes at once, without waiting for their results."""
        self._pool.close()
