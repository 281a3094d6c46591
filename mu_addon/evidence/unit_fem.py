"""The unit's responses for the evidence, from the finite-element model that designers use."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from ..errors import ConvergenceError, InputError
from ..measured import Experiment
from ..measured.pose import Direction
from ..run.cache import Cache
from ..run.pool import each
from .drawn import Surface, require_enough
from .effect import Parameter
from .effects import ON_UNITS
from .prediction import blocked_force, pressure_step, unit_pose
from .prediction.flat_obstacle import CONTACT, ObstacleResponse
from .prediction.unit_pressure import KIND, UnitResponse, Variant
from .unit_plan import SHARES, UnitPlan, gap_of
from .unit_run import Result, Run, run
from .unit_settings import FEWEST, UnitSettings

Progress = Callable[[str, float], None]
# Kinds of a unit that bends freely.
FREE = (KIND, pressure_step.KIND, unit_pose.KIND)
# Of the largest change of a value: below it, two meshes are not compared by their ratio.
LEAST_CHANGE = 0.05
# Share of the progress for walls.
CONTACT_SHARE = 0.2
# Of the way from the mesh of changes to the model's, how much farther the answer may lie: a third of it by
# the order of the elements. In suction, where walls close, it is another at each pressure.
FARTHER, UNEVEN = 0.5, 0.25
Shown = Callable[[Result], Array]


class UnitResponseWarning(UserWarning):
    """A part of the unit's response that could not be computed and is left out."""


def unit_responses(
    unit: Unit,
    experiments: Sequence[Experiment],
    settings: UnitSettings | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
    held: bool = False,
) -> tuple[UnitResponse, ...]:
    """Response of the freely bending unit at each scale and orientation of the experiments given.

    Of unit_pose experiments those are the `unit_pose.STATIONS` about their axis. held: instead the force in N
    on a load cell that holds the tip, of blocked_force experiments, at each scale, gap and orientation; a
    unit of s times the size presses with s^2 times the force at the same pressures.

    The unit keeps its moduli at every scale, as proportional scaling has it. Its runs are kept in the folder
    `cache` and found again there, also by another call; `progress` is called with a text and the share done.
    Sizes of an effect that cannot be computed are left out with a UnitResponseWarning, and so are pressures
    that the base model does not reach. Raises InputError for markers out of place (`attached`) and added
    masses, which the model lacks, and ConvergenceError where the base model reaches too few pressures.
    """
    settings = settings or UnitSettings()
    if held:
        settings = attrs.evolve(settings, effects=tuple(n for n in settings.effects if n != CONTACT))
    chosen = [e for e in experiments if e.kind in ((blocked_force.KIND,) if held else FREE)]
    report = progress or (lambda stage, share: None)
    for e in chosen:
        if e.added_mass_g:
            raise InputError("the model of the unit has no added mass", e.name, "leave the experiment out")
    setups = sorted({(e.scale, gap_of(e)) for e in chosen}, key=repr)
    found: dict[str, Result] = {}
    plans = [UnitPlan.of(unit, chosen, *setup, settings, cache, found) for setup in setups]
    for plan in plans:
        for m in plan.markers:
            report(f"marker {m.number} at {plan.scale:g}x lies {m.distance_mm:.2f} mm from its point", 0.0)
    # What runs of effects start from comes before all of them: the same digits on any number of cores.
    starts = {plan.case().key(): plan.case() for plan in plans}
    cases = starts | {case.key(): case for plan in plans for case in plan.runs()}
    of_walls = CONTACT_SHARE if CONTACT in settings.effects else 0.0

    def solve(cases: dict[str, Run], begin: float, part: float, alone: int = 0) -> None:
        def of_all(what: str, share: float) -> None:
            report(what, begin + part * share)

        _solve(found, cases, settings.workers, cache, of_all, alone)

    solve(cases, 0.0, 1.0 - of_walls, len(starts))
    if of_walls:
        solve({c.key(): c for plan in plans for _, _, c in plan.walls()}, 1.0 - of_walls, of_walls)
    responses = _counted_alike([r for plan in plans for r in _responses(plan)])
    # A request for the channels of all uses the first.
    return tuple(sorted(responses, key=lambda r: -len(r.channels)))


