"""The paper's fourth column: a finger of the gripper, closing freely and on each of the cubes.

The paper does not say on what its simulated finger closes. On a cube the finger is stopped, and each path's
unit is followed along its own path of equilibria. There is no friction here: with it a state depends on how
it was reached, and the paths' differences, some tenths of a millimetre, would carry the error of its lagged
bound.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.gripper import Gripper, load_gripper
from mu_addon.errors import ConvergenceError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import CONTACT_NEWTON
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import Mesh
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.batch import CandidateBatch
from mu_addon.placement.candidates import candidate_paths, evaluation, moved_points, roi, with_sensor
from mu_addon.run.cache import Cache, key
from mu_addon.usecases.grip.grasp import obstacle_of
from mu_addon.usecases.grip.settings import SIDES, Cube, Grip
from mu_addon.usecases.simulate_and_place.job import grasp

from ..inclusion_rules import RULES, sensor_share
from .published import GRIPPER
from .values import RULE, with_values

Array = np.ndarray[Any, Any]

# Contact makes every path's own equilibria necessary: a finer mesh would take longer than all the rest.
REFINE = 0.5
# Samples of the protocol and stations of the backbone, as `place` has them.
TIMES, STATIONS = 13, 51


@attrs.frozen
class Task:
    """A column by one rule: values of the set, side of the cube in mm or 0 for none, refinement, paths."""

    values: Mapping[str, Any]
    rule: str
    cube_mm: float
    refine: float
    paths: tuple[str, ...]

    @property
    def name(self) -> str:
        """The column's."""
        return f"{GRIPPER}, {self.cube_mm:g} mm" if self.cube_mm else GRIPPER


def solved(task: Task, cache: Cache) -> Array | str:
    """J_hat (paths,) in mm from the cache, or solved and put there; or why there is none."""
    gripper = load_gripper("gripper")
    gripper = attrs.evolve(gripper, unit=with_values(gripper.unit, task.values))
    name = key(gripper.unit.hash(), attrs.astuple(gripper.fingers), attrs.astuple(task)[1:])
    kept = cache.get("gripper", name)
    if kept is not None:
        return str(kept["failed"]) if "failed" in kept else kept["J_hat"]
    cube = Cube(task.cube_mm) if task.cube_mm else None
    try:
        mesh = mesh_unit(gripper.unit, MeshSettings(refine=task.refine))
        found = deviations(gripper, mesh, task.rule, cube)
    except ConvergenceError as error:
        cache.put("gripper", name, {"failed": np.array(error.what)})
        return error.what
    J_hat = np.array([found[path] for path in task.paths])
    cache.put("gripper", name, {"J_hat": J_hat})
    return J_hat


def deviations(gripper: Gripper, mesh: Mesh, rule: str, cube: Cube | None) -> dict[str, float]:
    """J_hat in mm of every path against the finger without a sensor, on a cube or on nothing, by path.

    mesh: homogenised. Raises ConvergenceError where a unit has no equilibrium.
    """
    unit, materials = gripper.unit, materials_of(gripper.unit, mesh)
    points = anchor_points(unit)
    every = candidate_paths(points, windows(len(points)))
    shares = [sensor_share(rule, roi(mesh, one, unit.dimensions.inclusion_radius)) for one in every]
    monitored, samples = (points, probe(mesh, points)), grasp().sample(TIMES)
    sensor = unit.material.sensor_modulus_MPa
    model = Model(mesh, threads=1)
    if cube is not None:
        model.obstacles = (obstacle_of(gripper, cube, Grip(friction=0.0), mesh),)
    settings = CONTACT_NEWTON if model.obstacles else None
    base = simulate(Equilibrium(model, materials, settings), *samples)
    still = moved_points(monitored, base)
    if cube is None:
        # From Model A's states, on one factorisation.
        batch = CandidateBatch(model, materials, monitored, shares, sensor)
        at_rest = np.broadcast_to(points, (len(shares), *points.shape))
        solved = np.array([batch.at(s) if s.pressure_MPa else at_rest for s in base.solved])
        moved = [base.of_time(solved[:, i]) for i in range(len(every))]
    else:
        bodies = (Equilibrium(model, with_sensor(materials, share, sensor), settings) for share in shares)
        moved = [moved_points(monitored, simulate(body, *samples)) for body in bodies]
    return {
        one.name: evaluation(one.name, own, still, STATIONS).deviation.J_hat
        for one, own in zip(every, moved, strict=True)
    }


def tasks(values: Mapping[str, Any], paths: Sequence[str], refine: float) -> list[Task]:
    """On nothing by both rules, on each cube by the one that decides."""
    columns = [(rule, 0.0) for rule in RULES] + [(RULE, side) for side in SIDES]
    return [Task(values, rule, side, refine, tuple(paths)) for rule, side in columns]
