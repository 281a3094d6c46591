"""Grasps of a gripper in the scene: the job, and its results."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..jobs.start_child import JobKind
from ..shared import timeline
from ..shared.blender_property import exact
from ..shared.file_cache import FileCache
from ..simulate import study_folder as studies
from ..simulate import timings
from ..simulate.study_job import StudyJob
from . import object as gripper_object
from .properties import to_gripper


def folder_of(root: Any) -> Path:
    """Folder of the gripper's results: the one it names, else next to the .blend file, else the user's."""
    props = root.mu_gripper
    return studies.default_folder(props.folder, props.title, props.uuid)


def _given(root: Any) -> dict[str, Any]:
    """Inputs of a grasp that are no properties of their name; raises InputError."""
    props = root.mu_gripper
    return {
        "gripper": to_gripper(props),
        "cubes_mm": (exact(props.cube_mm),),
        "beyond_mm": gripper_object.beyond_mm(root),
        "coarse": props.detail == "quick",
        "solid_only": props.detail == "part",
    }


def _claim(root: Any) -> None:
    if not root.mu_gripper.folder:
        root.mu_gripper.folder = studies.relative(folder_of(root))


GRASP = JobKind(
    "grip",
    lambda root: root.mu_gripper.uuid,
    folder_of,
    "grasp",
    heavy=True,
    prefix="grasp_",
    plan_of=lambda root: GRASPING.plan(root),
)
GRASPING = StudyJob(
    "grip",
    GRASP,
    folder_of,
    _given,
    "mu_gripper",
    {name: name for name in ("density_g_per_ml", "friction", "self_contact")},
    made_of=lambda summary, folder: summary.get("grasps", {}),
    beside=("cubes_mm", "coarse", "refine", "self_contact", "solid_only", "quality"),
    claim=_claim,
)
timings.READERS[GRASP.name] = timings.of_run
_tables: FileCache[Any] = FileCache()


@attrs.frozen(eq=False)
class Grasped:
    """Results of a grasp: figures by name, and why it is not of the present gripper and cube, or "".

    rows: of the grasp at times `time_s` (k,): `phase` (k,) and by name of the CSV's column (k,).
    """

    folder: Path
    stale: str
    figures: dict[str, Any]
    phase: tuple[str, ...]
    columns: dict[str, Any]


def of(root: Any) -> Grasped | None:
    """The latest grasp of the cube that is chosen, or None; read again only when its files change."""
    found, side = GRASPING.found(root), f"{exact(root.mu_gripper.cube_mm):g}"
    if found is None or side not in found.content:
        return None
    path = found.folder / f"grasp_{side}.csv"
    table = _tables.read([path], lambda: _read_table(path))
    figures = found.content[side]
    return None if table is None else Grasped(found.folder / f"cube-{side}", found.stale, figures, *table)


def _read_table(path: Path) -> tuple[tuple[str, ...], dict[str, Any]]:
    """Phase of each row of a grasp's table, and its columns of numbers."""
    with path.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    names = [name for name in rows[0] if name != "phase"]
    columns = {name: np.array([float(row[name]) for row in rows]) for name in names}
    return tuple(row["phase"] for row in rows), columns


def phase_at(found: Grasped, scene: Any) -> tuple[str, float]:
    """Phase of the grasp and force in N of a finger on the cube at the scene's frame."""
    time = found.columns["time_s"]
    now = time[0] + timeline.seconds_at(scene)
    at = min(int(np.searchsorted(time, now - 1e-6)), len(time) - 1)
    return found.phase[at], float(np.interp(now, time, found.columns["normal_N"]))