def _counted_alike(responses: Sequence[UnitResponse]) -> list[UnitResponse]:
    """The responses with a wall's reach counted from the farthest motion of the free unit in any of them."""
    farthest: dict[int, float] = {}
    for r in responses:
        for s, side in r.walls.items():
            farthest[s] = max(farthest.get(s, 0.0), side.farthest_mm)

    def counted(r: UnitResponse) -> dict[int, ObstacleResponse]:
        spare = {s: farthest[s] - side.farthest_mm for s, side in r.walls.items()}
        return {s: attrs.evolve(side, spare_mm=spare[s]) for s, side in r.walls.items()}

    return [attrs.evolve(r, walls=counted(r)) for r in responses]


def _responses(plan: UnitPlan) -> Iterator[UnitResponse]:
    """The response in each orientation."""
    every, why = np.array(plan.pressures_kPa), plan.base.why or plan.coarse.why
    reached = np.isfinite(plan.base.values[0] + plan.coarse.values[0])
    if np.count_nonzero(reached) < FEWEST:
        raise ConvergenceError(
            f"the unit at {plan.scale:g}x has an equilibrium at too few of the measured pressures: {why}",
            "unit_pressure",
            "check the unit's moduli and wall against the specimen's",
        )
    if not reached.all():
        missed = ", ".join(f"{p:g}" for p in every[~reached])
        _warn(f"The unit at {plan.scale:g}x does not reach {missed} kPa: {why}")
    channels = tuple(c for c in plan.rows if c in plan.measured)
    rows = [plan.rows.index(c) for c in channels]
    at, shown = _shown(plan, rows, reached)
    values = shown(plan.base)
    walls = _sides(plan, rows) if CONTACT in plan.settings.effects else {}
    coarse = shown(plan.coarse)
    surface, errors = (
        _surface(plan, rows, at, values, coarse),
        _mesh_errors(plan, at, values, values - coarse),
    )
    gap = (plan.body.gap_mm or 0.0) * plan.enlarged
    for turn, axis in plan.orientations:
        found = {n: _variant(plan, n, (turn, axis), shown) for n in plan.names}
        variants = {n: v for n, v in found.items() if v is not None} | errors
        how = (plan.scale, turn, axis, walls, plan.settings.discrepancy, gap)
        yield UnitResponse(channels, at, values, variants, *how, surface)


def _shown(plan: UnitPlan, rows: Sequence[int], reached: Array) -> tuple[Array, Shown]:
    """Pressures (k,) in kPa of the response, and a result's channels (c, k) there, nan if not reached.

    Those that were reached, and in suction those midway: there walls and struts touch one after the
    other, at pressures that differ between meshes by less than the interval of simulated pressures.
    """
    from scipy.interpolate import CubicSpline

    at = np.array(plan.pressures_kPa)[reached]
    suction = at[at <= 0.0]
    more = np.sort(np.concatenate([at, (suction[1:] + suction[:-1]) / 2.0]))

    def shown(result: Result) -> Array:
        values = (plan.larger * result.values)[np.ix_(np.array(rows), np.flatnonzero(reached))]
        if not np.isfinite(values).all():
            return np.full((len(rows), len(more)), np.nan)
        return np.asarray(CubicSpline(at, values, axis=-1)(more))

    return more, shown


def _sides(plan: UnitPlan, rows: Sequence[int]) -> dict[int, ObstacleResponse]:
    """The response to walls by side, of the channels in these rows."""
    from scipy.interpolate import CubicSpline

    reached = np.isfinite(plan.coarse.values[0])
    free = CubicSpline(
        np.array(plan.pressures_kPa)[reached], (plan.larger * plan.coarse.values)[:, reached], axis=1
    )
    walls: dict[int, list[tuple[float, Array]]] = {}
    for side, reach, case in plan.walls():
        result = plan.found[case.key()]
        if not np.isfinite(result.values).all():
            _warn(f"a wall {reach:.3g} mm within reach at {plan.scale:g}x is left out: {result.why}")
            continue
        change = plan.larger * result.values - free(case.pressures_kPa)
        # In the order of shares: the pressures ascend, those below 0 toward rest.
        change = change[rows][:, :: 1 if case.pressures_kPa[-1] > 0 else -1].T
        walls.setdefault(side, []).append((reach, change))
    sides = plan.free()
    return {
        side: ObstacleResponse(*sides[side], [r for r, _ in kept], SHARES, np.array([c for _, c in kept]))
        for side, kept in walls.items()
    }


