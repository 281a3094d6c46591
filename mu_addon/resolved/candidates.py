"""Units with a printed waveguide, each solved from a state of the unit without one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np

from ..design.anchors import windows
from ..design.parameters import Unit
from ..design.waveguide import Bar
from ..errors import ConvergenceError, InputError
from ..fem.equilibrium import Equilibrium
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.newton_settings import NewtonSettings
from ..fem.state import State
from ..fem.time_stepping import simulate_in_time
from ..meshing.mesh import Mesh
from .waveguide import bar_of, with_waveguide

Array = np.ndarray[Any, Any]

MaterialsOf = Callable[[Mesh], Materials]
ModelOf = Callable[[Mesh], Model]

_UP = np.array([0.0, 0.0, 1.0])


@attrs.frozen(eq=False)
class PrintedWaveguides:
    """The candidates of one unit as printed: how each moves the anchors at a state of the unit without them.

    mesh: of `mesh_printed`; names: of windows of anchors; anchors (p, 3) in mm, nodes of the mesh;
    materials_of and model_of: a mesh's materials and model; settings: of Newton's method. A candidate's model
    is built for each call, since it takes less time than its solution and as much memory as the unit's.
    """

    unit: Unit
    mesh: Mesh
    names: tuple[str, ...]
    anchors: Array
    materials_of: MaterialsOf
    model_of: ModelOf
    settings: NewtonSettings

    def states(self, state: State) -> list[State]:
        """Every candidate's state, on its own mesh, at the pressure of one of Model A's.

        The mesh of a candidate begins with the nodes of the unit's. Raises ConvergenceError, and InputError
        for a candidate that cannot be printed.
        """
        found = []
        for name in self.names:
            bar = self.bar(name)
            equilibrium = self._equilibrium(bar)
            start = self._started(equilibrium.model.mesh, bar, state.u)
            try:
                found.append(equilibrium.newton(start, state.pressure_MPa))
            except ConvergenceError:
                found.append(equilibrium.settled(start, state.pressure_MPa))
        return found

    def alone(self, number: int, pressures_MPa: Array) -> Array:
        """Anchors (s, p, 3) in mm of one candidate along its whole path through pressures (s,), from rest.

        Raises ConvergenceError.
        """
        equilibrium = self._equilibrium(self.bar(self.names[number]))
        return self.points(equilibrium.path(pressures_MPa, equilibrium.at_zero_pressure()))

    def simulated_in_time(self, number: int, time_s: Array, pressure_kPa: Array) -> Array:
        """Anchors (k, p, 3) in mm of one candidate at k instants, each from the one before.

        time_s (k,), pressure_kPa (k,): as `simulate_in_time` takes them. Raises ConvergenceError.
        """
        motion = simulate_in_time(self._equilibrium(self.bar(self.names[number])), time_s, pressure_kPa)
        return motion.of_time(self.points(motion.states))

    def points(self, states: Sequence[State]) -> Array:
        """Anchors (s, p, 3) in mm moved by some states."""
        return np.array([self.anchors + s.u[self._anchor_nodes] for s in states])

    def bar(self, name: str) -> Bar:
        """The waveguide of a candidate; raises InputError."""
        window = next(w for w in windows(self.unit.dimensions.count) if w.name == name)
        return bar_of(self.unit, window)

    @property
    def _anchor_nodes(self) -> Array:
        away = np.linalg.norm(self.mesh.nodes[None] - self.anchors[:, None], axis=2)
        if away.min(axis=1).max() > 1e-6 * self.unit.dimensions.cell:
            raise InputError(
                "an anchor is no node of the lattice's mesh",
                "[waveguide] row",
                "choose a row of cells of the envelope, and a lattice with a node at the cells' centres",
            )
        return np.asarray(away.argmin(axis=1))

    def _equilibrium(self, bar: Bar) -> Equilibrium:
        mesh = with_waveguide(self.mesh, bar)
        return Equilibrium(self.model_of(mesh), self.materials_of(mesh), self.settings, explains=False)

    def _started(self, mesh: Mesh, bar: Bar, u: Array) -> Array:
        """Displacements (m, 3) in mm to begin with: Model A's, the waveguide bent through its anchors."""
        from scipy.interpolate import CubicSpline

        low, high = np.sort(bar.points[[0, -1], 2])
        on = (self.anchors[:, 2] > low) & (self.anchors[:, 2] < high)
        curve = CubicSpline(self.anchors[on, 2], u[self._anchor_nodes[on]])
        own = mesh.nodes[len(u) :]
        along = curve(own[:, 2], 1) + _UP
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        off = own - np.column_stack([np.broadcast_to(bar.points[0, :2], (len(own), 2)), own[:, 2]])
        # The least rotation that turns the z axis into the curve's tangent, for offsets across z.
        lean = (off * along).sum(axis=1, keepdims=True) / (1.0 + along[:, 2:])
        turned = off - lean * (along + _UP)
        moved = curve(own[:, 2]) + turned - off
        moved[own[:, 0] == 0.0, 0] = 0.0
        return mesh.following(np.vstack([u, moved]))
