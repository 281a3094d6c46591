"""Quasi-static motion along a pressure protocol: one equilibrium per pressure, read at every instant."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_MPa
from ..errors import InputError
from ..meshing.mesh import Mesh, mirror, mirror_displacement
from .bending_angle import TipSection
from .equilibrium import Equilibrium
from .kinematics import cavity_volume_mm3
from .state import State, rest


@attrs.frozen(eq=False)
class Trajectory:
    """Motion of a mesh through a pressure protocol, in the protocol's order: k instants.

    time_s and pressure_kPa (k,). solved (s,): the distinct states, ordered by pressure by `simulate`; index
    (k,): number of each instant's state.
    """

    time_s: Array
    pressure_kPa: Array
    solved: tuple[State, ...]
    index: Array
    mesh: Mesh = attrs.field(repr=False)

    def of_time(self, values: Array) -> Array:
        """Values (k, ...) at every instant of values (s, ...) at every solved state, in their unit."""
        return np.asarray(values)[self.index]

    @property
    def states(self) -> tuple[State, ...]:
        """The state at each instant (k,)."""
        return tuple(self.solved[i] for i in self.index)

    @property
    def angle_deg(self) -> Array:
        """Bending angle (k,) in degrees at each instant, see `bending_angle_deg`. Needs a mesh with a tip."""
        return self._read(TipSection.of(self.mesh).angle_deg)

    @property
    def tip_mm(self) -> Array:
        """Middle of the tip's end plane at each instant, (k, 3) in mm."""
        return self._read(TipSection.of(self.mesh).middle_mm)

    @property
    def volume_mm3(self) -> Array:
        """Volume (k,) in mm3 of the whole unit's cavity at each instant, without the inlet."""
        return self._read(lambda u: cavity_volume_mm3(self.mesh, u))

    def _read(self, of: Callable[[Array], float | Array]) -> Array:
        return self.of_time(np.array([of(state.u) for state in self.solved]))


def branches(pressure_kPa: Array) -> tuple[Array, list[Array]]:
    """Distinct pressures (d,) in kPa ascending, and the order in which to visit them: outward from 0.

    The second result has one array for each side of 0 that occurs, negative first. pressure_kPa: (k,). An
    elastic body under pressure alone has no memory: while its path is stable, the state depends on the
    pressure only, so that a repeated pressure is solved once.

    >>> import numpy as np
    >>> distinct, sides = branches(np.array([0.0, 20.0, -10.0, 10.0, 20.0]))
    >>> distinct.tolist(), [side.tolist() for side in sides]
    ([-10.0, 0.0, 10.0, 20.0], [[-10.0], [10.0, 20.0]])
    """
    distinct = np.unique(pressure_kPa)
    sides = [distinct[distinct < 0][::-1], distinct[distinct > 0]]
    return distinct, [side for side in sides if len(side)]


def simulate(equilibrium: Equilibrium, time_s: Array, pressure_kPa: Array) -> Trajectory:
    """Quasi-static motion of an elastic body: equilibria at times in s and pressures in kPa, (k,) each.

    Every distinct pressure is solved once, outward from 0, suction last. The state without pressure is solved
    for only where the model has a load.

    Raises ConvergenceError if a pressure cannot be reached, and InputError for a body with friction or a law
    with history, which need `simulate_in_time`.
    """
    if equilibrium.model.has_friction or equilibrium.parameters.has_history:
        raise InputError(
            "the state of a body with friction or memory depends on its history",
            "trajectory.simulate",
            "use time_stepping.simulate_in_time",
        )
    distinct, sides = branches(pressure_kPa)
    model = equilibrium.model
    start = rest(model.mesh) if model.load is None else equilibrium.at_zero_pressure()
    found = {0.0: start}
    # Under pressure first: nothing touches there, so that those states are soon known.
    for side in reversed(sides):
        history = [start]
        for pressure in side:
            found[pressure] = equilibrium.reach(in_MPa(pressure), history)
            history.append(found[pressure])
    solved = tuple(found[p] for p in distinct)
    return Trajectory(time_s, pressure_kPa, solved, np.searchsorted(distinct, pressure_kPa), model.mesh)


def whole_body(mesh: Mesh, trajectory: Trajectory) -> tuple[Mesh, Trajectory]:
    """Mesh and trajectory of the whole body, mirrored from those of its half or quarter.

    Nothing is solved again: the equilibria remain valid to rounding. A path off the mirror plane needs both
    sides.
    """
    for axis in mesh.symmetry:
        states = [attrs.evolve(s, u=mirror_displacement(mesh, s.u, axis)) for s in trajectory.solved]
        mesh = mirror(mesh, axis)
        trajectory = attrs.evolve(trajectory, solved=tuple(states), mesh=mesh)
    return mesh, trajectory