def _surface(plan: UnitPlan, rows: Sequence[int], at: Array, base: Array, coarse: Array) -> Surface | None:
    """The response over the designs; those that do not reach a pressure are left out with a warning.

    rows: of the channels. base, coarse (c, k): the unit's at pressures (k,) in kPa, on both meshes.
    """
    designs = plan.settings.designs
    if designs is None:
        return None
    places, values, rest = [], [], int(np.flatnonzero(at == 0.0)[0])
    for place, case in zip(designs.at, plan.of_designs(designs), strict=True):
        response = base
        if case.body.other:
            response = taken_over(_of_design(plan, case, rows, at, coarse), coarse, base, rest)
        if np.isnan(response).any():
            pairs = zip(designs.parameters, place, strict=True)
            shape = ", ".join(f"{p.name} {v:g}" for p, v in pairs)
            # Where all lengths scale it is the same at every scale, and said once.
            scale = "" if plan.enlarged == plan.scale else f" at {plan.scale:g}x"
            _warn(f"{shape}{scale} is left out: {plan.result(case).why}")
        else:
            places.append(place)
            values.append(response)
    require_enough(len(places), len(designs.parameters))
    return Surface(designs.parameters, np.array(places), np.array(values))


def _of_design(plan: UnitPlan, case: Run, rows: Sequence[int], at: Array, coarse: Array) -> Array:
    """Channels (c, k) of another design at pressures (k,) in kPa, on the mesh of changes.

    coarse (c, k): the unit's on that mesh. Beyond the design's own pressures their difference grows in
    proportion to pressure: there it serves a softer resin alone, and a body that collapses costs most.
    """
    from scipy.interpolate import CubicSpline

    own = np.array(case.pressures_kPa)
    values = (plan.larger * plan.result(case).values)[rows]
    if not np.isfinite(values).all():
        return np.full_like(coarse, np.nan)
    change = CubicSpline(own, values - CubicSpline(at, coarse, axis=1)(own), axis=1)
    inside = np.clip(at, own[0], own[-1])
    grown = np.divide(at, inside, out=np.ones_like(at), where=inside != 0.0)
    return np.asarray(coarse + grown * change(inside))


def _variant(plan: UnitPlan, name: str, orientation: tuple[float, Direction], shown: Shown) -> Variant | None:
    """The response to an effect at the sizes that could be computed; None where that is one alone."""
    effect = ON_UNITS[name]
    grown = plan.enlarged**effect.length
    sizes, missed, values = [], [], []
    for size in plan.sizes(name):
        result = plan.base
        if size != effect.parameter.null:
            result = _taken_over(plan, _continued(plan, plan.result(plan.case(name, size, orientation))))
        response = shown(result)
        if np.isnan(response).any():
            missed.append(size * grown)
            _warn(f"{name} = {size * grown:g} at {plan.scale:g}x is left out: {result.why}")
        else:
            sizes.append(size * grown)
            values.append(response)
    if len(sizes) < 2:
        return None
    # Beyond a size that was not, or could not be, computed the effect is unknown.
    missed += [size * grown for size in effect.sizes_at(plan.enlarged) if size not in plan.sizes(name)]
    low = sizes[0] if any(m < sizes[0] for m in missed) else -math.inf
    high = sizes[-1] if any(m > sizes[-1] for m in missed) else math.inf
    return Variant(effect.parameter.narrowed(low, high), np.array(sizes), np.array(values))


