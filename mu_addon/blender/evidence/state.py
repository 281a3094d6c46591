"""A unit's measured data and their diagnosis, read again only when files change."""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import csv
import hashlib
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np
from bpy.props import StringProperty

from ...design.parameters import read_unit
from ...errors import InputError, MuError
from ...files import write_csv
from ...measured import Measured, read_folder
from ...measured.folder import FILE
from ...reading import file_bytes, file_text, parse_json, parse_toml
from ...run.folder import write_run
from ..jobs.start_child import JobKind
from ..shared.blender_property import path_property
from ..shared.file_cache import UNREADABLE, FileCache
from ..shared.registration import property_of
from ..shared.wording import error_text
from ..simulate import effects, timings
from ..simulate import study_folder as studies
from ..unit.properties import shape_hash, shape_now, to_unit

FOLDER = "evidence"
"""Folder of the diagnosis in the unit's study folder."""
PROTOCOL = "measured-pressures.csv"
"""An experiment's pressures, in the unit's study folder, for a simulation to follow."""
AT_REST = 0.02
"""A record that begins within this share of its range of 0 begins at rest."""
MODEL, REPORT, RESIDUALS = "model.toml", "report.html", "residuals.csv"
NAMES = {"none": "No effect found", "named": "Named", "ambiguous": "Ambiguous"}
NAMES |= {"unidentifiable": "Not identifiable", "unexplained": "Unexplained"}
"""Verdicts by their headings."""


@property_of(bpy.types.Object, "mu_evidence")
class MU_PG_evidence(bpy.types.PropertyGroup):
    """Measured data of a unit."""

    folder: path_property(
        "Measured Data", "Folder with experiments.toml and the CSV files it names", folder=True
    )
    # Last model given to the unit, the unit before it, and the changes in words.
    applied: StringProperty(options={"HIDDEN"})


@attrs.frozen(eq=False)
class MeasuredFolder:
    """A folder of measured data, or why it cannot be used: an error's text, what, where and remedy."""

    measured: Measured | None
    trouble: str = ""
    digest: dict[str, Any] = attrs.field(factory=dict)


@attrs.frozen(eq=False)
class ShownVerdict:
    """Result of a diagnosis: verdict.json and summary.json; stale: why it is not of the present unit."""

    folder: Path
    status: str
    stale: str
    verdict: dict[str, Any]
    summary: dict[str, Any]

    @property
    def name(self) -> str:
        """Verdict, one of the keys of `NAMES`, or "" where the run is not complete."""
        return str(self.verdict.get("verdict", "")) if self.status == "complete" else ""

    @property
    def dependence(self) -> list[tuple[str, float, str]]:
        """Quantities that the base model's residuals depend on: name, p-value and where, by p-value."""
        rows = self.verdict.get("residual_table") or []
        found = [(str(r["against"]), float(r["p_value"]), str(r.get("where") or "")) for r in rows]
        return sorted(found, key=lambda row: row[1])


def folder_of(root: Any) -> Path:
    """Folder of the unit's diagnosis."""
    return studies.folder_of(root) / FOLDER


def _detail(kinds: Iterable[str]) -> str:
    """Detail of a diagnosis: the kinds of its experiments, which decide what is simulated."""
    return f"diagnose {' '.join(sorted(kinds))}"


def _timed(folder: Path) -> tuple[str, dict[str, Any]]:
    """Detail of a finished diagnosis, and the seconds of its stages."""
    summary = parse_json(file_bytes(folder / "summary.json"), "summary.json")
    return _detail(kind for kind, _ in summary["experiments"].values()), summary["seconds"]


def announced(root: Any) -> tuple[float, bool] | None:
    """Seconds that a diagnosis of such data took on this machine, and True; None before the first."""
    found = measured_data(root)
    if found is None or found.measured is None:
        return None
    taken = timings.measured(_detail(e.kind for e in found.measured.experiments))
    return (sum(taken.values()), True) if taken else None


DIAGNOSIS = JobKind(
    FOLDER, lambda root: root.mu_unit.uuid, folder_of, "diagnosis", heavy=True, prefix="evidence_"
)
timings.READERS[DIAGNOSIS.name] = _timed

_data: FileCache[MeasuredFolder] = FileCache()
_runs: FileCache[tuple[dict[str, Any], dict[str, Any], dict[str, Any], str]] = FileCache()


def measured_data(root: Any) -> MeasuredFolder | None:
    """The unit's measured data, or None where no folder was chosen."""
    if not root.mu_evidence.folder:
        return None
    folder = Path(bpy.path.abspath(root.mu_evidence.folder))
    # Without its first file nothing is cached: the error names what is missing.
    files = [folder / FILE, *sorted(folder.glob("*.csv"))]
    return _data.read(files, lambda: _read_data(folder)) or _read_data(folder)


def _read_data(folder: Path) -> MeasuredFolder:
    try:
        measured = read_folder(folder)
    except MuError as error:
        return MeasuredFolder(None, error_text(error))
    except OSError as error:
        return MeasuredFolder(None, str(error))
    return MeasuredFolder(measured, digest={e.name: e.hash() for e in measured.experiments})


def diagnosis(root: Any) -> ShownVerdict | None:
    """Result of the diagnosis in the unit's folder, or None."""
    folder = folder_of(root)
    files = [folder / name for name in ("summary.json", "verdict.json", "diagnose.toml", "unit.toml")]
    known = _runs.read(files, lambda: _read_run(*files))
    if known is None:
        return None
    summary, verdict, inputs, unit = known
    return ShownVerdict(folder, str(summary.get("status", "")), _stale(root, inputs, unit), verdict, summary)


