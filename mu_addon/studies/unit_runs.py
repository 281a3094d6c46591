"""The runs of one unit: every study of it, each in a separate folder.

A unit has a home folder. Its runs are in `runs/` there, each named by the hash of its inputs: the same inputs
find the same folder, and other inputs never change it. A study in the home folder itself, as a command
writes it, and its predecessor in `stale/` are listed with the others. A run's name and star are in its
folder's `label.toml`.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import uuid
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs

from ..design.body import MOST_BYTES
from ..design.parameters import Unit, read_unit
from ..design.rigid_body import read_rigid_bodies
from ..errors import InputError, MuError
from ..files import make_folder, output_error, write_text
from ..meshing.settings import REFINE
from ..reading import file_bytes, file_text, parse_json, parse_toml
from ..run.cache import key
from ..run.folder import ALWAYS, OWN
from ..run.lock import LOCK, FolderLock, holder
from ..simulate_and_place.settings import STAGES, left_out
from ..toml_writer import toml_text
from .parameter_study.results import angles_of

if TYPE_CHECKING:
    from .unit_ranking import UnitStudy

Tables = dict[str, dict[str, Any]]
NAME = "study.toml"
BODY, OBSTACLES = "body.obj", "obstacles.obj"

RUNS, LABEL = "runs", "label.toml"
HOME, STALE = "home", "stale"
"""Keys of the runs of a command: in the home folder itself, and the one set aside by its next."""
SUMMARY, OUTPUTS = "summary.json", "blender"
"""File of a run's results, and of the output of a process that Blender started."""
EFFECTS = ("orientation_deg", "effects")
"""Keys of study.toml's table of the simulation for effects named by measured data."""
LONGEST_NAME = 80
_REMOVED = ".removed-"
_UNREADABLE = (OSError, ValueError, KeyError, TypeError, AttributeError, MuError)
"""Errors that an incomplete folder, or one without a run, may raise."""


@attrs.frozen(eq=False)
class Run:
    """One run: its inputs, its results so far, and its label by the user.

    design: hash of the simulated design, see `design_key`; summary: its summary.json, empty before it has
    one; changed_s: when it last wrote that, in seconds since 1970.
    """

    folder: Path
    tables: Tables
    unit: Unit
    design: str
    summary: dict[str, Any]
    changed_s: float
    name: str = ""
    starred: bool = False

    @property
    def key(self) -> str:
        """Key of a run: the name of its folder in `runs/`, else `HOME` or `STALE`."""
        if self.folder.parent.name == RUNS:
            return self.folder.name
        return STALE if self.folder.name == STALE else HOME

    @property
    def complete(self) -> bool:
        """True if the run is complete."""
        return self.summary.get("status") == "complete"

    @property
    def state(self) -> str:
        """Status of the run and its results: "cancelled; motion complete", for example."""
        status = str(self.summary.get("status") or "not run")
        reason = self.summary.get("reason") or {}
        if status == "complete" or not self.summary:
            return status
        if status == "running" and holder(self.folder) is None:
            status = "interrupted"
        if status == "partial":
            what = str(reason.get("what", ""))
            status = "cancelled" if what.startswith("stopped by") else f"stopped: {what}" if what else status
        return f"{status}; {self.found}"

    @property
    def found(self) -> str:
        """Progress of the run, as text."""
        if "chosen" in self.summary:
            return "ranking complete"
        # The figures of the solver come with the last state.
        if "solver" in self.summary:
            return "motion complete"
        if self.angles:
            farthest = max((p for p, _ in self.angles), key=abs)
            return f"motion up to {farthest:g} kPa"
        return "no motion yet"

    @property
    def has_results(self) -> bool:
        """True if there are results to show: it is complete, or its motion is found."""
        return self.complete or bool(self.angles)

    @property
    def _mesh(self) -> dict[str, Any]:
        return self.tables.get("simulate", {}).get("mesh") or {}

    @property
    def refine(self) -> float:
        """Refinement of the mesh: every element size is divided by it."""
        return float(self._mesh.get("refine", REFINE.default))

    @property
    def job(self) -> str:
        """The last stage asked for: `design`, `simulate` or `place`."""
        return [stage for stage in STAGES if stage in self.tables][-1]

    @property
    def title(self) -> str:
        """The user's name of the run, else a description."""
        what = {"design": "Design", "simulate": "Motion", "place": "Ranking"}[self.job]
        if self.tables.get("place", {}).get("paths") == "graph":
            what += ", lattice"
        if self.left_out:
            what = f"Quick {what.lower()}"
        return self.name or what

    @property
    def left_out(self) -> str:
        """What a quick ranking leaves out, as text; empty for another run."""
        return left_out(self.tables)

    @property
    def seconds(self) -> float:
        """Total time of its stages in s."""
        found = self.summary.get("seconds")
        return sum(map(float, found.values())) if isinstance(found, dict) else 0.0

    @property
    def angles(self) -> list[tuple[float, float]]:
        """Pairs (pressure in kPa, bending angle in degrees) by pressure."""
        return [*angles_of(self.summary).items()]

    @property
    def ranking(self) -> list[tuple[str, float]]:
        """Pairs (path, J_hat in mm), the best first; empty where no paths were ranked."""
        found = self.summary.get("J_hat_mm") or {}
        return sorted(((name, float(j)) for name, j in found.items()), key=lambda pair: pair[1])

    @property
    def estimated_mm(self) -> dict[str, float]:
        """Estimate of J_hat in mm by path, the best first, of a run that ranked none yet."""
        found = {} if self.ranking else self.summary.get("J_hat_estimated_mm") or {}
        return {name: float(value) for name, value in sorted(found.items(), key=lambda one: one[1])}

    @property
    def at_least_mm(self) -> dict[str, float]:
        """Lower bound of J_hat in mm of each path that was not solved further."""
        found = self.summary.get("J_hat_at_least_mm") or {}
        return {name: float(bound) for name, bound in found.items()}


