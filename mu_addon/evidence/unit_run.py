"""One simulation of a unit for the evidence: a body, an effect of one size, a path of pressures."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_MPa
from ..errors import ConvergenceError, InputError, MeshingError
from ..fem.bending_angle import TipSection
from ..fem.equilibrium import Equilibrium
from ..fem.held_tip import HeldTip
from ..fem.self_contact import self_contact_of
from ..fem.state import State
from ..fem.trajectory import branches
from ..measured.pose import X
from ..run.cache import Cache
from .effects import ON_UNITS
from .effects.contact import with_flat_obstacle
from .markers import material_points
from .unit_body import Body, UnitEffect

# Part of every key: raise it when a change of the code changes what is computed.
REVISION = 3
# Steps from a free tip to one that a load cell holds away from its place.
HELD_STEPS = 4
# Name in the cache of the displacements of runs without an effect.
STATES = "states"
NOTHING: Mapping[int, Array] = MappingProxyType({})


@attrs.frozen
class Run:
    """One quasi-static simulation: a body, an effect and its size, pressures in kPa, points in mm.

    points: p of (x, y, z). effect: empty for the base model. size: in the effect's unit. outline: also
    compute the outline's displacement toward +y and -y, in mm.
    """

    body: Body
    pressures_kPa: tuple[float, ...]
    points: tuple[tuple[float, float, float], ...] = ()
    effect: str = ""
    size: float = 0.0
    outline: bool = False

    @property
    def rows(self) -> int:
        """Values at each pressure: angle, volume, three coordinates a point, two moves of the outline.

        Of a held tip the force alone.
        """
        if self.body.gap_mm is not None:
            return 1
        return 2 + 3 * len(self.points) + 2 * self.outline

    @property
    def changed(self) -> tuple[Body, UnitEffect | None]:
        """The body with the effect on it, and the effect, or None where it changes the body alone.

        Raises InputError where the body cannot be drawn with the effect.
        """
        if not self.effect:
            return self.body, None
        effect = ON_UNITS[self.effect]
        body = effect.body(self.body, self.size) if effect.body else self.body
        if effect.has_gravity:
            body = body.whole
        return body, effect if effect.materials or effect.model or effect.load else None

    def key(self) -> str:
        """Hash (32 hex digits) of all that the result depends on."""
        try:
            body, effect = self.changed
        except InputError:
            # No such body: its failure is kept, too.
            body, effect = self.body, ON_UNITS[self.effect]
        parts = [REVISION, body.unit.hash(), attrs.astuple(body.mesh), self.pressures_kPa, self.points]
        parts += [body.newton(effect)]
        if body.drawn:
            parts += [body.drawn.hash()]
        if effect:
            parts += [self.effect, self.size]
            parts += [body.distal if self.effect == "clogged_chamber" else 0]
            parts += [_turned(body) if effect.has_gravity else 0.0]
        if body.self_contact:
            parts += ["self-contact"]
        if body.gap_mm is not None:
            parts += ["held", body.gap_mm]
        if self.outline:
            parts += ["outline"]
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:32]


@attrs.frozen(eq=False)
class Result:
    """Result of a run: values (rows, k) at k pressures, in degrees, mm3 and mm; nan where not reached.

    why: the reason where values are nan, else empty.
    """

    values: Array
    why: str = ""


def run(case: Run, cache: Path | None = None) -> Result:
    """Angle in degrees, growth of the chambers in mm3 and positions of points in mm at every pressure.

    cache: folder where a mesher that is not repeatable keeps its meshes. A pressure that is not reached, with
    those beyond it, is nan; so is all where the body cannot be drawn or meshed.
    """
    values, why = np.full((case.rows, len(case.pressures_kPa)), np.nan), ""
    found: dict[int, Array] = {}
    try:
        body, effect = case.changed
        mesh = body.meshed(cache)
        tip = TipSection.of(mesh)
        points = material_points(mesh, np.array(case.points).reshape(-1, 3))
        materials, model = body.materials(mesh), body.model(mesh)
        if effect and effect.materials:
            materials = effect.materials(materials, mesh, case.size)
        if effect and effect.model:
            model = effect.model(body, mesh, case.size)
        if body.self_contact:
            model.self_contact = self_contact_of(body.unit, mesh)
        if effect and effect.load:
            model.load = effect.load(body, mesh, case.size)
        equilibrium = Equilibrium(model, materials, body.newton(effect))
        start = equilibrium.at_zero_pressure()
        beside = _beside(case, len(mesh.nodes), cache)
        if body.gap_mm is not None:
            held, start = _held(equilibrium, start, body.gap_mm)
            for at, state in _states(equilibrium, case, start):
                values[0, at] = held.reading_N(state.u)
            return Result(values)
        # Out of reach, it only supplies the points at which the unit would touch.
        outline = with_flat_obstacle(body, mesh, 1e6).obstacles[0] if case.outline else None
        places = slice(2, 2 + 3 * len(case.points))
        whole, rest = 2 ** len(mesh.symmetry), model.cavity_volume(np.zeros_like(mesh.nodes))
        for at, state in _states(equilibrium, case, start, beside):
            found[at] = state.u
            values[0, at] = tip.angle_deg(state.u)
            values[1, at] = whole * (model.cavity_volume(state.u) - rest)
            values[places, at] = points.at(state.u).ravel()
            if outline:
                y, still = (outline.places(u)[..., 1] for u in (state.u, np.zeros_like(state.u)))
                values[places.stop :, at] = y.max() - still.max(), still.min() - y.min()
    except (InputError, MeshingError, ConvergenceError) as error:
        why = str(error)
    if cache and found and not case.effect:
        _keep(case, found, cache)
    return Result(values, why)


def _turned(body: Body) -> Any:
    """The part of a body's orientation that its weight depends on: degrees about x, or a direction."""
    if tuple(body.orientation_axis) == X:
        return body.orientation_deg
    return tuple(body.down.tolist())


