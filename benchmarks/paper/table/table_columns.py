"""The paper's three units on this program's mesh: table, motion, and how far a coarser mesh moves both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from mu_addon.design.anchors import anchor_points
from mu_addon.design.parameters import Unit
from mu_addon.errors import ConvergenceError
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.deviation import Deviation, deviation_of
from mu_addon.run.cache import Cache, key

from ..inclusion_rules import RULES
from .table_column import SOLVED_KPA, STATIONS, motion, paths, with_fixed_base

Array = np.ndarray[Any, Any]

# The angle is found at these pressures in kPa, the paper's range.
BENDING_KPA = (-20.0, -15.0, -10.0, -5.0, 0.0, 10.0, 20.0, 30.0, 40.0, 50.0)
# A coarser twin of the mesh, to tell how far the mesh moves a table.
COARSER = 0.7


@attrs.frozen
class Task:
    """One unit on one mesh, a protocol's samples in kPa, and up to which height in cells it is held fast."""

    unit: Unit
    mesh: MeshSettings
    samples_kPa: tuple[float, ...]
    held_cells: float = 0.0

    @property
    def key(self) -> str:
        """Hash of the inputs."""
        how = self.held_cells, BENDING_KPA, SOLVED_KPA, STATIONS
        return key(self.unit.hash(), attrs.astuple(self.mesh), self.samples_kPa, how)


@attrs.frozen(eq=False)
class Solved:
    """What one unit gave: delta (rules, paths, k, j) in mm, pressure and angle (b,).

    crossing_kPa (2,): the first vacuum and pressure at which walls pass through each other, nan where none
    do; volume_ratio (rules, paths), what a rule stiffens over the sensor's own volume; stopped says why the
    angle ends early, as nan.
    """

    pressure_kPa: Array
    angle_deg: Array
    crossing_kPa: Array
    delta: Array
    volume_ratio: Array
    stopped: str = ""

    def deviations(self, rule: str) -> list[Deviation]:
        """Deviation of every path by a rule."""
        return [deviation_of(delta) for delta in self.delta[RULES.index(rule)]]

    def J_hat(self, rule: str) -> Array:
        """J_hat (paths,) in mm by a rule."""
        return np.asarray(self.delta[RULES.index(rule)].mean(axis=(1, 2)))


def solved(task: Task, cache: Cache) -> Solved:
    """A task from the cache, or solved and put there. Raises MeshingError and ConvergenceError."""
    names = [f.name for f in attrs.fields(Solved)]
    kept = cache.get("column", task.key)
    if kept is not None and set(kept) == set(names):
        return Solved(**{n: kept[n] for n in names[:-1]}, stopped=str(kept["stopped"]))
    found = _solve(task)
    cache.put("column", task.key, attrs.asdict(found, recurse=False) | {"stopped": np.array(found.stopped)})
    return found


def _solve(task: Task) -> Solved:
    mesh = with_fixed_base(mesh_unit(task.unit, task.mesh), task.held_cells * task.unit.dimensions.cell)
    stopped = ""
    try:
        moved = motion(task.unit, mesh, BENDING_KPA)
    except ConvergenceError as error:
        # The protocol of the table may still be reached where the range of bending is not.
        stopped = error.what
        moved = motion(task.unit, mesh, [p for p in BENDING_KPA if min(SOLVED_KPA) <= p <= max(SOLVED_KPA)])
    found = paths(task.unit, mesh, moved)
    at_rest, samples = anchor_points(task.unit), np.array(task.samples_kPa)
    delta = [[d.delta for d in found.deviations(rule, at_rest, samples)] for rule in RULES]
    angle = [moved.angle_at(p) if p in moved.pressure_kPa else np.nan for p in BENDING_KPA]
    sides = [[p for p in moved.crossing_kPa if p * sign > 0] for sign in (-1, 1)]
    crossing = [min(side, key=abs) if side else np.nan for side in sides]
    return Solved(
        np.array(BENDING_KPA),
        np.array(angle),
        np.array(crossing),
        np.array(delta),
        found.volume_ratio,
        stopped,
    )


@attrs.frozen(eq=False)
class TableColumn:
    """One column of our table: the unit on its mesh, and on a coarser one."""

    name: str
    scale: float
    fine: Solved
    coarse: Solved

    def angle_uncertainty_deg(self) -> float:
        """How far the coarser mesh moves the angle at most, in degrees; nan where neither reaches an end."""
        apart = np.abs(self.fine.angle_deg - self.coarse.angle_deg)
        return float(np.nanmax(apart)) if np.isfinite(apart).any() else float("nan")


def tasks(
    units: Sequence[Unit], mesh: MeshSettings, samples_kPa: Array, held_cells: float = 0.0
) -> list[Task]:
    """Two tasks a unit: on a mesh, and on its coarser twin."""
    rough = attrs.evolve(mesh, refine=mesh.refine * COARSER)
    samples = tuple(float(p) for p in samples_kPa)
    return [Task(unit, settings, samples, held_cells) for unit in units for settings in (mesh, rough)]
