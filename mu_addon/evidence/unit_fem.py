"""The unit's responses for the evidence, from the finite-element model that designers use."""

from __future__ import annotations

import hashlib
import multiprocessing
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..design.parameters import Unit
from ..errors import ConvergenceError, InputError, MeshingError, MuError
from ..fem.equilibrium import Equilibrium, State, rest
from ..fem.kinematics import bending_angle_deg
from ..fem.lattice_law import LatticeLaw
from ..fem.trajectory import branches
from ..files import read_npz, write_npz
from ..measured import Experiment
from ..meshing.mesh import AXES
from ..meshing.settings import MeshSettings
from ..meshing.unit import mesh_unit
from ..processes import end_with_parent, one_thread_each
from .markers import Marker, attached, followed
from .prediction.unit import KIND, UnitResponse, Variant
from .unit_effects import EFFECTS, SMOOTH, Body, UnitEffect

Array = np.ndarray[Any, Any]
Progress = Callable[[str, float], None]

# Part of every key: raise it when a change of the code changes what is computed.
REVISION = 1
ANGLE = "angle_deg"
# Fewer pressures make no cubic spline.
FEWEST = 4
# Along the meridian as fine as the default: there a coarser mesh misses most.
COARSE = MeshSettings(refine=0.6, meridian_mm=0.9)
FINE = MeshSettings()


class UnitResponseWarning(UserWarning):
    """A part of the unit's response that could not be computed and is left out."""


@attrs.frozen
class UnitSettings:
    """How the unit is simulated for the evidence.

    mesh: the model's; finer: what mesh_error compares it with. pressures: how many, about; margin: how far
    beyond the measured ones, as a share of their range. effects: names of those to run. distal: chambers
    behind a clog. lattice: a law for the lattice in place of the unit's moduli. farthest_mm: of a marker
    from the unit, at scale 1. workers: processes.
    """

    mesh: MeshSettings = COARSE
    finer: MeshSettings = FINE
    pressures: int = 12
    margin: float = 0.05
    effects: tuple[str, ...] = tuple(EFFECTS)
    distal: int = 1
    lattice: LatticeLaw | None = None
    farthest_mm: float = 4.0
    workers: int = 2

    def __attrs_post_init__(self) -> None:
        for name in self.effects:
            if name not in EFFECTS:
                raise InputError(
                    f"the unit's model has no effect {name!r}",
                    "unit settings",
                    f"known: {', '.join(EFFECTS)}",
                )
        if self.pressures < FEWEST or self.workers < 1:
            raise InputError(
                f"{self.pressures} pressures or {self.workers} workers are too few",
                "unit settings",
                f"give {FEWEST} pressures and 1 worker at least",
            )


@attrs.frozen
class Run:
    """One quasi-static run: a body, the effect on it and its size, pressures in kPa, points (p, 3) in mm."""

    body: Body
    pressures_kPa: tuple[float, ...]
    points: tuple[tuple[float, float, float], ...] = ()
    effect: str = ""
    size: float = 0.0

    @property
    def changed(self) -> tuple[Body, UnitEffect | None]:
        """The body with the effect on it, and the effect where it does more than that."""
        if not self.effect:
            return self.body, None
        effect = EFFECTS[self.effect]
        body = effect.body(self.body, self.size) if effect.body else self.body
        return body, effect if effect.materials or effect.model else None

    def key(self) -> str:
        """Hash of all that the result depends on."""
        try:
            body, effect = self.changed
        except InputError:
            # No such body: its failure is kept, too.
            body, effect = self.body, EFFECTS[self.effect]
        parts = [REVISION, body.unit.hash(), attrs.astuple(body.mesh), self.pressures_kPa, self.points]
        parts += [effect.newton if effect else SMOOTH, body.lattice.hash() if body.lattice else ""]
        if body.drawn:
            parts += [body.drawn.hash()]
        if effect:
            parts += [effect.name, self.size]
            parts += [body.distal if effect.name == "clogged_chamber" else 0]
            parts += [body.orientation_deg if effect.weighs else 0.0]
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:32]


