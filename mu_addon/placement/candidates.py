"""Algorithm 1 of the paper: simulate each candidate path as a local stiffening and compare backbones."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..fem.equilibrium import Equilibrium
from ..fem.kinematics import Probe
from ..fem.model import Materials, Model
from ..fem.trajectory import Trajectory, simulate_near
from ..meshing.mesh import LATTICE, Mesh
from .deviation import Deviation, centreline, deviation
from .inclusion import Inclusion, inclusion, modulus, stiffened_volume_mm3

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Candidate:
    """A straight run of anchors: `points` (h, 3) in mm from anchor number `start` (from 1)."""

    name: str
    start: int
    points: Array

    @property
    def length(self) -> int:
        """Number of anchors."""
        return len(self.points)


def candidates(anchors: Array, windows: Any) -> list[Candidate]:
    """Candidates of windows (name, start, length) over anchors (n, 3) in mm."""
    return [Candidate(w.name, w.start, anchors[w.start - 1 : w.start - 1 + w.length]) for w in windows]


def roi(mesh: Mesh, candidate: Candidate, radius_mm: float) -> Inclusion:
    """The candidate's region of interest among the lattice elements of a mesh."""
    return inclusion(
        mesh.nodes[mesh.corners],
        mesh.region == LATTICE,
        candidate.points[0],
        candidate.points[-1],
        radius_mm,
    )


def backbone(points: Array, monitor: Probe, trajectory: Trajectory, stations: int) -> Array:
    """Centreline (k, j, 3) in mm through the monitored points (p, 3) of a trajectory."""
    moved = np.array([points + monitor.displacement(state.u) for state in trajectory.states])
    return trajectory.of_time(centreline(moved, stations))


@attrs.frozen(eq=False)
class Evaluation:
    """One candidate under one inclusion rule: its deviation, and the volume in mm3 it stiffened."""

    name: str
    rule: str
    deviation: Deviation
    stiffened_mm3: float
    cylinder_mm3: float


def evaluate(
    model: Model,
    materials: Materials,
    baseline: Trajectory,
    monitored: tuple[Array, Probe],
    candidate: Candidate,
    rule: str,
    radius_mm: float,
    sensor_MPa: float,
    stations: int,
) -> Evaluation:
    """Model alpha of one candidate against Model A: same mesh, same loads, only E(x) differs.

    monitored: the points (p, 3) in mm of the backbone and their probe. Raises ConvergenceError.
    """
    found = roi(model.mesh, candidate, radius_mm)
    stiff = attrs.evolve(materials, modulus_MPa=modulus(rule, found, materials.modulus_MPa, sensor_MPa))
    trajectory = simulate_near(Equilibrium(model, stiff), baseline)
    difference = deviation(
        backbone(*monitored, trajectory, stations), backbone(*monitored, baseline, stations)
    )
    # A mesh of one half holds half of the cylinder and of what it stiffens.
    whole = 2 ** len(model.mesh.symmetry)
    return Evaluation(
        candidate.name,
        rule,
        difference,
        whole * stiffened_volume_mm3(rule, found, model.volumes),
        found.cylinder_volume_mm3,
    )
