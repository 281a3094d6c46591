"""Pressures at which candidate paths are solved and compared, and each one's deviation from Model A there."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from copy import deepcopy

import attrs
import numpy as np

from ..arrays import Array as Array
from ..body.candidates import PrintedWaveguides
from ..design.anchors import anchor_points
from ..design.quantity import in_MPa
from ..errors import ConvergenceError
from ..fem.equilibrium import LOWER
from ..fem.kinematics import probe
from ..fem.state import State
from ..fem.trajectory import Trajectory
from ..generators import value_of
from ..meshing.mesh import Mesh
from ..placement.candidates import Candidate
from ..placement.deviation import Deviation, centreline, centreline_deviation
from ..placement.deviation_bounds import Contest, first_and_rest, lower_bounds
from ..placement.sampling import between, relative_error, solution_order
from .mechanics import Mechanics, Samples

# Pressures between those solved are interpolated where that changes no path's mean deviation by more.
SAMPLING_ERROR = 0.02
# Up to so many pressures a contest solves all and interpolates none: a bound sums solved ones only.
FEW_PRESSURES = 8
# A candidate along its whole path from rest and one that started from Model A's state agree to this, or, as
# struts snap and touch one by one, to this share of what the candidate deviates by.
PATH_DIFFERENCE_MM = 1e-5
PATH_DIFFERENCE_SHARE = 0.02
CONTACT_REACH = "from {:.6g} s on ({}: no equilibrium at {:.4g} kPa)"


def waveguides_of(mechanics: Mechanics, mesh: Mesh, candidates: Sequence[Candidate]) -> PrintedWaveguides:
    """Solver of a unit's candidates on a mesh, in one thread."""
    return PrintedWaveguides(
        mechanics.unit,
        mesh,
        tuple(candidate.points for candidate in candidates),
        anchor_points(mechanics.unit),
        mechanics.materials,
        lambda mesh: mechanics.model(mesh, threads=1),
        mechanics.newton,
        mechanics.body,
    )


@attrs.frozen(eq=False)
class Solved:
    """A candidate at r pressures in kPa: anchors (r, p, 3) in mm moved by it, and by Model A (still).

    distance_mm (r,): mean over the length between both. difference_mm (r, n, 3) of the whole mesh, or
    (r, 0, 3) where it is not kept. missed_kPa, why: pressures that it does not reach, and reasons.
    """

    pressure_kPa: tuple[float, ...]
    anchors: Array
    still: Array
    distance_mm: Array
    difference_mm: Array
    missed_kPa: tuple[float, ...] = ()
    why: tuple[str, ...] = ()


def solved(
    waveguides: PrintedWaveguides,
    number: int,
    pressures_kPa: Sequence[float],
    states: Mapping[float, State],
    stations: int,
    whole: bool = True,
) -> Solved:
    """A candidate, by its number, at some pressures, each from Model A's state there.

    states: of Model A by pressure in kPa, with those between rest and each of the pressures. A candidate that
    has to be followed through earlier states, see `PrintedWaveguides.states`, has results at these, too.
    """
    found: dict[float, tuple[State, State]] = {}
    missed: dict[float, str] = {}
    for target in sorted(pressures_kPa, key=lambda p: -abs(p)):
        if target in found:
            continue
        way = [p for p in states if p * target > 0 and abs(p) <= abs(target)] or [target]
        way = sorted(way, key=abs)
        try:
            own = waveguides.states(number, [states[p] for p in way])
        except ConvergenceError as error:
            missed[target] = error.what
            continue
        for p, state in zip(way[-len(own) :], own, strict=True):
            found.setdefault(p, (state, states[p]))
    own, base = ([pair[k] for pair in found.values()] for k in (0, 1))
    anchors, still = (
        waveguides.points(some) if some else np.empty((0, *waveguides.anchors.shape)) for some in (own, base)
    )
    apart = centreline(anchors, stations) - centreline(still, stations)
    size = len(waveguides.mesh.nodes) if whole else 0
    difference = np.empty((len(own), size, 3), np.float32)
    for k, (state, without) in enumerate(found.values()) if whole else ():
        difference[k] = waveguides.of_unit(number, state) - without.u
    return Solved(
        tuple(found),
        anchors,
        still,
        np.linalg.norm(apart, axis=2).mean(axis=1),
        difference,
        tuple(missed),
        tuple(missed.values()),
    )


