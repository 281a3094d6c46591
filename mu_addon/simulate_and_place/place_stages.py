"""Stages of a ranking: the estimate, the candidates against Model A, the mesh check, the lattice's paths."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..body.candidates import PrintedWaveguides
from ..body.waveguide import bar_of
from ..design.anchors import windows
from ..design.body import Body
from ..design.parameters import Unit
from ..errors import ConvergenceError, InputError
from ..fem.factor import IndefiniteError
from ..fem.state import State
from ..fem.trajectory import Trajectory, whole_body
from ..generators import value_of
from ..meshing.mesh import Mesh
from ..placement.candidates import Candidate
from ..placement.deviation_bounds import Contest
from ..placement.graph import Limits
from ..placement.search import Search, searching
from ..report.results import LatticePath, Signals
from ..run.cache import Cache
from .compared_pressures import (
    PathCheck,
    RankingSetup,
    Solved,
    Solving,
    Standing,
    deviation_alone,
    evaluated,
    evaluated_in_time,
    solving,
    waveguides_of,
)
from .graph_search import Predicted, chains_within, is_printable, lattice_paths
from .light import light_signals
from .mechanics import Mechanics, Samples
from .model_a import InTime
from .motion import motion_in_time, motion_of
from .path_estimate import estimated_J_mm
from .path_motion import PathMotion, PathMotions
from .ranking import Ranking, extremes, mesh_change_mm

if TYPE_CHECKING:
    from ..run.study import Tell
    from ..sensing.optics import Optics


def require_paths(unit: Unit, body: Body | None, limits: Limits | None) -> None:
    """Raise InputError if no path can be placed: no window fits a waveguide, no chain the limits."""
    if limits is not None:
        chains_within(unit, limits)
        return
    refused: list[InputError] = []
    for one in windows(unit.chambers.count):
        try:
            bar_of(unit, one, body)
            return
        except InputError as error:
            refused.append(error)
    raise refused[0]


# The estimate.


def estimates(
    mechanics: Mechanics, mesh: Mesh, states: Sequence[State], samples: Samples, stations: int
) -> dict[str, float]:
    """Estimate of J_hat in mm of every path, the least first; none where the unit has no response."""
    try:
        return estimated_J_mm(mechanics, mesh, states, samples, stations)
    except (InputError, IndefiniteError):
        # Model A is unstable, or the mesh is coarse: the paths are solved all the same.
        return {}


def words_on_estimates(J_mm: Mapping[str, float]) -> str:
    """One line on estimates of J_hat in mm by path, the least first."""
    found = ", ".join(f"{name} {value:.2f}" for name, value in J_mm.items())
    return f"estimated mean deviation [mm]: {found}" if found else ""


# Candidates.


def words_on_solved(found: Solved) -> str:
    """A few words on a candidate's states."""
    return f"{', '.join(f'{p:g}' for p in found.pressure_kPa)} kPa"


def marched(waveguides: PrintedWaveguides, number: int, samples: Samples) -> Array:
    """Anchors (k, p, 3) in mm of a candidate, by its number, instant by instant, as far as it goes."""
    try:
        return waveguides.simulated_in_time(number, samples.time_s, samples.pressure_kPa)
    except ConvergenceError:
        return np.empty((0, *waveguides.anchors.shape))


def sweep_figures(standing: Standing, check: PathCheck | None) -> dict[str, Any]:
    """What candidates were solved at, and how far they may be trusted."""
    found = {
        "pressures_solved_kPa": [p for p in standing.solved_kPa if p],
        "relative_error_between": standing.error,
        "not_reached": standing.not_reached,
    }
    if check is not None:
        found |= {"path_difference_mm": check.difference_mm, "independent_of_path": check.independent}
    return found


def differences(path: str, found: Mapping[Any, Solved], standing: Standing) -> dict[float, Array]:
    """Differences (n, 3) in mm of a path's unit from Model A on the whole mesh, by pressure in kPa."""
    kept: dict[float, Array] = {}
    for member, one in found.items():
        if member[0] == path:
            for k, p in enumerate(one.pressure_kPa):
                if p in standing.compared_kPa:
                    kept.setdefault(p, one.difference_mm[k])
    return kept


# The mesh check.


@attrs.frozen
class Uncertainty:
    """Mesh uncertainty of J_hat in mm, None where it is not known, and why."""

    value_mm: float | None = None
    why: str = ""


def uncertainty(
    ranking: Ranking,
    samples: Samples,
    stations: int,
    anchors: Array,
    mesh: Mesh | None,
    by_pressure: Mapping[Any, Solved] | None,
    states: Mapping[float, State] | None,
    instants: InTime | None,
    moved: Mapping[str, Array] | None,
) -> Uncertainty:
    """The largest change of J_hat of the best paths on a coarser mesh, at the extreme pressures.

    Of a motion instant by instant: over the whole protocol.
    """
    if mesh is None or not (by_pressure or moved):
        return Uncertainty()
    try:
        if instants is not None and moved:
            motion = motion_in_time(mesh, samples, instants)
            found, _ = evaluated_in_time(tuple(moved), moved, motion, anchors, stations)
            return Uncertainty(mesh_change_mm(ranking.deviations, found, range(len(samples.time_s))))
        known = extremes(samples.pressure_kPa[ranking.compared])
        at = [int(np.flatnonzero(samples.pressure_kPa == p)[0]) for p in known]
        few = Samples(np.arange(len(known), dtype=float), known, known)
        # Those at other pressures were begun before it was known which of them are compared.
        there = {m[0]: one for m, one in (by_pressure or {}).items() if m[1] == tuple(known.tolist())}
        standing, names = Standing(), tuple(there)
        for name, one in there.items():
            standing.add(name, one)
        reached = {p for p in known.tolist() if all(p in standing.anchors.get(name, {}) for name in names)}
        standing.compared_kPa = sorted(reached)
        motion = motion_of(mesh, few, states or {})
        found = evaluated(RankingSetup(names, few), standing, PathCheck(), motion, anchors, stations)
        return Uncertainty(mesh_change_mm(ranking.deviations, found, at))
    except ConvergenceError as error:
        return Uncertainty(None, f"The mesh uncertainty is not known: on the coarser mesh, {error.what}.")


