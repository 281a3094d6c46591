"""The paper's fourth column: a finger of the gripper, closing freely and on each of the cubes.

The paper does not say on what its simulated finger closes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from mu_addon.design.gripper import load_gripper
from mu_addon.errors import ConvergenceError
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.inclusion import RULES
from mu_addon.run.cache import Cache, key
from mu_addon.usecases.grip.grasp import Cube
from mu_addon.usecases.grip.path_deviation import path_deviations
from mu_addon.usecases.grip.settings import SIDES

from .published import GRIPPER
from .values import RULE, with_values

Array = np.ndarray[Any, Any]

# Contact makes every path's own equilibria necessary: a finer mesh would take longer than all the rest.
REFINE = 0.5


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
        found = path_deviations(gripper, mesh, materials_of(gripper.unit, mesh), task.rule, cube).J_hat_mm
    except ConvergenceError as error:
        cache.put("gripper", name, {"failed": np.array(error.what)})
        return error.what
    J_hat = np.array([found[path] for path in task.paths])
    cache.put("gripper", name, {"J_hat": J_hat})
    return J_hat


def tasks(values: Mapping[str, Any], paths: Sequence[str], refine: float) -> list[Task]:
    """On nothing by both rules, on each cube by the one that decides."""
    columns = [(rule, 0.0) for rule in RULES] + [(RULE, side) for side in SIDES]
    return [Task(values, rule, side, refine, tuple(paths)) for rule, side in columns]
