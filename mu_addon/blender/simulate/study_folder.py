"""Where a unit's results lie, and whether they belong to the unit as it is now."""

from __future__ import annotations

import csv
import hashlib
import re
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np

from ...design.body import MOST_BYTES
from ...design.parameters import read_unit
from ...design.rigid_body import read_rigid_bodies
from ...errors import MuError
from ...reading import file_bytes, parse_json
from ...usecases.simulate_and_place import study_file
from ..body import state as bodies
from ..obstacles import state as obstacles
from ..shared.compat import user_folder
from ..shared.file_cache import FileCache
from ..unit.properties import shape_hash, to_unit
from . import effects

CONTACT = "contact.csv"


@attrs.frozen
class Findings:
    """What a study's summary.json says; `stale` where the unit was changed since it was computed."""

    folder: Path
    status: str
    stale: bool
    summary: dict[str, Any]

    @property
    def angles(self) -> list[tuple[float, float]]:
        """Pairs (pressure in kPa, bending angle in degrees) by pressure."""
        found = self.summary.get("angle_deg") or {}
        return sorted((float(p), float(a)) for p, a in found.items())

    @property
    def quick(self) -> bool:
        """Whether it was computed with linear elements, which lock in thin walls."""
        mesh = (self.summary.get("study") or {}).get("mesh") or {}
        return mesh.get("order") == 1

    def ranking(self, rule: str) -> list[tuple[str, float]]:
        """Pairs (path, J_hat in mm) of one rule, the best first."""
        found = (self.summary.get("J_hat_mm") or {}).get(rule) or {}
        return sorted(((name, float(j)) for name, j in found.items()), key=lambda pair: pair[1])

    @property
    def rule(self) -> str:
        """The rule whose best path is the answer, or nothing where no paths were ranked."""
        rules = list(self.summary.get("chosen") or {})
        return "volume_fraction" if "volume_fraction" in rules else (rules or [""])[0]


@attrs.frozen(eq=False)
class ContactForce:
    """Force (k,) in N of a study's unit on one obstacle at times (k,) in s, friction and all."""

    name: str
    time_s: Any
    force_N: Any


def folder_of(root: Any) -> Path:
    """Folder of the unit's study: the one it names, else beside the .blend file, else the user's own."""
    props = root.mu_unit
    return default_folder(props.study.folder, props.title, props.uuid)


def default_folder(named: str, title: str, uuid: str) -> Path:
    """The folder that is named, else one for a title beside the .blend file, else in the user's own."""
    if named:
        return Path(bpy.path.abspath(named))
    name = f"{re.sub(r'[^A-Za-z0-9._-]+', '-', title).strip('-.') or 'unit'}-{uuid[:8]}"
    if bpy.data.filepath:
        blend = Path(bpy.data.filepath)
        return blend.with_name(f"{blend.stem}.mu") / name
    return user_folder("studies") / name


def assign_folder(root: Any) -> Path:
    """The unit's study folder, stored with the unit from now on, relative to the .blend file if possible."""
    folder = folder_of(root)
    if not root.mu_unit.study.folder:
        root.mu_unit.study.folder = relative(folder)
    return folder


_findings: FileCache[tuple[dict[str, Any], Any]] = FileCache()
_forces: FileCache[list[ContactForce]] = FileCache()


def findings(root: Any) -> Findings | None:
    """What the unit's study has found, or None where there is none; read again only when files change."""
    folder = folder_of(root)
    names = ("summary.json", "unit.toml", study_file.NAME, "body.obj", study_file.FILES["obstacles"])
    known = _findings.read([folder / name for name in names], lambda: _read_findings(folder))
    if known is None:
        return None
    summary, inputs = known
    try:
        unit = to_unit(root.mu_unit)
        body = bodies.envelope_in(root, unit)
        own = "" if body is None else body.hash
        stale = (shape_hash(unit), own, obstacles.inputs(root), effects.inputs(root)) != inputs
    except MuError:
        stale = True
    return Findings(folder, str(summary.get("status", "")), stale, summary)


def _read_findings(folder: Path) -> tuple[dict[str, Any], Any]:
    summary = parse_json(file_bytes(folder / "summary.json"), "summary.json")
    unit = shape_hash(read_unit(folder / "unit.toml"))
    inputs = unit, _body_hash(folder), _obstacles(folder), _effects(folder)
    return summary if isinstance(summary, dict) else {}, inputs


def _body_hash(folder: Path) -> str:
    """Hash of the body that a study was made with, as `Body.hash` has it; nothing where there was none."""
    try:
        return hashlib.sha256(file_bytes(folder / "body.obj", MOST_BYTES)).hexdigest()
    except OSError:
        return ""


def contact_forces(root: Any) -> list[ContactForce]:
    """Force of the study's unit on every obstacle; empty where there is none."""
    path = folder_of(root) / CONTACT
    return _forces.read([path], lambda: _read_forces(path)) or []


def _read_forces(path: Path) -> list[ContactForce]:
    with path.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    found: dict[str, list[tuple[float, float]]] = {}
    for row in rows:
        force = np.linalg.norm([float(row[f"force_{axis}_N"]) for axis in "xyz"])
        found.setdefault(Path(row["obstacle"]).stem, []).append((float(row["time_s"]), float(force)))
    return [ContactForce(name, *np.array(values).T) for name, values in found.items()]


def _effects(folder: Path) -> dict[str, Any]:
    """Effects that a study was made with, as `effects.inputs` has them; raises InputError."""
    asked = (study_file.read(folder) or {}).get("simulate", {})
    return {name: asked[name] for name in effects.INPUTS if name in asked}


def _obstacles(folder: Path) -> list[tuple[str, float]]:
    """Obstacles that a study was made with, as `obstacles.inputs` has them; raises InputError."""
    asked = (study_file.read(folder) or {}).get("simulate", {})
    if "obstacles" not in asked:
        return []
    met = read_rigid_bodies(folder / study_file.FILES["obstacles"], asked.get("friction"))
    return sorted((rigid.body.hash, rigid.friction) for rigid in met)


def relative(path: Path) -> str:
    """A path as Blender keeps it: relative to the .blend file where there is one on the same drive."""
    if not bpy.data.filepath:
        return str(path)
    try:
        return bpy.path.relpath(str(path))
    except ValueError:
        return str(path)