def _kind() -> type[UnitStudy]:
    from .unit_ranking import UnitStudy

    return UnitStudy


def design_key(
    unit: Unit, body: str, obstacles: Iterable[tuple[str, float]], effects: Mapping[str, Any]
) -> str:
    """Hash of the simulated design, not of the method: unit without its name, body, obstacles and effects.

    body: hash of the envelope's surface, or nothing; obstacles: hash and friction of each.
    """
    known = {name: effects[name] for name in EFFECTS if name in effects}
    shape = _shape_hash(unit)
    met = sorted((surface, float(friction)) for surface, friction in obstacles)
    return key(shape, body, met, json.dumps(known, sort_keys=True))


@lru_cache(maxsize=256)
def _shape_hash(unit: Unit) -> str:
    """Hash of a unit without its name; cached, since a panel asks for the same one many times a second."""
    return attrs.evolve(unit, name="unit").hash()


def folders(home: Path) -> list[Path]:
    """Folders of a unit's home that may hold a run."""
    try:
        own = [path for path in (home / RUNS).iterdir() if not path.name.startswith(".")]
    except OSError:
        own = []
    return [path for path in (home, home / STALE, *sorted(own)) if (path / NAME).is_file()]


def files_of(folder: Path) -> list[Path]:
    """Files that a run is read from, its inputs first."""
    names = (NAME, SUMMARY, LABEL, "unit.toml", BODY, OBSTACLES)
    return [folder / name for name in names]


def runs(home: Path) -> list[Run]:
    """Every run of a unit that can be read, the latest first."""
    found = []
    for folder in folders(home):
        try:
            found.append(read_run(folder))
        except _UNREADABLE:
            continue
    return ordered(found)


def ordered(found: Iterable[Run]) -> list[Run]:
    """Runs, the latest first."""
    return sorted(found, key=lambda run: (-run.changed_s, run.key))


def read_run(folder: Path) -> Run:
    """The run in a folder. Raises InputError and OSError where it cannot be read."""
    found, _, _ = _kind().read_tables(folder / NAME)
    tables = {target: dict(table.values) for target, table in found.items()}
    unit = read_unit(folder / "unit.toml")
    asked = tables.get("simulate", {})
    body = ""
    if "body" in tables["design"]:
        body = hashlib.sha256(file_bytes(folder / BODY, MOST_BYTES)).hexdigest()
    obstacles = []
    if "obstacles" in asked:
        met = read_rigid_bodies(folder / OBSTACLES, asked.get("friction"))
        obstacles = [(rigid.body.hash, rigid.friction) for rigid in met]
    summary: Any = {}
    latest = folder / NAME
    if (folder / SUMMARY).is_file():
        latest = folder / SUMMARY
        try:
            summary = parse_json(file_bytes(latest), SUMMARY)
        except InputError:
            # Listed all the same, so that it can be run again or removed.
            summary = {}
    label = parse_toml(file_text(folder / LABEL), LABEL) if (folder / LABEL).is_file() else {}
    return Run(
        folder,
        tables,
        unit,
        design_key(unit, body, obstacles, asked),
        summary if isinstance(summary, dict) else {},
        latest.stat().st_mtime,
        str(label.get("name", ""))[:LONGEST_NAME],
        label.get("starred") is True,
    )


