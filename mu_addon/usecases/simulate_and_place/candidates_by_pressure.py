"""A study's candidates on one mesh, solved state by state as Model A reaches them, and cached."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ...design.anchors import anchor_points
from ...design.quantity import in_kPa, in_MPa
from ...errors import ConvergenceError, MuError
from ...fem.equilibrium import LOWER
from ...fem.kinematics import probe
from ...fem.state import State
from ...fem.trajectory import Trajectory
from ...meshing.mesh import Mesh
from ...placement.candidates import Candidate, Evaluation, evaluation
from ...placement.deviation import centreline
from ...placement.elimination import Contest, first_and_rest, lower_bounds
from ...placement.sampling import between, relative_error, solution_order
from ...run.cache import Cache, key
from ...run.progress import within
from .candidate_pool import CandidatePool, CandidateProblem, Solved, Ways
from .candidates_in_time import evaluations
from .expected import work
from .job import Job
from .path_motion import keep_motion

Array = np.ndarray[Any, Any]

# Pressures between those solved are interpolated where that changes no path's mean deviation by more.
SAMPLING_ERROR = 0.02
# Up to so many pressures a contest solves all and interpolates none: a bound sums solved ones only.
FEW_PRESSURES = 8
# A candidate along its whole path from rest and one that started from Model A's state agree to this, or, as
# struts snap and touch one by one, to this share of what the candidate deviates by.
PATH_DIFFERENCE_MM = 1e-5
PATH_DIFFERENCE_SHARE = 0.02
BEFORE_VERIFYING = 0.8
"""Share done before one candidate is followed along its whole path."""


class _NotReachedError(Exception):
    """A candidate without equilibrium: its pressure in MPa, its path, and the solver's reason."""

    def __init__(self, pressure_MPa: float, path: str, why: str) -> None:
        super().__init__(why)
        self.pressure_MPa, self.path, self.why = pressure_MPa, path, why


