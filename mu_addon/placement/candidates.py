"""Algorithm 1 of the paper: simulate each candidate path as a local stiffening and compare backbones."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..fem.equilibrium import Equilibrium
from ..fem.kinematics import Probe
from ..fem.laws import NeoHooke
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.trajectory import Trajectory, simulate
from ..meshing.mesh import LATTICE, Mesh
from .deviation import Deviation, centreline, centreline_deviation
from .inclusion import Inclusion
from .polyline import polyline_inclusion

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Candidate:
    """A path of the waveguide: a name and `points` (h, 3) in mm.

    start: number of its first anchor, counted from 1; 0 for a path through other nodes.
    """

    name: str
    start: int
    points: Array

    @property
    def length(self) -> int:
        """Number of anchors."""
        return len(self.points)


def candidate_paths(anchors: Array, windows: Any) -> list[Candidate]:
    """Candidates of windows (name, start, length) over anchors (n, 3) in mm.

    >>> from mu_addon.design import anchor_points, load_preset, windows
    >>> paths = candidate_paths(anchor_points(load_preset("mu-1.0x")), windows(6))
    >>> paths[0].name, paths[0].points.shape
    ('alpha1', (3, 3))
    """
    return [Candidate(w.name, w.start, anchors[w.start - 1 : w.start - 1 + w.length]) for w in windows]


def roi(mesh: Mesh, candidate: Candidate, radius_mm: float) -> Inclusion:
    """Region of interest of a candidate, whose cylinder has a radius in mm.

    The share of each element of a mesh inside the cylinder, 0 outside the lattice region. Raises InputError
    for a path that bends too sharply for its radius.
    """
    corners, lattice = mesh.nodes[mesh.corners], mesh.region == LATTICE
    return polyline_inclusion(corners, lattice, candidate.points, radius_mm)


def with_sensor(materials: Materials, share: Array, sensor_MPa: float) -> Materials:
    """Materials with a neo-Hookean sensor in a share (m,) of every element.

    sensor_MPa: the sensor's Young's modulus. Poisson's ratio is the element's, so that only Young's modulus
    differs. Raises InputError for a share outside 0 to 1.
    """
    _, poisson = materials.small_strain(len(share))
    return materials.blended(share, NeoHooke, NeoHooke.parameters(sensor_MPa, poisson))


def moved_points(monitored: tuple[Array, Probe], trajectory: Trajectory) -> Array:
    """Positions (k, p, 3) in mm of monitored points at the k instants of a trajectory.

    monitored: the points (p, 3) in mm at rest, and their probe.
    """
    points, monitor = monitored
    return trajectory.of_time(np.array([points + monitor.displacement(s.u) for s in trajectory.solved]))


@attrs.frozen(eq=False)
class Evaluation:
    """A candidate's deviation from Model A."""

    name: str
    deviation: Deviation


def evaluation(name: str, moved: Array, baseline: Array, stations: int) -> Evaluation:
    """Deviation of one candidate's monitored points (k, p, 3) in mm from Model A's at the same k instants.

    moved, baseline: the points with and without the sensor; stations: number of uniform arc lengths compared.
    """
    return Evaluation(name, centreline_deviation(centreline(moved, stations), centreline(baseline, stations)))


def evaluate(
    model: Model,
    materials: Materials,
    baseline: Trajectory,
    monitored: tuple[Array, Probe],
    candidate: Candidate,
    radius_mm: float,
    sensor_MPa: float,
    stations: int,
) -> Evaluation:
    """Deviation of one candidate from Model A, solved along its whole path (the paper's Algorithm 1).

    The reference for `CandidateBatch`, at the cost of one simulation a candidate. model and materials: of
    the unit without a sensor, and baseline its trajectory. monitored: points (p, 3) in mm of the backbone
    and their probe. radius_mm: of the inclusion; sensor_MPa: its Young's modulus; stations: uniform arc
    lengths compared. Raises ConvergenceError.
    """
    stiff = with_sensor(materials, roi(model.mesh, candidate, radius_mm).share, sensor_MPa)
    trajectory = simulate(Equilibrium(model, stiff), baseline.time_s, baseline.pressure_kPa)
    moved, still = (moved_points(monitored, t) for t in (trajectory, baseline))
    return evaluation(candidate.name, moved, still, stations)
