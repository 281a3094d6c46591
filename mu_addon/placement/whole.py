"""Model A of the whole body from that of its half: a path off the mirror plane needs both sides."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..fem.equilibrium import State
from ..fem.trajectory import Trajectory
from ..meshing.mesh import AXES, Mesh, mirror

Array = np.ndarray[Any, Any]


def whole_body(mesh: Mesh, trajectory: Trajectory) -> tuple[Mesh, Trajectory]:
    """The mirrored mesh and trajectory: equilibria of the whole body, to rounding, without solving again."""
    for axis in mesh.symmetry:
        off = np.ones(len(mesh.nodes), bool)
        off[mesh.symmetry_nodes(axis)] = False
        sign = np.where(np.arange(3) == AXES.index(axis), -1.0, 1.0)

        def image(state: State, off: Array = off, sign: Array = sign) -> State:
            return attrs.evolve(state, u=np.vstack([state.u, sign * state.u[off]]))

        trajectory = attrs.evolve(trajectory, states=tuple(image(s) for s in trajectory.states))
        mesh = mirror(mesh, axis)
    return mesh, trajectory
