"""Units with a printed waveguide, each solved from a state of the unit without one."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from functools import cached_property

import attrs
import numpy as np

from ..arrays import Array
from ..design.body import Body
from ..design.parameters import Unit
from ..errors import ConvergenceError
from ..fem.embedding import embed
from ..fem.equilibrium import Equilibrium
from ..fem.kinematics import numbers_of
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.newton_settings import NewtonSettings
from ..fem.state import State, as_far_as_found
from ..fem.time_stepping import simulate_in_time
from ..meshing.mesh import Mesh, part
from .start import eased, started
from .waveguide import bar_of, with_waveguide

EASED_CELLS = 1.0
"""Distance from a waveguide, in cells, within which struts yield to it in a candidate's start."""

MaterialsOf = Callable[[Mesh], Materials]
ModelOf = Callable[[Mesh], Model]


@attrs.frozen(eq=False)
class PrintedWaveguides:
    """Candidates of one unit as printed: displacements of the anchors by each at a state without them.

    mesh: of `mesh_printed`, a half or a whole; paths: lattice nodes (h, 3) in mm of each; anchors (p, 3) in
    mm, nodes of the mesh; materials_of and model_of: a mesh's materials and model; settings: of Newton's
    method; body: a closed surface that cuts the lattice in place of its box. Only the last candidate's model
    is kept: a model takes as much memory as the unit's, and half a state's time to build.
    """

    unit: Unit
    mesh: Mesh
    paths: tuple[Array, ...]
    anchors: Array
    materials_of: MaterialsOf
    model_of: ModelOf
    settings: NewtonSettings
    body: Body | None = None
    _last: dict[int, Equilibrium] = attrs.field(factory=dict, init=False)

    def states(self, number: int, way: Sequence[State]) -> list[State]:
        """A candidate's state, on its mesh, at the pressure of the last of some states of Model A.

        way: Model A's states on one side of rest, in order of pressure. If no start near the last state
        converges, the candidate is followed from the nearest earlier state that does, or from rest; then it
        has a state for each of `way` from there on. The mesh of a candidate begins with the nodes of the
        unit's. Raises ConvergenceError, and InputError for a candidate that cannot be printed.
        """
        cell = self.unit.printed.cell
        return states_along(self._equilibrium(number), self.mesh, self.paths[number], cell, way)

    def alone(self, number: int, pressures_MPa: Array) -> Array:
        """Anchors (s, p, 3) in mm of one candidate along its whole path through pressures (s,), from rest.

        As far as it has an equilibrium; ConvergenceError if at none of them.
        """
        one = self._equilibrium(number)
        start = one.at_zero_pressure()
        return self.points(as_far_as_found(lambda keep: one.path(pressures_MPa, start, keep)))

    def simulated_in_time(self, number: int, time_s: Array, pressure_kPa: Array) -> Array:
        """Anchors (k, p, 3) in mm of one candidate at k instants, each from the one before.

        time_s (k,), pressure_kPa (k,): as `simulate_in_time` takes them. As far as it has an equilibrium;
        ConvergenceError if at none of them.
        """
        one = self._equilibrium(number)
        return self.points(as_far_as_found(lambda keep: simulate_in_time(one, time_s, pressure_kPa, keep)))

    def points(self, states: Sequence[State]) -> Array:
        """Anchors (s, p, 3) in mm moved by some states."""
        return np.array([self.anchors + s.u[self._anchor_nodes] for s in states])

    def of_unit(self, number: int, state: State) -> Array:
        """Displacements (n, 3) in mm of the unit's own nodes in a candidate's state.

        Where the waveguide thickens struts, of their surface without it.
        """
        count = len(self.mesh.nodes)
        mesh = self._equilibrium(number).model.mesh
        found = state.u[:count].copy()
        moved = np.flatnonzero((mesh.nodes[:count] != self.mesh.nodes).any(axis=1))
        if len(moved):
            around = np.isin(mesh.tets, moved).any(axis=1)
            found[moved] = embed(part(mesh, around), self.mesh.nodes[moved]).displacement(state.u)
        return found

    @cached_property
    def _anchor_nodes(self) -> Array:
        return numbers_of(self.mesh, self.anchors)

    def _mesh(self, path: Array) -> Mesh:
        return with_waveguide(self.mesh, bar_of(self.unit, path, self.body), self.unit, self.body)

    def _equilibrium(self, number: int) -> Equilibrium:
        """Of a candidate by number, with the tangent's pattern that it was built with.

        A pattern that earlier states have enlarged would make digits depend on their order.
        """
        if number not in self._last:
            self._last.clear()
            mesh = self._mesh(self.paths[number])
            self._last[number] = Equilibrium(self.model_of(mesh), self.materials_of(mesh), self.settings)
        found = self._last[number]
        found.model.forget_contact()
        return found


def states_along(
    equilibrium: Equilibrium, mesh: Mesh, path: Array, cell: float, way: Sequence[State]
) -> list[State]:
    """States of a unit with a waveguide, see `PrintedWaveguides.states`.

    equilibrium: of its own mesh; mesh: the unit's, path: lattice nodes (h, 3), cell: both in mm.
    """
    for begin in range(len(way) - 1, -1, -1):
        u = way[begin].u
        bent = started(mesh, equilibrium.model.mesh, path, u)
        start = eased(equilibrium, bent, u, EASED_CELLS * cell)
        found = _near(equilibrium, start, way[begin].pressure_MPa)
        if found is not None:
            on = [state.pressure_MPa for state in way[begin + 1 :]]
            with contextlib.suppress(ConvergenceError):
                return [found, *equilibrium.path(on, found)]
    return equilibrium.path([state.pressure_MPa for state in way], equilibrium.at_zero_pressure())


def _near(equilibrium: Equilibrium, start: Array, pressure: float) -> State | None:
    """State at a pressure in MPa near a start (m, 3) in mm, or None if none is found."""
    touch = equilibrium.model.self_contact
    # What has passed through itself can only come back the way it went; and damped motion from where Newton's
    # method fails takes longer than the way from the state before.
    if touch is not None and touch.intersects(start):
        return None
    try:
        return equilibrium.newton(start, pressure)
    except ConvergenceError:
        return None
