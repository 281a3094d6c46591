"""Grasps of a gripper in the scene: the job, and its results."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...design import gripper as core
from ...design.parameters import to_toml
from ...errors import MuError
from ...reading import file_bytes, file_text, parse_json, parse_toml
from ...run.folder import write_run
from ...run.progress_estimate import Plan
from ...usecases.grip.expected import GRASP_OF, expected_plan, stage_of
from ...usecases.grip.settings import COARSE_REFINE, COARSE_STEP_S, REFINE, STEP_S
from ..jobs.start_child import JobKind
from ..shared.blender_property import exact
from ..shared.file_cache import FileCache
from ..simulate import study_folder as studies
from ..simulate import timings
from . import object as gripper_object
from .properties import to_gripper

if TYPE_CHECKING:
    from ...usecases.grip.job import Job


def folder_of(root: Any) -> Path:
    """Folder of the gripper's results: the one it names, else next to the .blend file, else the user's."""
    props = root.mu_gripper
    return studies.default_folder(props.folder, props.title, props.uuid)


def plan_of(root: Any) -> Plan:
    """Expected stages of the gripper's job, with the seconds of each."""
    return _expected(root)[0]


def announced(root: Any) -> tuple[float, bool]:
    """Expected seconds of the gripper's job, and True if its grasp was measured on this machine."""
    plan, known = _expected(root)
    return sum(seconds for _, seconds in plan), known


def _expected(root: Any) -> tuple[Plan, bool]:
    """The plan, and True if measured: a grasp of such detail, of this cube if there was one, else of any."""
    props = root.mu_gripper
    sides = [_side(props)] if props.detail != "part" else []
    coarse = props.detail == "quick"
    refine, step_s = (COARSE_REFINE, COARSE_STEP_S) if coarse else (REFINE.default, STEP_S)
    taken = timings.measured(_detail(refine, step_s, props.self_contact))
    grasped = [seconds for name, seconds in taken.items() if name.startswith(GRASP_OF)]
    if grasped:
        taken = {**{stage_of(side): grasped[-1] for side in sides}, **taken}
    plan = [(name, taken.get(name, s)) for name, s in expected_plan(sides, refine, step_s)]
    return plan, "solid" in taken and (not sides or bool(grasped))


def _detail(refine: float, step_s: float, self_contact: bool) -> str:
    return f"grasp {refine:g} {step_s:g}{' apart' * self_contact}"


def _timed(folder: Path) -> tuple[str, dict[str, Any]]:
    """Detail of a finished grasp, and the seconds of its stages."""
    asked = parse_toml(file_text(folder / "grip.toml"), "grip.toml")
    summary = parse_json(file_bytes(folder / "summary.json"), "summary.json")
    detail = _detail(asked["mesh"]["refine"], asked["grip"]["step_s"], asked.get("self_contact", False))
    return detail, summary["seconds"]


GRASP = JobKind("grip", lambda root: root.mu_gripper.uuid, folder_of, "grasp", heavy=True, plan_of=plan_of)
timings.READERS[GRASP.name] = _timed


def job_of(root: Any) -> Job:
    """Grasp job from a gripper's properties; raises InputError."""
    # Imported late: they need the solver's packages, which a Blender may lack.
    from ...usecases.grip.job import Job, detailed
    from ...usecases.grip.settings import Cube, Grip

    props = root.mu_gripper
    grasps = props.detail != "part"
    detail = detailed(props.detail == "quick")
    grip = detail.grip(friction=exact(props.friction), beyond_mm=gripper_object.beyond_mm(root))
    return Job(
        gripper=to_gripper(props),
        cubes=(Cube(_side(props), exact(props.density_g_per_ml)),) if grasps else (),
        grip=grip if grasps else Grip(),
        mesh=detail.mesh,
        self_contact=props.self_contact,
    )


def write_inputs(root: Any, folder: Path) -> None:
    """Write the inputs of the gripper's job into its folder; raises InputError and OutputError."""
    job = job_of(root)
    from ...usecases.grip.job import LAYOUT

    write_run(folder, LAYOUT, job.texts())


def _side(props: Any) -> float:
    return exact(props.cube_mm)


@attrs.frozen(eq=False)
class Grasped:
    """Results of a grasp: figures by name, and True if the gripper or the cube were changed since.

    rows: of the grasp at times `time_s` (k,): `phase` (k,) and by name of the CSV's column (k,).
    """

    folder: Path
    stale: bool
    figures: dict[str, Any]
    phase: tuple[str, ...]
    columns: dict[str, Any]


_runs: FileCache[Any] = FileCache()


def of(root: Any) -> Grasped | None:
    """The latest grasp of the cube that is chosen, or None; read again only when its files change."""
    folder, props = folder_of(root), root.mu_gripper
    side = f"{_side(props):g}"
    known = _runs.read([folder / "summary.json"], lambda: _read_folder(folder))
    if known is None or side not in known[3]:
        return None
    figures, asked, texts, tables = known
    try:
        gripper = to_gripper(props)
        now = core.to_toml(gripper, "unit.toml"), to_toml(gripper.unit)
        densities = {c["side_mm"]: c["density_g_per_ml"] for c in asked["cubes"]}
        own = densities.get(_side(props)), asked["grip"]["friction"], asked["grip"]["beyond_mm"]
        set_now = exact(props.density_g_per_ml), exact(props.friction), gripper_object.beyond_mm(root)
        stale = now != texts or own != set_now
    except (KeyError, MuError):
        return None
    return Grasped(folder / f"cube-{side}", stale, figures.get(side, {}), *tables[side])


def _read_folder(folder: Path) -> Any:
    summary = parse_json(file_bytes(folder / "summary.json"), "summary.json")
    asked = parse_toml(file_text(folder / "grip.toml"), "grip.toml")
    texts = tuple(file_text(folder / name) for name in ("gripper.toml", "unit.toml"))
    tables = {}
    for cube in asked["cubes"]:
        side = f"{cube['side_mm']:g}"
        path = folder / f"grasp_{side}.csv"
        if path.is_file():
            with path.open(encoding="utf-8", newline="") as stream:
                rows = list(csv.DictReader(stream))
            names = [name for name in rows[0] if name != "phase"]
            columns = {name: np.array([float(row[name]) for row in rows]) for name in names}
            tables[side] = tuple(row["phase"] for row in rows), columns
    return summary.get("grasps", {}), asked, texts, tables


def phase_at(found: Grasped, scene: Any) -> tuple[str, float]:
    """Phase of the grasp and force in N of a finger on the cube at the scene's frame."""
    rate = scene.render.fps / scene.render.fps_base
    time = found.columns["time_s"]
    now = time[0] + (scene.frame_current_final - scene.frame_start) / rate
    at = min(int(np.searchsorted(time, now - 1e-6)), len(time) - 1)
    return found.phase[at], float(np.interp(now, time, found.columns["normal_N"]))