class CandidateSolver:
    """Candidates through a protocol's distinct pressures (s,) in kPa.

    Solutions are kept in the cache. Close it, also when Model A failed. whole: displacements of the whole
    mesh are also kept, for display. contest: solve no candidate further that cannot be among its best; None:
    solve all alike. A pressure that a candidate does not reach is left out of the comparison, and so are
    those beyond it: `not_reached` lists them with reasons. at_least_mm: lower bound of J_hat by the name of
    each candidate that was not solved at all pressures; ended: which of them have no state at one, and why.
    """

    def __init__(
        self,
        job: Job,
        cache: Cache,
        mesh: Mesh,
        candidates: Sequence[Candidate],
        pressure_kPa: Array,
        whole: bool = False,
        contest: Contest | None = None,
    ) -> None:
        self._job, self._cache, self._mesh, self._candidates = job, cache, mesh, candidates
        self._anchors, self._whole = anchor_points(job.unit), whole
        problem = CandidateProblem(job, mesh, self._anchors, tuple(candidates), whole)
        self._sweeper = CandidatePool(problem, job.workers)
        self._key = key(
            mesh.hash(),
            job.materials(mesh).hash(),
            pressure_kPa,
            job.newton,
            self._anchors,
            *(candidate.points for candidate in candidates),
            *job.effects.parts,
        )
        distinct = in_MPa(np.unique(pressure_kPa))
        loaded = self._loaded(distinct)
        self._contest = contest if len(loaded) <= FEW_PRESSURES else None
        # States that are always solved, those of a set together; the rest only if these do not suffice. A
        # candidate followed from rest to an extreme pressure passes those before it.
        if self._contest is None:
            certain = [distinct[[n]] for n in self._rounds(distinct)[0]]
        else:
            certain = [distinct[loaded[first_and_rest(distinct[loaded])[0]]]]
        self._certain = [set(pressures.tolist()) for pressures in certain]
        self._passed: list[State] = []
        # A file is written by one thread at a time.
        self._keeping = threading.Lock()
        self.solved_kPa: list[float] = []
        self.error = 0.0
        self.path_difference_mm = 0.0
        self.not_reached: list[str] = []
        self.at_least_mm: dict[str, float] = {}
        self.ended: list[str] = []
        self._path_allowed_mm = PATH_DIFFERENCE_MM

    @property
    def independent_of_path(self) -> bool:
        """True if candidates from Model A's states reach the same states as along their own paths."""
        return self.path_difference_mm <= self._path_allowed_mm

    def _rounds(self, distinct: Array) -> list[list[int]]:
        return solution_order(distinct, self._job.effects.has_gravity)

    def _loaded(self, distinct: Array) -> Array:
        """Numbers of the pressures (s,) at which a candidate deviates from Model A."""
        return np.flatnonzero((distinct != 0) | self._job.effects.has_gravity)

    def _name(self, pressure_MPa: float, candidate: int) -> str:
        return key(self._key, pressure_MPa, candidate)

    def reached(self, state: State) -> None:
        """Start on states that Model A has reached, in parallel with its next one."""
        self._passed.append(state)
        passed = {one.pressure_MPa: one for one in self._passed}
        for together in self._certain:
            if state.pressure_MPa in together and together <= set(passed):
                for candidate in range(len(self._candidates)):
                    missing = [p for p in together if not self._is_kept(p, candidate)]
                    ways = self._ways(self._passed, [passed[p] for p in missing])
                    for done in self._sweeper.submit(candidate, ways):
                        # Model A's next state may take minutes, and the run may be stopped before.
                        done.add_done_callback(partial(self._keep_done, candidate))

    def _keep_done(self, candidate: int, done: Future[Solved]) -> None:
        """Keep a process's result, if it has one; its error is raised where the result is needed."""
        if not done.cancelled() and done.exception() is None:
            with suppress(MuError):
                self._keep(candidate, done.result())

    def _keep(self, candidate: int, solved: Solved) -> None:
        """Keep a candidate's results."""
        with self._keeping:
            for pressure, moved in solved.found.items():
                if self._is_kept(pressure, candidate):
                    continue
                name = self._name(pressure, candidate)
                if self._whole:
                    self._cache.put("whole", name, {"difference_mm": moved.whole})
                self._cache.put("sweep", name, {"moved_mm": moved.anchors})

    def _ways(self, states: Sequence[State], to: Sequence[State]) -> Ways:
        """Ways from rest to some of the states; a candidate followed to the farthest passes the others."""
        return [_way(states, state) for state in sorted(to, key=lambda one: -abs(one.pressure_MPa))]

    def _is_kept(self, pressure_MPa: float, candidate: int) -> bool:
        """Return True if the cache holds all results of a candidate at a pressure."""
        kinds = ("sweep", "whole") if self._whole else ("sweep",)
        return all(self._cache.has(kind, self._name(pressure_MPa, candidate)) for kind in kinds)

    def evaluations(
        self, trajectory: Trajectory, on_progress: Callable[[float], None], verify: bool = False
    ) -> list[Evaluation]:
        """Evaluation of every candidate against Model A's trajectory, at pressures that all of them reach.

        Without those in `at_least_mm`. verify: also follow one of them along its whole path from rest, and
        all of them if that ends elsewhere. Raises ConvergenceError where no pressure is left to compare.
        """
        distinct = np.array([s.pressure_MPa for s in trajectory.solved])
        monitor = probe(self._mesh, self._anchors)
        still = np.array([self._anchors + monitor.displacement(s.u) for s in trajectory.solved])
        compared = np.ones(len(distinct), bool)
        while True:
            try:
                known = self._differences(trajectory, compared, still, on_progress, verify)
                break
            except _NotReachedError as missed:
                self._leave_out(missed, distinct, compared)
        self.solved_kPa = sorted(in_kPa(float(distinct[n])) for n in known)
        difference = (
            between(distinct, known) if known else np.zeros((len(distinct), len(self._candidates), 1, 3))
        )
        difference[~compared] = np.nan
        baseline = trajectory.of_time(still)
        moved = baseline[:, None] + trajectory.of_time(difference)
        return [
            evaluation(candidate.name, moved[:, i], baseline, self._job.stations)
            for i, candidate in enumerate(self._candidates)
            if candidate.name not in self.at_least_mm
        ]

    def _leave_out(self, missed: _NotReachedError, distinct: Array, compared: Array) -> None:
        """Compare no longer, of distinct pressures (s,) in MPa, the one missed and those beyond it."""
        pressure = missed.pressure_MPa
        self.not_reached.append(f"at {in_kPa(pressure):.6g} kPa and beyond ({missed.path}: {missed.why})")
        self._sweeper.leave_out(pressure)
        beyond = np.abs(distinct) >= abs(pressure) * (1 - 1e-12)
        compared[beyond & (distinct * np.sign(pressure) > 0)] = False
        if not pressure or not distinct[compared].any():
            raise ConvergenceError(f"no pressure is reached by all paths: {missed.why}", missed.path, LOWER)

    def _differences(
        self,
        trajectory: Trajectory,
        compared: Array,
        still: Array,
        on_progress: Callable[[float], None],
        verify: bool,
    ) -> dict[int, Array]:
        """Anchors (c, p, 3) in mm against Model A's at some of the pressures compared (s,), by number.

        Those that suffice for the rest; NaN where a contest does without. Raises _NotReachedError.
        """
        distinct = np.array([s.pressure_MPa for s in trajectory.solved])
        self.at_least_mm = {}
        if self._contest is not None:
            return self._contested(self._contest, trajectory, compared, still, on_progress, verify)
        numbered = np.flatnonzero(compared)
        order = [[int(numbered[i]) for i in pair] for pair in self._rounds(distinct[compared])]
        loaded = sum(map(len, order))
        weight = np.bincount(trajectory.index, minlength=len(distinct)) * compared
        known: dict[int, Array] = {}
        # Each round may be the last, and takes most of what is left; the path from rest comes after.
        done, of_rounds = 0.0, BEFORE_VERIFYING if verify else 1.0
        for pair in order:
            part = 0.75 * (of_rounds - done) / len(pair)
            for numbers in self._together(distinct, pair):
                begun, done = done, done + part * len(numbers)
                found = self._solved(
                    trajectory, numbers, range(len(self._candidates)), within(on_progress, begun, done)
                )
                known |= {number: points - still[number] for number, points in found.items()}
            self.error = 0.0
            if len(known) < loaded:
                without_last = {n: d for n, d in known.items() if n != pair[-1]}
                full, sparse = between(distinct, known), between(distinct, without_last)
                self.error = relative_error(full, sparse, weight)
            if self.error <= SAMPLING_ERROR:
                break
        if verify and known and not self._follows_its_path(distinct, known, still):
            return self._along_paths(distinct, still, compared, known)
        return known

    def _contested(
        self,
        contest: Contest,
        trajectory: Trajectory,
        compared: Array,
        still: Array,
        on_progress: Callable[[float], None],
        verify: bool,
    ) -> dict[int, Array]:
        """Differences as of `_differences` at all pressures compared; NaN where none of the best can change.

        What is solved depends on no number of processes: all candidates at the first pressures, then the
        most promising ones at all others, then pressure by pressure those that may still be among the best.
        """
        distinct = np.array([s.pressure_MPa for s in trajectory.solved])
        loaded = self._loaded(distinct)
        loaded = loaded[compared[loaded]]
        if not len(loaded):
            return {}
        first, rest = ([int(loaded[n]) for n in order] for order in first_and_rest(distinct[loaded]))
        instants = np.bincount(trajectory.index, minlength=len(distinct)) * compared
        every = np.arange(len(self._candidates))
        known = {n: np.full((len(every), *still.shape[1:]), np.nan) for n in [*first, *rest]}
        # Of the states at most; where candidates drop out, the share jumps.
        work_of = {n: max(work(self._job, [trajectory.solved[n].pressure_kPa]), 1.0) for n in known}
        whole, left = sum(work_of.values()) * len(every), BEFORE_VERIFYING if verify else 1.0
        done = 0.0

        def solve(numbers: Sequence[int], candidates: Array) -> None:
            nonlocal done
            begun, done = done, done + sum(work_of[n] for n in numbers) * len(candidates)
            update = within(on_progress, left * begun / whole, left * done / whole)
            for number, points in self._solved(trajectory, numbers, candidates, update).items():
                known[number][candidates] = points - still[number]

        def standing() -> tuple[Array, Array]:
            """Lower bounds (c,) of J_hat in mm, and True (c,) where it is J_hat itself."""
            distance = self._distances(known, still)
            return lower_bounds(distance, instants), np.isfinite(distance[loaded]).all(axis=0)

        solve(first, every)
        if rest:
            at_least, _ = standing()
            solve(rest, np.sort(np.argsort(at_least, kind="stable")[: contest.best]))
        for number in rest:
            still_open = np.flatnonzero(contest.open(*standing()))
            if len(still_open):
                solve([number], still_open)
        if verify and not self._follows_its_path(distinct, known, still):
            return self._along_paths(distinct, still, compared, known)
        at_least, complete = standing()
        for candidate in np.flatnonzero(~complete).tolist():
            # What an earlier run solved costs nothing.
            if contest.every or all(self._is_kept(distinct[n], candidate) for n in rest):
                try:
                    solve(rest, np.array([candidate]))
                except _NotReachedError as missed:
                    at = f"{in_kPa(missed.pressure_MPa):.6g} kPa"
                    self.ended.append(f"{missed.path} at {at} and beyond ({missed.why})")
        at_least, complete = standing()
        names = [candidate.name for candidate in self._candidates]
        self.at_least_mm = {names[c]: float(at_least[c]) for c in np.flatnonzero(~complete)}
        on_progress(left)
        return known

    def _distances(self, known: dict[int, Array], still: Array) -> Array:
        """Mean distance (s, c) in mm over the length at each state, NaN where it is not solved; 0 unloaded.

        known: differences (c, p, 3) in mm by number of the state; still (s, p, 3): Model A's anchors in mm.
        """
        count = len(self._candidates)
        distance = np.full((len(still), count), np.nan)
        for number, apart in known.items():
            base = centreline(still[number][None], self._job.stations)
            curves = centreline(still[number] + apart, self._job.stations)
            distance[number] = np.linalg.norm(curves - base, axis=2).mean(axis=1)
        return distance

    def _together(self, distinct: Array, pair: list[int]) -> list[list[int]]:
        """Numbers of pressures in the groups that are solved one after the other.

        A candidate may be followed from rest to a pressure, and then needs no other on that side.
        """
        if len(pair) == 2 and np.prod(distinct[pair]) > 0:
            return sorted(([n] for n in pair), key=lambda n: -abs(distinct[n[0]]))
        return [pair]

    def _follows_its_path(self, distinct: Array, known: dict[int, Array], still: Array) -> bool:
        """Return True if the most deviating candidate ends at its maximum where its path from rest leads.

        An elastic body without limit points has one state a pressure, so that candidates may start from Model
        A's. If this one has another, all are solved along their paths.
        """
        kept = self._cache.get("path", self._key)
        if kept is not None and "allowed_mm" in kept:
            self.path_difference_mm = float(kept["difference_mm"])
            self._path_allowed_mm = float(kept["allowed_mm"])
            return self.independent_of_path
        numbers = [n for n in known if distinct[n]]
        size = np.array([np.linalg.norm(known[n], axis=2).max(axis=1) for n in numbers])
        state, candidate = np.unravel_index(np.nanargmax(size), size.shape)
        number = numbers[int(state)]
        way = _outward(distinct, distinct[number])
        (moved,) = self._sweeper.alone([(int(candidate), distinct[way])])
        if len(moved) < len(way):
            self._missed(distinct[way[len(moved)]], int(candidate))
        self.path_difference_mm = float(np.abs(moved[-1] - still[number] - known[number][candidate]).max())
        self._path_allowed_mm = max(PATH_DIFFERENCE_MM, PATH_DIFFERENCE_SHARE * float(np.nanmax(size)))
        found = {"difference_mm": self.path_difference_mm, "allowed_mm": self._path_allowed_mm}
        self._cache.put("path", self._key, found)
        return self.independent_of_path

    def _missed(self, pressure_MPa: float, candidate: int) -> NoReturn:
        """Say that a candidate, followed from rest, does not reach a pressure."""
        why = f"no equilibrium at {in_kPa(pressure_MPa):.4g} kPa on its path from rest"
        raise _NotReachedError(float(pressure_MPa), self._candidates[candidate].name, why)

    def _along_paths(
        self, distinct: Array, still: Array, compared: Array, before: dict[int, Array]
    ) -> dict[int, Array]:
        """Differences (c, p, 3) in mm at all compared pressures except 0, each along its whole path.

        At 0, where weight alone acts and every path begins, they keep their earlier values.
        """
        reached = np.where(compared, distinct, 0.0)
        sides = [_outward(reached, p) for p in (reached.min(), reached.max())]
        sides = [side for side in sides if len(side)]
        tasks = [(candidate, distinct[side]) for candidate in range(len(self._candidates)) for side in sides]
        moved = iter(self._sweeper.alone(tasks))
        known = {int(n): np.zeros((len(self._candidates), *still.shape[1:])) for side in sides for n in side}
        known |= {n: values for n, values in before.items() if not distinct[n]}
        for candidate in range(len(self._candidates)):
            for side in sides:
                found = next(moved)
                if len(found) < len(side):
                    self._missed(distinct[side[len(found)]], candidate)
                for n, points in zip(side.tolist(), found, strict=True):
                    known[n][candidate] = points - still[n]
        return known

    def _solved(
        self,
        trajectory: Trajectory,
        numbers: Sequence[int],
        candidates: Sequence[int] | Array,
        on_progress: Callable[[float], None],
    ) -> dict[int, Array]:
        """Anchors (c, p, 3) in mm moved by some candidates at some states, by number; each is cached.

        on_progress: called with the finished share. Raises _NotReachedError.
        """
        states = {trajectory.solved[n].pressure_MPa: trajectory.solved[n] for n in numbers}
        weight = {p: max(work(self._job, [state.pressure_kPa]), 1.0) for p, state in states.items()}
        # Candidate by candidate: a model serves all states that follow each other.
        tasks = []
        for candidate in map(int, candidates):
            missing = [state for p, state in states.items() if not self._is_kept(p, candidate)]
            if missing:
                tasks.append((candidate, self._ways(trajectory.solved, missing)))
        total = sum(weight.values()) * len(candidates)
        done = total - sum(weight[way[-1].pressure_MPa] for _, ways in tasks for way in ways)
        on_progress(done / total)
        for candidate, solved in self._sweeper.solve(tasks):
            self._keep(candidate, solved)
            # A process may have begun before a pressure was left out.
            if unmet := sorted(states.keys() & solved.missed, key=abs):
                path = self._candidates[candidate].name
                raise _NotReachedError(unmet[0], path, solved.missed[unmet[0]])
            done = min(total, done + sum(weight.get(p, 0.0) for p in solved.found))
            on_progress(done / total)
        return {
            n: np.array([self._moved(p, int(c)) for c in candidates])
            for n, p in zip(numbers, states, strict=True)
        }

    def _moved(self, pressure_MPa: float, candidate: int) -> Array:
        """Anchors (p, 3) in mm moved by a candidate at a pressure, as they are kept."""
        kept = self._cache.get("sweep", self._name(pressure_MPa, candidate))
        assert kept is not None
        return kept["moved_mm"]

    def whole(self, trajectory: Trajectory) -> Iterator[tuple[str, Array, Array]]:
        """Name of each path whose displacement was kept, pressures (r,) in kPa and differences (r, n, 3).

        In mm against Model A's, at the pressures that were solved from its states; none where every path was
        solved from rest instead.
        """
        if not self.independent_of_path:
            return
        states = [
            s for s in trajectory.solved if any(abs(s.pressure_kPa - p) < 1e-9 for p in self.solved_kPa)
        ]
        pressures = np.array([s.pressure_kPa for s in states])
        for number, candidate in enumerate(self._candidates):
            kept = [self._cache.get("whole", self._name(s.pressure_MPa, number)) for s in states]
            found = [arrays["difference_mm"] for arrays in kept if arrays is not None]
            if found and len(found) == len(kept):
                yield candidate.name, pressures, np.array(found)

    def close(self) -> None:
        """End the processes."""
        self._sweeper.close()