def letting_in(
    compared: RankingSetup, contest: Contest, standing: Standing, check: PathCheck, found: Uncertainty
) -> Solving:
    """Solve on all paths that the mesh uncertainty does not tell from the best, see `solving`.

    Where candidates were followed from rest, each is known already.
    """
    if not check.independent:
        return standing
    wider = attrs.evolve(contest, margin_mm=found.value_mm or 0.0)
    return (yield from solving(compared, wider, standing))


# Light.


@attrs.frozen(eq=False)
class Light:
    """Light signals, and why some paths have none, by name."""

    signals: Signals
    without: dict[str, str]


def lit(
    unit: Unit, optics: Optics, motion: Trajectory, ranking: Ranking, mechanics: Mechanics, tell: Tell
) -> Light:
    """The light along every path. Raises InputError, see `light_signals`."""
    has_gravity = mechanics.effects.has_gravity
    return Light(*light_signals(unit, optics, motion, ranking, has_gravity, Cache(tell.cache), tell))


# Every path of the lattice.


@attrs.frozen(eq=False)
class CheckedPath:
    """A path of the lattice by the full model: J_hat in mm, nan of one that cannot be printed or solved.

    printable: a waveguide can be printed along it.
    """

    J_mm: float
    printable: bool
    pressure_kPa: tuple[float, ...] = ()
    difference_mm: Array = attrs.field(factory=lambda: np.empty((0, 0, 3), np.float32))


def checked_paths(found: Predicted, most: int) -> Generator[list[int], Sequence[CheckedPath], Search]:
    """Yield numbers of paths to solve, get them, and return the search's outcome."""
    return searching(found.J_mm, most, lambda one: one.J_mm)


def whole_motion(motion: Trajectory) -> Trajectory:
    """Motion of the whole body, of that of its half."""
    return whole_body(motion.mesh, motion)[1]


def check_path(
    number: int,
    motion: Trajectory,
    mechanics: Mechanics,
    limits: Limits,
    compared: RankingSetup,
    stations: int,
) -> CheckedPath:
    """A path of the lattice, by its number, on the whole body."""
    graph, chains = chains_within(mechanics.unit, limits)
    points = graph.nodes[list(chains[number])]
    if not is_printable(mechanics.unit, points):
        return CheckedPath(np.nan, False)
    candidate = Candidate(f"path{number}", 0, points)
    waveguides = waveguides_of(mechanics, motion.mesh, [candidate])
    alone = attrs.evolve(compared, names=(candidate.name,))
    J, found = deviation_alone(waveguides, 0, alone, motion, stations)
    if found is None:
        return CheckedPath(J, True)
    return CheckedPath(J, True, found.pressure_kPa, found.difference_mm)


@attrs.frozen(eq=False)
class SearchOutcome:
    """Every path of the lattice, the solved ones first and the best first; checked, count: of them, of all.

    risk: that an unsolved one is better, at most; complete: it is as small as asked for; unprintable: number
    of paths that no waveguide can be printed along.
    """

    paths: tuple[LatticePath, ...]
    checked: int
    count: int
    risk: float
    complete: bool
    unprintable: int

    @property
    def best(self) -> LatticePath:
        """The path of least deviation."""
        return self.paths[0]


def search_of(
    unit: Unit, limits: Limits, found: Predicted, checks: int, checked: Mapping[int, CheckedPath]
) -> SearchOutcome:
    """The search's outcome from the paths that were solved."""
    outcome = value_of(checked_paths(found, checks), lambda asked: [checked[number] for number in asked])
    paths = lattice_paths(unit, limits, found.J_mm, outcome)
    return SearchOutcome(
        tuple(paths),
        len(outcome.checked),
        len(found.J_mm),
        outcome.risk,
        outcome.complete,
        sum(not one.printable for one in checked.values()),
    )


@attrs.frozen(eq=False)
class NamedMotion:
    """A path's motion for display, with its name."""

    name: str
    motion: PathMotion | None


def motion_of_best(
    search: SearchOutcome,
    own: Mesh,
    whole: Trajectory,
    mechanics: Mechanics,
    checked: Mapping[int, CheckedPath],
) -> NamedMotion:
    """Motion of the lattice's best path, on the study's mesh if that is a whole, or a half and its image."""
    best = checked[int(search.best.name.removeprefix("path"))]
    if own.symmetry not in ((), ("x",)):
        return NamedMotion(search.best.name, None)
    states = {round(s.pressure_kPa, 9): s for s in whole.solved}
    painter = PathMotions(mechanics, own, whole.mesh, states)
    return NamedMotion(
        search.best.name, painter.of(dict(zip(best.pressure_kPa, best.difference_mm, strict=True)))
    )