@attrs.frozen(eq=False)
class Followed:
    """A candidate along its path from rest, as far as it has equilibria: anchors (r, p, 3) in mm."""

    pressure_kPa: tuple[float, ...]
    anchors: Array


def followed(waveguides: PrintedWaveguides, number: int, pressures_kPa: Sequence[float]) -> Followed:
    """A candidate, by its number, along its whole path from rest through some pressures."""
    try:
        anchors = waveguides.alone(number, in_MPa(np.array(pressures_kPa)))
    except ConvergenceError:
        anchors = np.empty((0, *waveguides.anchors.shape))
    return Followed(tuple(pressures_kPa[: len(anchors)]), anchors)


@attrs.frozen
class RankingSetup:
    """What candidates are compared at: distinct pressures in kPa, number of instants of each, weight or not.

    names: of the candidates.
    """

    names: tuple[str, ...]
    samples: Samples
    has_gravity: bool = False

    @property
    def loaded_kPa(self) -> list[float]:
        """Pressures at which a candidate deviates from Model A."""
        return [p for p in self.samples.distinct_kPa if p or self.has_gravity]


@attrs.define(eq=False)
class Standing:
    """Candidates as far as they are solved: by name and pressure in kPa, anchors (p, 3) and distance in mm.

    still: Model A's anchors by pressure. compared_kPa: pressures that are compared; not_reached: those that
    are not, with reasons; ended: candidates without a bound's rest, and why; at_least_mm: lower bound of
    J_hat of each that was not solved at all pressures; error: of the interpolation between pressures.
    """

    anchors: dict[str, dict[float, Array]] = attrs.field(factory=dict)
    distance_mm: dict[str, dict[float, float]] = attrs.field(factory=dict)
    still: dict[float, Array] = attrs.field(factory=dict)
    missed: dict[str, dict[float, str]] = attrs.field(factory=dict)
    compared_kPa: list[float] = attrs.field(factory=list)
    not_reached: list[str] = attrs.field(factory=list)
    ended: list[str] = attrs.field(factory=list)
    at_least_mm: dict[str, float] = attrs.field(factory=dict)
    error: float = 0.0

    def add(self, name: str, found: Solved) -> None:
        """Add what was solved of a candidate."""
        for k, p in enumerate(found.pressure_kPa):
            self.anchors.setdefault(name, {}).setdefault(p, found.anchors[k])
            self.distance_mm.setdefault(name, {}).setdefault(p, float(found.distance_mm[k]))
            self.still.setdefault(p, found.still[k])
        for p, why in zip(found.missed_kPa, found.why, strict=True):
            self.missed.setdefault(name, {})[p] = why

    def lacks(self, name: str, pressures_kPa: Sequence[float]) -> tuple[float, ...]:
        """Pressures that a candidate was not solved at, nor known to miss."""
        known = self.anchors.get(name, {}).keys() | self.missed.get(name, {}).keys()
        return tuple(p for p in pressures_kPa if p not in known)

    def leave_out(self, name: str, pressure_kPa: float, why: str, distinct_kPa: Sequence[float]) -> None:
        """Compare no longer the pressure that a candidate missed, nor those beyond it. ConvergenceError."""
        self.not_reached.append(f"at {pressure_kPa:.6g} kPa and beyond ({name}: {why})")
        kept = [p for p in self.compared_kPa if not (p * pressure_kPa > 0 and abs(p) >= abs(pressure_kPa))]
        self.compared_kPa = kept
        if not pressure_kPa or not any(kept):
            raise ConvergenceError(f"no pressure is reached by all paths: {why}", name, LOWER)

    @property
    def solved_kPa(self) -> list[float]:
        """Compared pressures at which candidates were solved."""
        known = {p for found in self.anchors.values() for p in found}
        return sorted(known & {*self.compared_kPa})


