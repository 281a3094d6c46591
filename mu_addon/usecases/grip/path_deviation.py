"""The paper's Table I for a finger of the gripper: deviation of each sensor path on a closing finger.

On a cube the finger is stopped, and each path's unit is followed along its own path of equilibria. There is
no friction here: with it a state depends on how it was reached, and the paths' differences, some tenths of a
millimetre, would carry the error of its lagged bound.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from functools import cache
from typing import Any

import attrs
import numpy as np

from ...design.anchors import anchor_points, windows
from ...design.assets import asset_root
from ...design.gripper import Gripper
from ...errors import ConvergenceError
from ...fem.equilibrium import Equilibrium
from ...fem.kinematics import Probe, probe
from ...fem.materials import Materials
from ...fem.model import Model
from ...fem.newton_settings import CONTACT_NEWTON
from ...fem.time_stepping import simulate_in_time
from ...fem.trajectory import Trajectory, simulate
from ...fem.unit_materials import materials_of, self_contact_of
from ...meshing.mesh import Mesh
from ...placement.batch import CandidateBatch
from ...placement.candidates import candidate_paths, evaluation, moved_points, roi, with_sensor
from ...placement.inclusion import sensor_share
from ...placement.settings import PRINTED
from ...resolved.candidates import PrintedWaveguides
from ..simulate_and_place.job import grasp as grasp_protocol
from ..simulate_and_place.job import in_time_newton
from .grasp import Cube, Grip, obstacle_of

Array = np.ndarray[Any, Any]

TABLE = "paper/table1_deviation_mm.csv"
# Samples of the protocol and stations of the backbone, as `place` has them.
TIMES, STATIONS = 13, 51


@attrs.frozen(eq=False)
class PathDeviations:
    """J_hat in mm by path, under one inclusion rule; cube: the one that the finger closed on, or None."""

    rule: str
    cube: Cube | None
    J_hat_mm: dict[str, float]

    @property
    def chosen(self) -> str:
        """Path that disturbs least."""
        return min(self.J_hat_mm, key=lambda name: self.J_hat_mm[name])

    def rank_correlation(self, other: dict[str, float]) -> float:
        """Spearman's correlation with another J by path, over the paths in both; nan for fewer than three."""
        from scipy.stats import spearmanr

        both = [name for name in self.J_hat_mm if name in other]
        if len(both) < 3:
            return float("nan")
        return float(spearmanr([self.J_hat_mm[n] for n in both], [other[n] for n in both]).statistic)


@cache
def published_deviations(name: str = "gripper") -> dict[str, float]:
    """A column of the paper's Table I in mm by path: "gripper", "scale_0.75", "scale_1.00", "scale_1.50"."""
    lines = (asset_root() / TABLE).read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in lines if not line.startswith("#"))
    return {row["path"]: float(row[name]) for row in rows}