def best_of(found: Sequence[Run], design: str) -> Run | None:
    """Run whose results are shown for a design: the best of its runs, or else the latest of all.

    Complete before incomplete, a finer mesh before a coarser one, a quick ranking after others, a ranking
    before the motion alone, then the latest. A run that has just begun is shown only if there is no other.
    """
    own = [run for run in found if run.design == design]
    ready = [run for run in own if run.has_results]
    if ready:
        return max(ready, key=lambda r: (r.complete, r.refine, not r.left_out, bool(r.ranking), r.changed_s))
    others = [run for run in found if run.has_results]
    return next(iter(ordered(others or own)), None)


def place_of(home: Path, job: UnitStudy) -> tuple[Path, UnitStudy]:
    """Folder of a unit's home in which a job is run, and the job with the name that its unit has there.

    Runs of the same inputs share it, also with fewer or more stages: finished stages are kept, and renaming
    makes no result stale.
    """
    own = _tables(job.tables, job.unit)
    for run in runs(home):
        theirs = _tables(run.tables, run.unit)
        if run.key != STALE and all(own[stage] == theirs[stage] for stage in own if stage in theirs):
            return run.folder, attrs.evolve(job, unit=attrs.evolve(job.unit, name=run.unit.name))
    return home / RUNS / key(toml_text(own))[:12], job


def _tables(tables: Mapping[str, Mapping[str, Any]], unit: Unit) -> dict[str, dict[str, Any]]:
    """Inputs by stage, the unit without its name."""
    shape = _shape_hash(unit)
    return {s: {**table, **({"unit_sha256": shape} if s == "design" else {})} for s, table in tables.items()}


def label(run: Run, name: str, starred: bool) -> None:
    """Name a run, "" for no name, and star it or not. Raises InputError and OutputError."""
    name = name.strip()
    if len(name) > LONGEST_NAME or not name.isprintable():
        raise InputError(
            f"{name[:20]!r} ... is too long or more than a line for the name of a run",
            str(run.folder),
            f"give at most {LONGEST_NAME} characters on one line",
        )
    text = toml_text({"name": name, "starred": starred}, "# The user's name for this run.")
    write_text(run.folder / LABEL, text)


def bytes_of(run: Run) -> int:
    """Size of a run's files, in bytes."""
    return sum(path.stat().st_size for top in _own(run) for path in (top, *top.rglob("*")) if path.is_file())


def remove(run: Run) -> None:
    """Delete all of a run's files; others in a unit's home folder stay.

    Raises InputError where a process works in the folder, and OutputError.
    """
    lock = FolderLock(run.folder)
    try:
        # Aside first, in one step each: what is then left half deleted is no run any more.
        aside = make_folder(run.folder.parent / f"{_REMOVED}{uuid.uuid4().hex[:8]}")
        try:
            for path in _own(run):
                if path.name != LOCK:
                    path.replace(aside / path.name)
        except OSError as error:
            raise output_error(error, run.folder) from error
    finally:
        lock.release()
    shutil.rmtree(aside, ignore_errors=True)
    if run.key != HOME:
        shutil.rmtree(run.folder, ignore_errors=True)


def _own(run: Run) -> list[Path]:
    """Files and folders of a run: its whole folder, or in the home folder those that a study writes."""
    if run.key != HOME:
        return sorted(run.folder.iterdir())
    layout = _kind().layout()
    names = (NAME, *layout.optional, *layout.results, *ALWAYS, *OWN, LABEL, OUTPUTS)
    found = {path for name in names if name not in (LOCK, STALE) for path in run.folder.glob(name)}
    return sorted(found)


def move_home(old: Path, new: Path) -> bool:
    """Move a unit's whole home to another path; return False while a run works in it.

    An existing folder is not replaced. Raises OutputError.
    """
    if not old.is_dir() or new.exists():
        return False
    locks = []
    try:
        for folder in {path.parent for path in old.rglob(LOCK)}:
            locks.append(FolderLock(folder))
    except InputError:
        return False
    finally:
        for lock in locks:
            lock.release()
    beside = new.parent / f".{new.name}-{uuid.uuid4().hex[:8]}"
    try:
        make_folder(new.parent)
        # To another disk it is copied: only what is whole gets its name.
        shutil.move(old, beside)
        beside.replace(new)
    except OSError as error:
        raise output_error(error, new) from error
    return True