def _held(equilibrium: Equilibrium, start: State, gap_mm: float) -> tuple[HeldTip, State]:
    """Load cell that holds the tip gap_mm away from a state without pressure, and the state there."""
    held = HeldTip(equilibrium.model.mesh, gap_mm, start.u[:, 1])
    equilibrium.model.obstacles = (held,)
    if gap_mm == 0.0:
        return held, start
    # From where the tip is to where it is held, in steps of which each converges on its own.
    way = held.way.copy()
    for share in np.linspace(0.0, 1.0, HELD_STEPS + 1)[1:]:
        held.way = way - (1.0 - share) * gap_mm
        start = equilibrium.newton(start.u, 0.0)
    return held, start


def _keep(case: Run, found: dict[int, Array], cache: Path) -> None:
    """Keep displacements by number of their pressure, from which runs with effects start."""
    at = sorted(found)
    Cache(cache).put(
        STATES, case.key(), {"at": np.array(at), "u": np.array([found[i] for i in at], np.float32)}
    )


def _beside(case: Run, nodes: int, cache: Path | None) -> dict[int, Array]:
    """Displacements (nodes, 3) in mm of the body without the effect, by number of their pressure.

    Empty where they are not kept, or are of another mesh.
    """
    if cache is None or not case.effect or case.body.gap_mm is not None:
        return {}
    kept = Cache(cache).get(STATES, attrs.evolve(case, effect="", size=0.0, outline=True).key())
    if kept is None or kept["u"].shape[1:] != (nodes, 3):
        return {}
    return dict(zip(kept["at"].tolist(), kept["u"].astype(np.float64), strict=True))


def _states(
    equilibrium: Equilibrium, case: Run, start: State, beside: Mapping[int, Array] = NOTHING
) -> Iterator[tuple[int, State]]:
    """Yield number and state of each pressure as far as they are reached; raise the last ConvergenceError.

    start: without pressure. beside: displacements of a nearly equal body by number. Another design is left
    out for one pressure that it does not reach: it ends there, and suction, which costs most, comes last.
    """
    at_kPa = np.array(case.pressures_kPa)
    distinct, sides = branches(at_kPa)
    number = {p: int(np.flatnonzero(at_kPa == p)[0]) for p in distinct}
    if 0.0 in distinct:
        yield number[0.0], start
    failed: ConvergenceError | None = None
    for side in sides[::-1] if case.body.other else sides:
        history, last = [start], number.get(0.0, -1)
        for pressure in side:
            at, target = number[pressure], in_MPa(pressure)
            try:
                state = _from_beside(equilibrium, history[-1], target, beside.get(last), beside.get(at))
                history.append(state or equilibrium.reach(target, history))
            except ConvergenceError as error:
                if case.body.other:
                    raise
                failed = error
                break
            yield at, history[-1]
            last = at
    if failed:
        raise failed


def _from_beside(
    equilibrium: Equilibrium, last: State, target: float, before: Array | None, there: Array | None
) -> State | None:
    """The state at a pressure in MPa, from those of nearly the same body at the last one and there.

    Its difference from that body's is taken to grow with pressure. None without these, or where it does not
    converge near its start.
    """
    if before is None or there is None:
        return None
    growth = target / last.pressure_MPa if last.pressure_MPa else 1.0
    guess = equilibrium.model.following(there + growth * (last.u - before))
    allowed = equilibrium.settings.predictor_tolerance * float(np.abs(guess - last.u).max())
    try:
        return equilibrium.newton(equilibrium.start(there, guess), target, allowed)
    except ConvergenceError:
        return None
