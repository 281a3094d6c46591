"""Folders of a unit's runs, the shown run, and its comparison with the present design."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np

from ...errors import MuError
from ...meshing.settings import REFINE
from ...studies import unit_runs
from ...studies.unit_runs import Run
from ..obstacles import state as obstacles
from ..shared.compat import user_folder
from ..shared.file_cache import FileCache
from ..unit import envelope
from ..unit.properties import to_unit
from . import effects

CONTACT = "contact.csv"


# Of mu-1.0x at a refinement of 0.5 (docs/engineering/verification.md).
COARSE = "coarse mesh ({:g}): angles up to 12 % too small under vacuum, 2 % under pressure"


@attrs.frozen
class Findings:
    """Results of the shown run; `stale` if the unit was changed since it was computed."""

    run: Run
    stale: bool

    @property
    def summary(self) -> dict[str, Any]:
        """Content of its summary.json."""
        return self.run.summary

    @property
    def caveat(self) -> str:
        """Known error of the run's model, or what it leaves out, as text; empty on the default mesh."""
        if self.run.left_out:
            return f"quick ranking, {self.run.left_out}: deviations are larger with suction"
        return COARSE.format(self.run.refine) if self.run.refine < REFINE.default else ""

    @property
    def angles(self) -> list[tuple[float, float]]:
        """Pairs (pressure in kPa, bending angle in degrees) by pressure."""
        return self.run.angles

    @property
    def ranking(self) -> list[tuple[str, float]]:
        """Pairs (path, J_hat in mm), the best first."""
        return self.run.ranking


@attrs.frozen(eq=False)
class ContactForce:
    """Force (k,) in N of a study's unit on one obstacle at times (k,) in s, with friction."""

    name: str
    time_s: Any
    force_N: Any


def folder_of(root: Any) -> Path:
    """The unit's folder, with its runs and all other results.

    The one that it names, else one next to the .blend file, else one in the user's folder.
    """
    props = root.mu_unit
    return default_folder(props.study.folder, props.title, props.uuid)


def default_folder(named: str, title: str, uuid: str) -> Path:
    """The named folder, else one for a title next to the .blend file, else in the user's folder."""
    if named:
        return Path(bpy.path.abspath(named))
    name = f"{re.sub(r'[^A-Za-z0-9._-]+', '-', title).strip('-.') or 'unit'}-{uuid[:8]}"
    if bpy.data.filepath:
        return beside(Path(bpy.data.filepath), name)
    return user_folder("studies") / name


def beside(blend: Path, name: str) -> Path:
    """Folder of a unit, by its name, next to a .blend file."""
    return blend.with_name(f"{blend.stem}.mu") / name


def assign_folder(root: Any) -> Path:
    """Store the unit's folder with the unit, relative to the .blend file if possible, and return it."""
    folder = folder_of(root)
    if not root.mu_unit.study.folder:
        root.mu_unit.study.folder = relative(folder)
    return folder


_runs: FileCache[Run] = FileCache()
_forces: FileCache[list[ContactForce]] = FileCache()


def runs_of(root: Any) -> list[Run]:
    """Every run of the unit, the latest first; each is read again only when its files change."""
    found = (
        _runs.read(unit_runs.files_of(folder), lambda folder=folder: unit_runs.read_run(folder))
        for folder in unit_runs.folders(folder_of(root))
    )
    return unit_runs.ordered(run for run in found if run is not None)


def run_by_key(root: Any, key: str) -> Run | None:
    """The unit's run of that key, or None if it no longer exists."""
    return next((run for run in runs_of(root) if run.key == key), None)


def design_of(root: Any) -> str:
    """Hash of the design that the unit's simulation would have (`unit_runs.design_key`); "" if invalid."""
    try:
        unit = to_unit(root.mu_unit)
        body = envelope.envelope_in(root, unit)
        own = "" if body is None else body.hash
        return unit_runs.design_key(unit, own, obstacles.inputs(root), effects.inputs(root))
    except MuError:
        return ""


def shown_run(root: Any) -> Run | None:
    """The run whose results are shown: the chosen one, else the best one of the unit's present design.

    A choice holds until the unit changes. If no run is of the present design, it is the run that was shown
    last, which is then stale.
    """
    return _shown(root, runs_of(root), design_of(root))


def _shown(root: Any, found: list[Run], design: str) -> Run | None:
    study = root.mu_unit.study
    last = next((run for run in found if run.key == study.run), None)
    if last is not None and study.run_design == design:
        return last
    ready = any(run.design == design and run.has_results for run in found)
    if last is not None and last.has_results and not ready:
        return last
    return unit_runs.best_of(found, design)


def choose(root: Any, run: Run) -> None:
    """Show the results of a run, until the unit changes."""
    study = root.mu_unit.study
    study.run, study.run_design = run.key, design_of(root)


def remember(root: Any) -> None:
    """Store the shown run, so that it stays while the unit has no run."""
    run, study = shown_run(root), root.mu_unit.study
    if run is not None and study.run != run.key:
        study.run, study.run_design = run.key, ""


def results_folder(root: Any) -> Path:
    """Folder of the shown run; without one, the folder for the runs."""
    run = shown_run(root)
    return folder_of(root) if run is None else run.folder


def findings(root: Any) -> Findings | None:
    """Results of the shown run, or None if nothing was simulated yet."""
    design = design_of(root)
    run = _shown(root, runs_of(root), design)
    return Findings(run, run.design != design) if run is not None and run.summary else None


def contact_forces(root: Any) -> list[ContactForce]:
    """Force of the study's unit on every obstacle; empty without one."""
    path = results_folder(root) / CONTACT
    return _forces.read([path], lambda: _read_forces(path)) or []


def _read_forces(path: Path) -> list[ContactForce]:
    with path.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    found: dict[str, list[tuple[float, float]]] = {}
    for row in rows:
        force = np.linalg.norm([float(row[f"force_{axis}_N"]) for axis in "xyz"])
        found.setdefault(Path(row["obstacle"]).stem, []).append((float(row["time_s"]), float(force)))
    return [ContactForce(name, *np.array(values).T) for name, values in found.items()]


def relative(path: Path) -> str:
    """A path for Blender: relative to the .blend file if there is one on the same drive."""
    if not bpy.data.filepath:
        return str(path)
    try:
        return bpy.path.relpath(str(path))
    except ValueError:
        return str(path)