@attrs.frozen(eq=False)
class Result:
    """What a run found: values (1 + 3 p, k), an angle in degrees and places in mm; where nan, why."""

    values: Array
    why: str = ""


def run(case: Run, cache: Path | None = None) -> Result:
    """Angle and places of points at every pressure, from rest outward.

    cache: where a mesher that is not repeatable keeps its meshes. A pressure that cannot be reached, with
    those beyond it, is nan; so is all where the body cannot be drawn or meshed.
    """
    values = np.full((1 + 3 * len(case.points), len(case.pressures_kPa)), np.nan)
    try:
        body, effect = case.changed
        mesh = body.meshed(cache)
        points = followed(mesh, np.array(case.points).reshape(-1, 3))
        materials, model = body.materials(mesh), body.model(mesh)
        if effect and effect.materials:
            materials = effect.materials(body, mesh, case.size)
        if effect and effect.model:
            model = effect.model(body, mesh, case.size)
        equilibrium = Equilibrium(model, materials, effect.newton if effect else SMOOTH)
        for at, state in _states(equilibrium, np.array(case.pressures_kPa)):
            values[0, at] = bending_angle_deg(mesh, state.u)
            values[1:, at] = points.at(state.u).ravel()
    except (InputError, MeshingError, ConvergenceError) as error:
        return Result(values, str(error))
    return Result(values)


def _states(equilibrium: Equilibrium, pressures_kPa: Array) -> Iterator[tuple[int, State]]:
    """Number of a pressure and its state, as far as they are reached; the last ConvergenceError is raised."""
    start = _unpressed(equilibrium)
    distinct, sides = branches(pressures_kPa)
    if 0.0 in distinct:
        yield int(np.flatnonzero(pressures_kPa == 0.0)[0]), start
    failed: ConvergenceError | None = None
    for side in sides:
        history = [start]
        for pressure in side:
            try:
                history.append(equilibrium.reach(pressure / 1e3, history))
            except ConvergenceError as error:
                failed = error
                break
            yield int(np.flatnonzero(pressures_kPa == pressure)[0]), history[-1]
    if failed:
        raise failed


def _unpressed(equilibrium: Equilibrium) -> State:
    """The state without pressure; a weight too large for one step is put on in several."""
    model = equilibrium.model
    state, load = rest(model.mesh), model.load
    if load is None:
        return state
    for steps in (1, 4, 16):
        try:
            now = state
            for step in range(1, steps + 1):
                model.load = load * (step / steps)
                now = equilibrium.newton(now.u, 0.0)
            return now
        except ConvergenceError:
            if steps == 16:
                raise
        finally:
            model.load = load
    return state


def pressures(readings_kPa: Array, count: int, margin: float) -> tuple[float, ...]:
    """About `count` pressures in kPa, ascending, from a little below the readings to above, 0 among them."""
    low, high = min(0.0, float(np.min(readings_kPa))), max(0.0, float(np.max(readings_kPa)))
    if low == high:
        raise InputError("the pressure is 0 throughout", "unit_pressure", "add an experiment under pressure")
    beyond = margin * (high - low)
    # Two digits, so that a longer record of the same protocol finds the same runs.
    low, high = (float(f"{end:.2g}") for end in (low - beyond, high + beyond))
    below = int(np.clip(round((count - 1) * low / (low - high)), 1, count - 2))
    sides = np.linspace(low, 0.0, below + 1), np.linspace(0.0, high, count - below)
    return tuple(np.concatenate([sides[0][:-1], sides[1]]).tolist())