Member = tuple[str, tuple[float, ...]]
"""A candidate's name, and the pressures in kPa that it is solved at together."""
Solving = Generator[list[Member], Sequence[Solved], Standing]


class _MissedError(Exception):
    """A candidate of those compared without equilibrium: its name, pressure in kPa, and the reason."""

    def __init__(self, name: str, pressure_kPa: float, why: str) -> None:
        super().__init__(why)
        self.name, self.pressure_kPa, self.why = name, pressure_kPa, why


def solving(
    compared: RankingSetup, contest: Contest | None, before: Standing | None = None, begin: bool = False
) -> Solving:
    """Yield the candidates and pressures to solve, get their solutions, and return where they stand.

    What is solved depends on the solutions alone. contest: solve no candidate further that cannot be among
    its best; None: all alike. before: what is solved already. begin: end once as many candidates as are to be
    the best are solved, the most promising. A pressure that a candidate misses is compared for none, and
    neither are those beyond it. Raises ConvergenceError where none is left.
    """
    # What is added must not change the standing that a check of paths was taken from.
    known = Standing() if before is None else deepcopy(before)
    known.not_reached, known.ended, known.at_least_mm = [], [], {}
    known.compared_kPa = list(compared.samples.distinct_kPa)
    few = len(compared.loaded_kPa) <= FEW_PRESSURES
    while True:
        try:
            if contest is not None and few:
                yield from _contested(compared, contest, known, begin)
            else:
                yield from _rounds(compared, known)
            return known
        except _MissedError as missed:
            known.leave_out(missed.name, missed.pressure_kPa, missed.why, compared.samples.distinct_kPa)


def _solve(
    known: Standing, names: Sequence[str], pressures_kPa: Sequence[float]
) -> Generator[list[Member], Sequence[Solved], None]:
    """Solve what some candidates lack at some pressures; raises _MissedError for the first one missed."""
    asked = [(name, lack) for name in names if (lack := known.lacks(name, pressures_kPa))]
    found = (yield asked) if asked else ()
    for (name, _), one in zip(asked, found, strict=True):
        known.add(name, one)
    for name in names:
        missed = {p: why for p, why in known.missed.get(name, {}).items() if p in pressures_kPa}
        if missed:
            nearest = min(missed, key=abs)
            raise _MissedError(name, nearest, missed[nearest])


def _contested(
    compared: RankingSetup, contest: Contest, known: Standing, begin: bool
) -> Generator[list[Member], Sequence[Solved], None]:
    """All candidates at the first pressures, the most promising at all others, then those still open.

    Pressure by pressure: what cannot be among the best is solved no further. begin: without those still open.
    """
    loaded = [p for p in compared.loaded_kPa if p in known.compared_kPa]
    first, rest = ([loaded[n] for n in order] for order in first_and_rest(np.array(loaded)))
    instants = compared.samples.instants * np.isin(compared.samples.distinct_kPa, known.compared_kPa)
    names = np.array(compared.names)

    def standing() -> tuple[Array, Array]:
        """Lower bounds (c,) of J_hat in mm, and True (c,) where it is J_hat itself."""
        distance = np.array(
            [
                [known.distance_mm.get(n, {}).get(p, np.nan) if p in loaded else 0.0 for n in compared.names]
                for p in compared.samples.distinct_kPa
            ]
        )
        is_loaded = np.isin(compared.samples.distinct_kPa, loaded)
        return lower_bounds(distance, instants), np.isfinite(distance[is_loaded]).all(axis=0)

    yield from _solve(known, compared.names, first)
    if rest and standing()[1].sum() < contest.best:
        best = np.sort(np.argsort(standing()[0], kind="stable")[: contest.best])
        yield from _solve(known, names[best].tolist(), rest)
    for pressure in () if begin else rest:
        yield from _solve(known, names[contest.open(*standing())].tolist(), [pressure])
    left = [] if begin else names[~standing()[1]].tolist()
    if contest.every and left:
        asked = [(name, lack) for name in left if (lack := known.lacks(name, rest))]
        for (name, _), one in zip(asked, (yield asked) if asked else (), strict=True):
            known.add(name, one)
        for name in left:
            for p, why in sorted(known.missed.get(name, {}).items(), key=lambda one: abs(one[0]))[:1]:
                known.ended.append(f"{name} at {p:.6g} kPa and beyond ({why})")
    at_least, complete = standing()
    known.at_least_mm = {str(names[n]): float(at_least[n]) for n in np.flatnonzero(~complete)}