def _read_run(
    summary: Path, verdict: Path, inputs: Path, unit: Path
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any], str]:
    of = _content(unit, lambda path: shape_hash(read_unit(path)), "unreadable") if unit.is_file() else ""
    named = _content(inputs, lambda path: parse_toml(file_text(path), path.name), {})
    return _content(summary, _json, {}), _content(verdict, _json, {}), named, of


def _content(path: Path, read: Callable[[Path], Any], otherwise: Any) -> Any:
    """What `read` finds in a file, or another value where it cannot be read."""
    try:
        return read(path)
    except UNREADABLE:
        return otherwise


def _json(path: Path) -> dict[str, Any]:
    return dict(parse_json(file_bytes(path), path.name))


def write_inputs(root: Any, folder: Path) -> None:
    """Write the inputs of the unit's diagnosis into its folder; raises InputError and OutputError."""
    # Imported late: it needs the solver's packages, which a Blender may lack.
    from ...studies.diagnose import Diagnose

    measured = read_folder(Path(bpy.path.abspath(root.mu_evidence.folder)))
    study = Diagnose(data=measured, unit=to_unit(root.mu_unit)).complete()
    write_run(folder, Diagnose.layout(), study.texts())


def _stale(root: Any, inputs: dict[str, Any], unit: str) -> str:
    found = measured_data(root)
    if found is None or found.measured is None:
        return "its measured data are not here"
    if inputs.get("data") != found.digest:
        return "made with other measured data"
    # Without a unit's own file the verdict does not depend on the unit.
    return "made with other parameters" if unit and shape_now(root.mu_unit) != unit else ""


def mark_applied(root: Any, to_unit_: str, to_simulation: str) -> None:
    """Record, on the unit in its present state, that it gets the diagnosis's model.

    Texts: the part for its parameters, and the part for its simulation.
    """
    root.mu_evidence.applied = "\n".join([_model(root), _having(root), to_unit_, to_simulation])


def applied(root: Any) -> str:
    """Part of the diagnosis's model that the unit already has, as text, or "": it must not count twice."""
    model, before, to_unit_, to_simulation = (*root.mu_evidence.applied.split("\n"), "", "", "", "")[:4]
    try:
        now = _having(root)
    except MuError:
        now = ""
    if not model or model != _model(root) or now == before:
        return ""
    # Effects of the simulation may have been removed since.
    return "; ".join(words for words in (to_unit_, effects.inputs(root) and to_simulation) if words)


def _having(root: Any) -> str:
    """Hash of the unit, and of its further effects; raises InputError."""
    text = root.mu_unit.study.effects
    return shape_hash(to_unit(root.mu_unit)) + (hashlib.sha256(text.encode()).hexdigest() if text else "")


def _model(root: Any) -> str:
    try:
        return hashlib.sha256(file_bytes(folder_of(root) / MODEL)).hexdigest()
    except OSError:
        return ""


@attrs.frozen(eq=False)
class Course:
    """One experiment over time: time_s (n,), pressure_kPa (n,) and series by source.

    series: `measured`, and `model` and `extended` if a diagnosis predicted them; for each the channels by
    name, (n,), nan without a value.
    """

    time_s: Any
    pressure_kPa: Any
    series: dict[str, dict[str, Any]]


SERIES = {"base_model": "model", "extended_model": "extended"}


def course(root: Any, name: str) -> Course:
    """A unit_pressure experiment with the diagnosis's prediction of it; raises InputError without one."""
    found, judged = measured_data(root), diagnosis(root)
    every = found.measured.of("unit_pressure") if found and found.measured else ()
    e = next((e for e in every if e.name == name), None)
    if e is None:
        raise InputError(f"No unit under pressure was measured as {name!r}")
    channels = [c for c in e.columns if c == "angle_deg" or c.startswith("marker")]
    series = {"measured": {c: np.array(e[c]) for c in channels}}
    if judged is not None and judged.name and not judged.stale:
        series |= _predicted(judged.folder / RESIDUALS, e)
    return Course(np.array(e["time_s"]), np.array(e["pressure_kPa"]), series)


def _predicted(path: Path, e: Any) -> dict[str, dict[str, Any]]:
    """Columns of residuals.csv for an experiment, at its rows."""
    place = {int(row): i for i, row in enumerate(e.rows)}
    found: dict[str, dict[str, Any]] = {name: {} for name in SERIES.values()}
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            for line in csv.DictReader(stream):
                at = place.get(int(line["row"])) if line["experiment"] == e.name else None
                if at is None:
                    continue
                for column, name in SERIES.items():
                    values = found[name].setdefault(line["channel"], np.full(len(e), np.nan))
                    values[at] = float(line[column])
    except (OSError, ValueError, KeyError, TypeError):
        return {}
    same = found["extended"].keys() == found["model"].keys() and all(
        np.array_equal(values, found["model"][c], equal_nan=True) for c, values in found["extended"].items()
    )
    if same:  # nothing was added to the model
        del found["extended"]
    return {name: channels for name, channels in found.items() if channels}


def write_protocol(course: Course, path: Path) -> Path:
    """Write an experiment's pressures as a protocol; raises InputError if it does not begin at rest."""
    time, pressure = course.time_s - course.time_s[0], course.pressure_kPa.copy()
    if abs(pressure[0]) > AT_REST * np.ptp(pressure):
        raise InputError(
            f"the experiment begins at {pressure[0]:.3g} kPa",
            "",
            "choose an experiment that begins at rest, as a simulation does",
        )
    pressure[0] = 0.0  # gauge noise
    write_csv(path, ("time_s", "pressure_kPa"), zip(time.tolist(), pressure.tolist(), strict=True))
    return path