def _continued(plan: UnitPlan, result: Result) -> Result:
    """The result, its changes extrapolated in proportion to pressure where it ends before the readings.

    There it serves gauges alone, and a body that collapses costs most.
    """
    at, values = np.array(plan.pressures_kPa), result.values.copy()
    coarse, reached = plan.coarse.values, np.isfinite(values[0])
    low, high = plan.readings_kPa
    for beyond, last in ((at < low, reached.argmax()), (at > high, len(at) - 1 - reached[::-1].argmax())):
        rows = np.flatnonzero(beyond & ~reached)
        if len(rows) and at[last] and not (at[rows] * at[last] < 0).any():
            change = values[:, [last]] - coarse[:, [last]]
            values[:, rows] = coarse[:, rows] + change * at[rows] / at[last]
    return Result(values, result.why)


def _taken_over(plan: UnitPlan, result: Result) -> Result:
    """The base's response with an effect, from its change of the coarser mesh's."""
    rest = plan.pressures_kPa.index(0.0)
    return Result(taken_over(result.values, plan.coarse.values, plan.base.values, rest), result.why)


def _mesh_errors(plan: UnitPlan, at: Array, base: Array, way: Array) -> dict[str, Variant]:
    """Errors of the model's mesh, everywhere and at each suction, at pressures (k,) in kPa.

    base (c, k): response of c channels; way (c, k): its change from the coarser mesh.
    """
    shares = {"mesh_share": (np.ones_like(at), FARTHER)}
    sucking = np.flatnonzero(at < 0)
    shares |= {f"mesh_share_{-at[i]:.3g}_kPa_below": (np.eye(len(at))[i], UNEVEN) for i in sucking}
    sizes, found = np.array([0.0, 1.0]), {}
    for name, (share, spread) in shares.items():
        name += "_held" * plan.held
        most = 10.0 * spread
        p = Parameter(name, "", -most, most, 0.0, source="two meshes differ by 1", spread=spread)
        found[name] = Variant(p, sizes, np.array([base + size * share * way for size in sizes]))
    return found


def taken_over(changed: Array, coarse: Array, base: Array, rest: int) -> Array:
    """The base's values (c, k) with a change, from those of a coarser mesh with it and without, (c, k) each.

    In proportion to how far both move from rest, which differs by the meshes' errors. rest: the column
    without pressure.
    """
    far, near = (values - values[:, [rest]] for values in (base, coarse))
    least = (LEAST_CHANGE * np.nanmax(np.abs(near), axis=1, keepdims=True)) ** 2
    ratio = (far * near + least) / np.maximum(near**2 + least, np.finfo(float).tiny)
    return np.asarray(base + ratio * (changed - coarse))


def _warn(text: str) -> None:
    warnings.warn(text, UnitResponseWarning, stacklevel=4)


def _solve(
    found: dict[str, Result],
    cases: dict[str, Run],
    workers: int,
    cache: Path | None,
    report: Progress,
    alone: int = 0,
) -> None:
    """Add results by key, from the cache where they are there; what is computed is stored there at once.

    alone: how many of the cases, the first, are run before the others.
    """
    table = None if cache is None else Cache(cache)
    stored = {key: _stored(table, key, case) for key, case in cases.items() if table is not None}
    kept = {key: result for key, result in stored.items() if result is not None}
    found |= kept
    missing = [key for key in cases if key not in kept]
    # One run here first: it compiles the kernels for the other processes.
    done, first = len(kept), max(len({*missing}.intersection([*cases][:alone])), 0 if kept else 1)
    for keys, processes in ((missing[:first], 1), (missing[first:], workers)):
        tasks = [cases[key] for key in keys]
        for number, result in each(partial(run, cache=cache), tasks, processes, "unit_pressure"):
            key, case = keys[number], tasks[number]
            found[key] = result
            if table is not None:
                table.put("unit", key, {"values": result.values, "why": np.array(result.why)})
            what = f"{case.effect} = {case.size:g}" if case.effect else "base"
            done += 1
            report(f"unit, {what}", done / len(cases))


def _stored(table: Cache, key: str, case: Run) -> Result | None:
    """Stored result, or None where there is none that can be read completely."""
    kept = table.get("unit", key)
    if kept is None or not {"values", "why"} <= set(kept):
        return None
    shape = (case.rows, len(case.pressures_kPa))
    return Result(kept["values"], str(kept["why"])) if kept["values"].shape == shape else None
