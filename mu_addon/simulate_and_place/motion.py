"""Model A's motion of a unit: its mesh, each state, and what is read off them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_MPa
from ..fem.state import State, rest
from ..fem.trajectory import Trajectory
from ..meshing.mesh import Mesh
from ..report.motion_files import Surface, SurfaceFields, surfaces_of
from .mechanics import Mechanics, Samples
from .model_a import InTime
from .motion_checks import crossings
from .motion_tables import Reached, Row, SelfContactRows, self_contact_rows, stretch_rows

if TYPE_CHECKING:
    from ..fem.equilibrium import Equilibrium


def state_after(equilibrium: Equilibrium, pressure_kPa: float, earlier: Sequence[State]) -> State:
    """State at a pressure from earlier ones on its side of rest, the nearest last; from rest without any.

    It depends on these alone: neither on the process that solves it nor on what that solved before.
    """
    equilibrium.model.forget_contact()
    if not pressure_kPa:
        return equilibrium.at_zero_pressure()
    return equilibrium.reach(in_MPa(pressure_kPa), list(earlier) or [equilibrium.at_zero_pressure()])


@lru_cache(maxsize=1)
def _at_rest(mesh: Mesh) -> State:
    return rest(mesh)


def motion_of(mesh: Mesh, samples: Samples, states: Mapping[float, State]) -> Trajectory:
    """Motion through a protocol of the states at its distinct pressures in kPa; at 0 without one, rest."""
    solved = tuple(states[p] if p in states else _at_rest(mesh) for p in samples.distinct_kPa)
    index = np.searchsorted(samples.distinct_kPa, samples.pressure_kPa)
    return Trajectory(samples.time_s, samples.pressure_kPa, solved, index, mesh)


def motion_in_time(mesh: Mesh, samples: Samples, found: InTime) -> Trajectory:
    """Motion of a state an instant."""
    index = np.arange(len(found.states))
    return Trajectory(samples.time_s, samples.pressure_kPa, found.states, index, mesh)


def reached_of(
    mesh: Mesh,
    samples: Samples,
    states: Mapping[float, State] | None,
    instants: InTime | None,
    has_gravity: bool,
    has_history: bool,
) -> Reached:
    """The instants that a motion has reached so far."""
    if instants is not None:
        return Reached.of(samples, instants.states, by_instant=True, in_time=True)
    found = list((states or {}).values())
    start = [] if has_gravity or not found else [_at_rest(mesh)]
    return Reached.of(samples, [*start, *found], by_instant=False, in_time=has_history)


@attrs.frozen(eq=False)
class MotionTables:
    """What is read off a motion: rows of stretch.csv, walls that cross (`crossings`), the solver."""

    stretch: tuple[Row, ...]
    walls_cross: dict[str, tuple[str, ...]]
    solver: str
    unknowns: int


def tables_of(mechanics: Mechanics, motion: Trajectory, cache: Path) -> MotionTables:
    """Tables of a whole motion."""
    model = mechanics.model(motion.mesh)
    # With self-contact no step passes a touch.
    crossed = {} if mechanics.self_contact else crossings(motion.mesh, motion.solved)
    stretch = stretch_rows(mechanics, model, motion.solved, cache)
    return MotionTables(stretch, crossed, model.solver, len(model.free))


@attrs.frozen(eq=False)
class StateFields:
    """Fields of a motion's states for display, see `report.motion_files`.

    surface: at the surfaces' nodes by name; of_elements: (m,) by name, of each state; itself: contact of the
    unit with itself.
    """

    surfaces: dict[str, Surface]
    surface: dict[str, Array]
    of_elements: tuple[dict[str, Array], ...]
    itself: SelfContactRows


_LOOKED: WeakKeyDictionary[State, StateFields] = WeakKeyDictionary()
"""Fields of a state, found once: those that are shown while others are missing are shown again later."""


def state_fields(mechanics: Mechanics, motion: Trajectory, instants: InTime | None) -> StateFields:
    """Stress, stretch and contact of every state; instants: of a motion with history."""
    mesh, surfaces = motion.mesh, surfaces_of(motion.mesh)
    remembered = instants.remembered if instants and mechanics.unit.wall.has_memory else ()
    new = [number for number, state in enumerate(motion.solved) if state not in _LOOKED]
    if new:
        looked = SurfaceFields(mesh, {name: one.node for name, one in surfaces.items()})
        states, materials = [motion.solved[number] for number in new], mechanics.materials(mesh)
        itself = self_contact_rows(mechanics, mesh, states)
        for at, (number, state) in enumerate(zip(new, states, strict=True)):
            history, of_elements = [remembered[number] if remembered else ()], list[dict[str, Array]]()
            surface = looked.of_states([state.u], materials, history.__getitem__, of_elements)
            own = SelfContactRows(itself.rows[at : at + 1], itself.pressure_kPa[at : at + 1])
            _LOOKED[state] = StateFields(surfaces, surface, tuple(of_elements), own)
    found = [_LOOKED[state] for state in motion.solved]
    return StateFields(
        surfaces,
        {name: np.concatenate([one.surface[name] for one in found]) for name in found[0].surface},
        tuple(values for one in found for values in one.of_elements),
        SelfContactRows(
            tuple(row for one in found for row in one.itself.rows),
            tuple(pressure for one in found for pressure in one.itself.pressure_kPa),
        ),
    )