def path_deviations(
    gripper: Gripper,
    mesh: Mesh,
    materials: Materials,
    rule: str,
    cube: Cube | None,
    grip: Grip | None = None,
    threads: int = 1,
    self_contact: bool = False,
    load: Callable[[str], Array | None] = lambda name: None,
    store: Callable[[str, Array], None] = lambda name, moved: None,
    on_path: Callable[[float, str], None] = lambda share, name: None,
) -> PathDeviations:
    """J_hat of every window's path against the finger without a sensor, through the grasp protocol.

    mesh: homogenised, or resolved with the rule PRINTED, whose candidates are the waveguides as printed.
    `load` gives the monitored points (k, p, 3) in mm of a path's unit ("model_a" for none) that an earlier
    run kept with `store`. Raises ConvergenceError where a unit has no equilibrium.
    """
    unit, grip = gripper.unit, attrs.evolve(grip or Grip(), friction=0.0)
    points = anchor_points(unit)
    radius = unit.dimensions.inclusion_radius
    every = candidate_paths(points, windows(len(points)))
    names = ["model_a", *(c.name for c in every)]
    known = {name: moved for name in names if (moved := load(name)) is not None}

    def model_of(own: Mesh) -> Model:
        model = Model(own, threads=threads)
        if cube is not None:
            model.obstacles = (obstacle_of(gripper, cube, grip, own),)
        if self_contact:
            model.self_contact = self_contact_of(unit, own)
        return model

    def solved(name: str, moved: Array) -> Array:
        known[name] = moved
        store(name, moved)
        return moved

    if rule == PRINTED:
        alone = _printed(gripper, mesh, materials, points, model_of, self_contact)
    else:
        monitored = (points, probe(mesh, points))
        sensor = unit.material.sensor_modulus_MPa
        shares = {c.name: sensor_share(rule, roi(mesh, c, radius)) for c in every}
        model = model_of(mesh)
        if cube is None and len(known) < len(names):
            base = simulate(Equilibrium(model, materials), *_samples())
            solved("model_a", moved_points(monitored, base))
            for name, moved in _together(model, materials, monitored, base, shares, sensor).items():
                solved(name, moved)
        alone = _stiffened(model, materials, monitored, shares, sensor)

    def moved_of(name: str) -> Array:
        return known[name] if name in known else solved(name, alone(name))

    still = moved_of("model_a")
    on_path(1.0 / len(names), "no sensor")
    J = {}
    for number, candidate in enumerate(every, 2):
        moved = moved_of(candidate.name)
        found = evaluation(mesh, candidate, rule, radius, moved, still, STATIONS)
        J[candidate.name] = found.deviation.J_hat
        on_path(number / len(names), candidate.name)
    return PathDeviations(rule, cube, J)


def _samples() -> tuple[Array, Array]:
    return grasp_protocol().sample(TIMES)


def _stiffened(
    model: Model,
    materials: Materials,
    monitored: tuple[Array, Probe],
    shares: dict[str, Array],
    sensor_MPa: float,
) -> Callable[[str], Array]:
    """The monitored points (k, p, 3) in mm of one unit, by name, along its own path of equilibria."""

    def alone(name: str) -> Array:
        own = materials if name == "model_a" else with_sensor(materials, shares[name], sensor_MPa)
        settings = CONTACT_NEWTON if model.obstacles else None
        return moved_points(monitored, simulate(Equilibrium(model, own, settings), *_samples()))

    return alone


def _printed(
    gripper: Gripper,
    mesh: Mesh,
    materials: Materials,
    points: Array,
    model_of: Callable[[Mesh], Model],
    self_contact: bool,
) -> Callable[[str], Array]:
    """Monitored points of units with printed waveguides, instant by instant, since struts may snap."""
    unit = gripper.unit
    newton = in_time_newton(True, self_contact)
    every = windows(len(points))
    names = [w.name for w in every]
    paths = tuple(points[list(w.indices)] for w in every)
    units = PrintedWaveguides(
        unit, mesh, paths, points, lambda own: materials_of(unit, own), model_of, newton
    )

    def alone(name: str) -> Array:
        if name != "model_a":
            moved = units.simulated_in_time(names.index(name), *_samples())
            if len(moved) < TIMES:
                kPa = _samples()[1][len(moved)]
                raise ConvergenceError(f"no equilibrium with waveguide {name} at {kPa:.4g} kPa")
            return moved
        base = Equilibrium(model_of(mesh), materials, newton, explains=False)
        return units.points(simulate_in_time(base, *_samples()).states)

    return alone


def _together(
    model: Model,
    materials: Materials,
    monitored: tuple[Array, Probe],
    base: Trajectory,
    shares: dict[str, Array],
    sensor_MPa: float,
) -> dict[str, Array]:
    """Monitored points (k, p, 3) in mm of every path's unit, from Model A's states and on one factor."""
    points, _ = monitored
    batch = CandidateBatch(model, materials, monitored, list(shares.values()), sensor_MPa)
    at_rest = np.broadcast_to(points, (len(shares), *points.shape))
    moved = np.array([batch.at(s) if s.pressure_MPa else at_rest for s in base.solved])
    return {name: base.of_time(moved[:, i]) for i, name in enumerate(shares)}
