"""Model A of the whole body from that of its half, for paths off the mirror plane."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..fem.trajectory import Trajectory
from ..meshing.mesh import Mesh, mirror, mirror_displacement

Array = np.ndarray[Any, Any]


def whole_body(mesh: Mesh, trajectory: Trajectory) -> tuple[Mesh, Trajectory]:
    """Mesh and trajectory of the whole body, mirrored from those of its half or quarter.

    Nothing is solved again: equilibria stay equilibria, to rounding. A path off the mirror plane needs both
    sides.
    """
    for axis in mesh.symmetry:
        states = [attrs.evolve(s, u=mirror_displacement(mesh, s.u, axis)) for s in trajectory.solved]
        mesh = mirror(mesh, axis)
        trajectory = attrs.evolve(trajectory, solved=tuple(states), mesh=mesh)
    return mesh, trajectory