def _rounds(compared: RankingSetup, known: Standing) -> Generator[list[Member], Sequence[Solved], None]:
    """All candidates at two pressures after two others, until the rest can be interpolated."""
    distinct = [p for p in compared.samples.distinct_kPa if p in known.compared_kPa]
    instants = compared.samples.instants[np.isin(compared.samples.distinct_kPa, distinct)]
    order = solution_order(np.array(distinct), compared.has_gravity)
    for number, pair in enumerate(order):
        yield from _solve(known, compared.names, [distinct[n] for n in pair])
        done = [n for numbers in order[: number + 1] for n in numbers]
        known.error = 0.0
        if number + 1 < len(order):
            every = {n: _apart(known, compared.names, distinct[n]) for n in done}
            fewer = {n: apart for n, apart in every.items() if n != pair[-1]}
            pressure = np.array(distinct)
            known.error = relative_error(between(pressure, every), between(pressure, fewer), instants)
        if known.error <= SAMPLING_ERROR:
            return


def _apart(known: Standing, names: Sequence[str], pressure_kPa: float) -> Array:
    """Anchors (c, p, 3) in mm of candidates against Model A's at a pressure; NaN where one is not solved."""
    still = known.still[pressure_kPa]
    lacking = np.full_like(still, np.nan)
    return np.array([known.anchors[name].get(pressure_kPa, lacking) for name in names]) - still


@attrs.define(eq=False)
class PathCheck:
    """Candidates along their whole paths from rest: the largest difference in mm, and what was allowed.

    along: of all candidates, where they do not end where those from Model A's states do, by name.
    """

    difference_mm: float = 0.0
    allowed_mm: float = PATH_DIFFERENCE_MM
    along: dict[str, dict[float, Array]] = attrs.field(factory=dict)

    @property
    def independent(self) -> bool:
        """True if candidates from Model A's states reach the same states as along their own paths."""
        return self.difference_mm <= self.allowed_mm


def following(
    compared: RankingSetup, known: Standing
) -> Generator[list[Member], Sequence[Followed], PathCheck]:
    """Yield the candidates to follow from rest, get them, and return how far they lie apart.

    The most deviating one first. An elastic body without limit points has one state a pressure, so that
    candidates may start from Model A's; if this one has another, all are followed.
    """
    check = PathCheck()
    sizes = {
        (name, p): float(np.linalg.norm(points - known.still[p], axis=1).max())
        for name, found in known.anchors.items()
        for p, points in found.items()
        if p in known.compared_kPa and p
    }
    if not sizes:
        return check
    name, pressure = max(sizes, key=lambda one: sizes[one])
    (own,) = yield [(name, tuple(compared.samples.outward(pressure)))]
    check.allowed_mm = max(PATH_DIFFERENCE_MM, PATH_DIFFERENCE_SHARE * sizes[name, pressure])
    check.difference_mm = np.inf
    if pressure in own.pressure_kPa:
        check.difference_mm = float(np.abs(own.anchors[-1] - known.anchors[name][pressure]).max())
    if check.independent:
        return check
    reached = known.compared_kPa
    sides = [tuple(compared.samples.outward(p)) for p in (min(reached), max(reached))]
    asked = [(name, side) for name in compared.names for side in sides if side]
    for (name, _), one in zip(asked, (yield asked), strict=True):
        check.along.setdefault(name, {}).update(zip(one.pressure_kPa, one.anchors, strict=True))
    return check