def unit_responses(
    unit: Unit,
    experiments: Sequence[Experiment],
    settings: UnitSettings | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> tuple[UnitResponse, ...]:
    """The unit's response at each scale and orientation of the unit_pressure experiments among those given.

    The unit keeps its moduli at every scale, as proportional scaling has it. Its runs are kept in the folder
    `cache` and found again there, also by another call; `progress` is told what is done and the share.
    Sizes of an effect that cannot be computed are left out with a UnitResponseWarning, and so are
    pressures that the base model does not reach. Raises InputError for markers out of place (`attached`) and
    added masses, which the model lacks, and ConvergenceError where the base model reaches too few pressures.
    """
    settings = settings or UnitSettings()
    say = progress or (lambda stage, share: None)
    chosen = [e for e in experiments if e.kind == KIND]
    for e in chosen:
        if e.added_mass_g:
            raise InputError("the unit's model has no added mass", e.name, "leave the experiment out")
    plans = [_Plan.of(unit, chosen, scale, settings, cache) for scale in sorted({e.scale for e in chosen})]
    for plan in plans:
        for m in plan.markers:
            say(f"marker {m.number} at {plan.scale:g}x lies {m.distance_mm:.2f} mm from its point", 0.0)
    cases = {case.key(): case for plan in plans for case in plan.runs(settings)}
    found = _found(cases, settings.workers, cache, say)
    responses = [r for plan in plans for r in plan.responses(settings, found)]
    # Whoever asks for the channels of all looks at the first.
    return tuple(sorted(responses, key=lambda r: -len(r.channels)))


def unit_markers(
    unit: Unit, experiments: Sequence[Experiment], settings: UnitSettings | None = None
) -> dict[float, tuple[Marker, ...]]:
    """Where the markers of unit_pressure experiments sit on the unit, by scale; see `attached`."""
    settings = settings or UnitSettings()
    chosen = [e for e in experiments if e.kind == KIND]
    return {s: _Plan.of(unit, chosen, s, settings, None).markers for s in sorted({e.scale for e in chosen})}


@attrs.frozen
class _Plan:
    """What is to be run for one scale."""

    body: Body
    scale: float
    orientations: tuple[float, ...]
    pressures_kPa: tuple[float, ...]
    markers: tuple[Marker, ...]
    channels: tuple[str, ...]

    @classmethod
    def of(
        cls,
        unit: Unit,
        chosen: Sequence[Experiment],
        scale: float,
        settings: UnitSettings,
        cache: Path | None,
    ) -> _Plan:
        here = [e for e in chosen if e.scale == scale]
        scaled = attrs.evolve(unit, scale=scale)
        readings = np.concatenate([e["pressure_kPa"] for e in here])
        body = Body(scaled, settings.mesh, settings.finer, settings.distal, settings.lattice)
        mesh = mesh_unit(scaled, settings.mesh, cache=cache)
        markers = attached(mesh, here, settings.farthest_mm * scale)
        measured = {c for e in here for c, values in e.columns.items() if np.isfinite(values).any()}
        known = [ANGLE, *(f"marker{m.number}_{a}_mm" for m in markers for a in AXES)]
        return cls(
            body,
            scale,
            tuple(sorted({e.orientation_deg % 360.0 for e in here})),
            pressures(readings, settings.pressures, settings.margin),
            markers,
            tuple(c for c in known if c in measured),
        )

    def case(self, effect: str = "", size: float = 0.0, orientation_deg: float = 0.0) -> Run:
        points = tuple(tuple(m.point.tolist()) for m in self.markers)
        body = attrs.evolve(self.body, orientation_deg=orientation_deg)
        return Run(body, self.pressures_kPa, points, effect, size)

    def runs(self, settings: UnitSettings) -> Iterator[Run]:
        """The base first, then what takes longest."""
        yield self.case()
        for name in sorted(settings.effects, key=lambda n: n != "mesh_error"):
            effect = EFFECTS[name]
            for orientation in self.orientations if effect.weighs else (0.0,):
                for size in effect.sizes:
                    if size != effect.parameter.null:
                        yield self.case(name, size, orientation)

    def responses(self, settings: UnitSettings, found: dict[str, Result]) -> Iterator[UnitResponse]:
        """The response in each orientation."""
        base = found[self.case().key()]
        rows = self._rows()
        reached = np.isfinite(base.values[0])
        if np.count_nonzero(reached) < FEWEST:
            raise ConvergenceError(
                f"the unit at {self.scale:g}x reaches too few of the measured pressures: {base.why}",
                "unit_pressure",
                "check the unit's moduli and wall against the specimen's",
            )
        if not reached.all():
            missed = ", ".join(f"{p:g}" for p in np.array(self.pressures_kPa)[~reached])
            _warn(f"The unit at {self.scale:g}x does not reach {missed} kPa: {base.why}")
        kept = np.ix_(np.array(rows), np.flatnonzero(reached))
        for orientation in self.orientations:
            variants = {}
            for name in settings.effects:
                sizes, values = [], []
                for size in EFFECTS[name].sizes:
                    if size == EFFECTS[name].parameter.null:
                        result = base
                    else:
                        result = found[self.case(name, size, orientation).key()]
                    if np.isfinite(result.values[kept]).all():
                        sizes.append(size)
                        values.append(result.values[kept])
                    else:
                        _warn(f"{name} = {size:g} at {self.scale:g}x is left out: {result.why}")
                if len(sizes) > 1:
                    variants[name] = Variant(EFFECTS[name].parameter, np.array(sizes), np.array(values))
            at = np.array(self.pressures_kPa)[reached]
            yield UnitResponse(self.channels, at, base.values[kept], variants, self.scale, orientation)

    def _rows(self) -> list[int]:
        order = [ANGLE, *(f"marker{m.number}_{a}_mm" for m in self.markers for a in AXES)]
        return [order.index(c) for c in self.channels]


def _warn(text: str) -> None:
    warnings.warn(text, UnitResponseWarning, stacklevel=4)


def _found(cases: dict[str, Run], workers: int, cache: Path | None, say: Progress) -> dict[str, Result]:
    """Results by key, from the cache where they are there, and kept there as soon as one is found."""
    found: dict[str, Result] = {}
    for key, case in cases.items():
        result = _stored(cache, key, case)
        if result is not None:
            found[key] = result
    missing = {key: case for key, case in cases.items() if key not in found}
    for key, result in _solved(missing, workers, cache):
        found[key] = result
        if cache is not None:
            write_npz(_path(cache, key), {"values": result.values, "why": np.array(result.why)})
        case = cases[key]
        what = f"{case.effect} = {case.size:g}" if case.effect else "base"
        say(f"unit at {case.body.unit.scale:g}x, {what}", len(found) / len(cases))
    return found


def _solved(missing: dict[str, Run], workers: int, cache: Path | None) -> Iterator[tuple[str, Result]]:
    rest_ = dict(missing)
    # One run here first: it compiles what the processes then find compiled.
    for key in list(rest_)[: 1 if workers > 1 else None]:
        yield key, run(rest_.pop(key), cache)
    if not rest_:
        return
    context = multiprocessing.get_context("spawn")
    with one_thread_each(), ProcessPoolExecutor(workers, context, end_with_parent) as pool:
        waiting = {pool.submit(run, case, cache): key for key, case in rest_.items()}
        try:
            for done in as_completed(waiting):
                yield waiting[done], done.result()
        except BrokenProcessPool:
            raise MuError(
                "a process that simulated the unit ended before its time",
                "unit_pressure",
                "run again, it resumes; if memory is short give 1 worker",
            ) from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _path(cache: Path, key: str) -> Path:
    return cache / f"unit-{key}.npz"


def _stored(cache: Path | None, key: str, case: Run) -> Result | None:
    """A kept result, or None where there is none that can be read whole."""
    if cache is None:
        return None
    kept = read_npz(_path(cache, key))
    if kept is None or not {"values", "why"} <= set(kept):
        return None
    shape = (1 + 3 * len(case.points), len(case.pressures_kPa))
    return Result(kept["values"], str(kept["why"])) if kept["values"].shape == shape else None