def _way(states: Sequence[State], to: State) -> tuple[State, ...]:
    """States between rest and one of them, in order of pressure, and that one last."""
    pressures = np.array([state.pressure_MPa for state in states])
    return (*(states[n] for n in _outward(pressures, to.pressure_MPa)[:-1]), to)


def _outward(distinct: Array, target: float) -> Array:
    """Numbers of the pressures (s,) from 0, without it, to a target on the same side, in that order."""
    between = (distinct * np.sign(target) > 0) & (np.abs(distinct) <= np.abs(target) * (1 + 1e-12))
    numbers = np.flatnonzero(between)
    return numbers[np.argsort(np.abs(distinct[numbers]))]


def solve_candidates(
    job: Job,
    cache: Cache,
    mesh: Mesh,
    trajectory: Trajectory,
    candidates: Sequence[Candidate],
    on_progress: Callable[[float], None],
    solving: float = 1.0,
    under_way: CandidateSolver | None = None,
    verify: bool = False,
    shown: tuple[Path, Mesh] | None = None,
    contest: Contest | None = None,
) -> tuple[list[Evaluation], dict[str, Any]]:
    """Evaluation of every candidate on a mesh against its Model A, and the summary's figures on it.

    under_way: a solver that received Model A's states during the simulation; verify: see
    `CandidateSolver.evaluations`; contest: see `CandidateSolver`, not used where history acts. shown: folder
    for the paths' motion, and the study's mesh, which is this one or half of it. solving: share of the stage
    without that motion. Raises ConvergenceError.
    """
    if job.in_time:
        found, not_reached = evaluations(job, cache, mesh, trajectory, candidates, on_progress)
        return found, {"along_paths": True, "not_reached": not_reached}
    pressures = trajectory.pressure_kPa
    solver = under_way or CandidateSolver(job, cache, mesh, candidates, pressures, shown is not None, contest)
    with closing(solver):
        found = solver.evaluations(trajectory, within(on_progress, 0.0, solving), verify)
        if shown:
            keep_motion(job, *shown, mesh, trajectory, solver, candidates, within(on_progress, solving, 1.0))
    return found, {
        "pressures_solved_kPa": solver.solved_kPa,
        "relative_error_between": solver.error,
        "path_difference_mm": solver.path_difference_mm,
        "independent_of_path": solver.independent_of_path,
        "not_reached": solver.not_reached,
        "at_least_mm": solver.at_least_mm,
        "ended": solver.ended,
    }