def evaluated(
    compared: RankingSetup,
    known: Standing,
    check: PathCheck,
    motion: Trajectory,
    anchors: Array,
    stations: int,
) -> dict[str, Deviation]:
    """Deviation from Model A's motion of every candidate solved at all pressures, by name.

    anchors (p, 3) in mm. Where candidates' paths lead elsewhere than Model A's states, `known` is changed to
    what they lead to.
    """
    if not check.independent:
        _along(compared, known, check)
    distinct = np.array(compared.samples.distinct_kPa)
    names = [name for name in compared.names if name not in known.at_least_mm]
    solved_at = [n for n, p in enumerate(distinct.tolist()) if p in known.solved_kPa]
    apart = {n: _apart(known, names, float(distinct[n])) for n in solved_at}
    apart = {n: values for n, values in apart.items() if np.isfinite(values).all()}
    none = np.zeros((len(distinct), len(names), *anchors.shape))
    difference = between(distinct, apart) if apart else none
    difference[~np.isin(distinct, known.compared_kPa)] = np.nan
    baseline = baseline_of(motion, anchors)
    moved = baseline[:, None] + motion.of_time(difference)
    line = centreline(baseline, stations)
    return {
        name: centreline_deviation(centreline(moved[:, n], stations), line) for n, name in enumerate(names)
    }


def baseline_of(motion: Trajectory, anchors: Array) -> Array:
    """Anchors (k, p, 3) in mm moved by Model A at every instant; anchors (p, 3): at rest."""
    monitor = probe(motion.mesh, anchors)
    return motion.of_time(np.array([anchors + monitor.displacement(s.u) for s in motion.solved]))


def evaluated_in_time(
    names: Sequence[str], moved: Mapping[str, Array], motion: Trajectory, anchors: Array, stations: int
) -> tuple[dict[str, Deviation], list[str]]:
    """Deviation of candidates where contact or wall has history, and the instants that are not compared.

    moved: anchors (k, p, 3) in mm at each instant that a candidate reached. Raises ConvergenceError where no
    pressure is left to compare.
    """
    time, pressure = motion.time_s, motion.pressure_kPa
    count = min(map(len, moved.values()))
    not_reached = []
    if count < len(time):
        first = next(name for name in names if len(moved[name]) == count)
        not_reached = [CONTACT_REACH.format(time[count], first, pressure[count])]
        if not pressure[:count].any():
            raise ConvergenceError(f"not all paths are compared {not_reached[0]}", first, LOWER)
    baseline = baseline_of(motion, anchors)
    line, found = centreline(baseline, stations), {}
    for name in names:
        own = np.full(baseline.shape, np.nan)
        own[:count] = moved[name][:count]
        found[name] = centreline_deviation(centreline(own, stations), line)
    return found, not_reached


def deviation_alone(
    waveguides: PrintedWaveguides,
    number: int,
    compared: RankingSetup,
    motion: Trajectory,
    stations: int,
) -> tuple[float, Solved | None]:
    """J_hat in mm of one candidate, by its number, nan where it reaches no pressure; and all its states."""
    states = {round(s.pressure_kPa, 9): s for s in motion.solved}
    parts: list[Solved] = []

    def solve(asked: Sequence[Member]) -> list[Solved]:
        ((_, pressures),) = asked
        parts.append(solved(waveguides, number, pressures, states, stations))
        return parts[-1:]

    try:
        known = value_of(solving(compared, None), solve)
    except ConvergenceError:
        return np.nan, None
    found = evaluated(compared, known, PathCheck(), motion, waveguides.anchors, stations)
    every = [
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("anchors", "still", "distance_mm", "difference_mm")
    ]
    at = tuple(p for part in parts for p in part.pressure_kPa)
    return found[compared.names[0]].J_hat, Solved(at, *every)


def _along(compared: RankingSetup, known: Standing, check: PathCheck) -> None:
    """Take every candidate's states along its path from rest, at the pressures that all of them reach."""
    known.at_least_mm = {}
    for pressure in sorted((p for p in known.compared_kPa if p), key=abs):
        for name in compared.names:
            if pressure in known.compared_kPa and pressure not in check.along.get(name, {}):
                why = f"no equilibrium at {pressure:.4g} kPa on its path from rest"
                known.leave_out(name, pressure, why, compared.samples.distinct_kPa)
    for name in compared.names:
        still = {p: a for p, a in known.anchors.get(name, {}).items() if not p}
        known.anchors[name] = {**still, **check.along[name]}
