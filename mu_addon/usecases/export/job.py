"""Inputs of an export: the unit, its sensor's path, formats, the printer's offsets, the resin."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from numpy.typing import NDArray

from ...design.anchors import Window, window
from ...design.parameters import Unit, read_unit, to_toml
from ...design.settings import USUAL_RESIN
from ...errors import InputError
from ...reading import file_bytes, file_text, unreadable
from ...run.folder import RUN, FolderLayout
from ...run.inputs import FORMAT, digest, named_path, read_inputs, require_digest, structured
from ...toml_writer import toml_text
from .settings import FORMATS, QUALITY

if TYPE_CHECKING:
    from ...materials.library import Material

Array = NDArray[np.float64]

UNIT, RESIN = "unit.toml", "resin.toml"
MANIFEST = "manifest.json"
# Characters of a path's points: some ten thousand of them.
_LONGEST_PATH = 1 << 18
LAYOUT = FolderLayout(
    "export.toml",
    "# The inputs of this export; unit.toml beside it belongs to them.",
    results=(
        "unit.stl",
        "unit_at_*_kPa.stl",
        "unit.3mf",
        "unit-beams.3mf",
        "*.step",
        "nodes.txt",
        "plug-*.stl",
        MANIFEST,
    ),
)


@attrs.frozen
class Deformed:
    """A pressure in kPa, and the run that simulated the unit's motion, with the motion's SHA-256."""

    kPa: float
    run: Path
    sha256: str


@attrs.frozen(eq=False)
class Job:
    """Inputs of an export. path: of the waveguide, or None; take_off: the printer's offsets in mm.

    resin: None for the usual one, loaded by the run. vent_along: build direction, away from the platform, for
    which trapped resin gets vents; None for none. deformed: state in which the solid is written as well.
    """

    unit: Unit
    resin: Material | None
    path: Window | Array | None = None
    path_name: str = ""
    formats: tuple[str, ...] = FORMATS
    quality: str = QUALITY.field()
    take_off: tuple[float, float] = (0.0, 0.0)
    offset_source: str = ""
    vent_along: tuple[float, float, float] | None = None
    deformed: Deformed | None = None

    def __attrs_post_init__(self) -> None:
        for name in self.formats:
            if name not in FORMATS:
                raise InputError(
                    f"there is no format {name!r}", "--formats", f"choose from {', '.join(FORMATS)}"
                )
        if self.vent_along is not None and not 1e-6 < sum(x * x for x in self.vent_along) < 1e12:
            raise InputError(
                f"{self.vent_along} is not a direction", "--vent-along", "give three numbers, such as 0 0 -1"
            )

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; export.toml is the first."""
        values: dict[str, Any] = {
            "format": FORMAT,
            "unit": UNIT,
            "path": self.path_name,
            "formats": self.formats,
            "quality": self.quality,
            "take_off_mm": self.take_off,
            "offset_source": self.offset_source or None,
            "resin": USUAL_RESIN if self.resin is None else self.resin.name,
            "vent_along": self.vent_along,
            "points_mm": None if self.path is None or isinstance(self.path, Window) else self.path,
        }
        if self.deformed is not None:
            values |= {"deformed_kPa": self.deformed.kPa, "motion_sha256": self.deformed.sha256}
            values[RUN] = {"motion": str(self.deformed.run)}
        return {
            LAYOUT.inputs: toml_text(values, LAYOUT.header),
            UNIT: to_toml(self.unit),
            **resin_text(self.resin),
        }


@attrs.frozen
class _Settings:
    """Content of export.toml, apart from unit and resin."""

    resin: str
    path: str = ""
    formats: tuple[str, ...] = FORMATS
    quality: str = QUALITY.field()
    take_off_mm: tuple[float, float] = (0.0, 0.0)
    offset_source: str = ""
    points_mm: tuple[tuple[float, float, float], ...] = ()
    vent_along: tuple[float, float, float] | None = None
    deformed_kPa: float | None = None
    motion_sha256: str = ""


def read_job(folder: Path) -> Job:
    """The job that a folder of `export` describes; raises InputError."""
    path = folder / LAYOUT.inputs
    values, run = read_inputs(path)
    values.pop("unit", None)
    asked, unit = structured(_Settings, values, str(path)), read_unit(folder / UNIT)
    deformed = None
    if asked.deformed_kPa is not None:
        folder_of_run = named_path(path, run, "motion", "simulated run")
        deformed = deformed_in(folder_of_run, unit, asked.deformed_kPa)
        if deformed.sha256 != asked.motion_sha256:
            require_digest(folder_of_run, b"", asked.motion_sha256, "simulated motion")
    along = np.array(asked.points_mm) if asked.points_mm else path_of(unit, asked.path or None)[0]
    return Job(
        unit=unit,
        resin=read_resin(folder, asked.resin),
        path=along,
        path_name=asked.path,
        formats=asked.formats,
        quality=asked.quality,
        take_off=asked.take_off_mm,
        offset_source=asked.offset_source,
        vent_along=asked.vent_along,
        deformed=deformed,
    )


def deformed_in(run: Path, unit: Unit, kPa: float) -> Deformed:
    """A state of a unit's motion in the folder of a run; raises InputError if it is not there."""
    from ...report.motion_files import FOLDER, MODEL_A, read_motion

    motion = read_motion(run)
    if read_unit(run / UNIT) != unit:
        remedy = f"give --unit {run / UNIT}, or simulate this unit"
        raise InputError("that run simulated another unit", f"--deformed {kPa:g} {run}", remedy)
    if not np.isclose(motion.state_kPa, kPa, rtol=0.0, atol=1e-6).any():
        known = ", ".join(f"{p:g}" for p in motion.state_kPa)
        raise InputError(f"that run has no state at {kPa:g} kPa", str(run), f"choose from {known}")
    return Deformed(kPa, run, digest(file_bytes(run / FOLDER / f"{MODEL_A}.npz", 1 << 30)))


def resin_text(resin: Material | None) -> dict[str, str]:
    """The file of a resin by its name; none for the usual one, which the library has."""
    if resin is None:
        return {}
    from ...materials.library import material_text

    return {RESIN: material_text(resin)}


def read_resin(folder: Path, name: str) -> Material:
    """Resin in a folder, or of the library where the folder has none; raises InputError."""
    # Only now: a window that writes a job needs none of the solver's packages that come with it.
    from ...materials.library import load_material, read_material

    kept = folder / RESIN
    return read_material(kept) if kept.is_file() else load_material(name)


def resin_of(name: str | None) -> Material:
    """A resin of the library by name, or of a TOML file; by default the usual one. Raises InputError."""
    from ...materials.library import load_material, read_material

    chosen = name or USUAL_RESIN
    return read_material(Path(chosen)) if chosen.endswith(".toml") else load_material(chosen)


def path_of(unit: Unit, name: str | None, row: str | None = None) -> tuple[Window | Array | None, str]:
    """A path and its name: a window, alpha1 .., or one of a paths.csv of `place`, its first by default."""
    if row is not None and not (name or "").endswith(".csv"):
        raise InputError(
            f"--path-row {row} names a row of a paths.csv, but --path does not give that file",
            "--path-row",
            "give the paths.csv of `place --paths graph` with --path, or leave --path-row out",
        )
    if name is None:
        return None, ""
    if not name.endswith(".csv"):
        return window(unit, name), name
    try:
        rows = csv.DictReader(io.StringIO(file_text(name)))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(
            f"cannot read the paths: {unreadable(error)}", name, "give paths.csv of `place --paths graph`"
        ) from error
    named = next((r for r in rows if row is None or r.get("path") == row), None)
    if named is None:
        raise InputError(
            f"there is no path {row!r}" if row else "there is no path", name, "see its first column"
        )
    try:
        return _points(named.get("points_mm") or ""), named["path"]
    except (KeyError, ValueError) as error:
        raise InputError(
            "its column points_mm is not a list of points", name, "write it again by `place`"
        ) from error


def _points(text: str) -> Array:
    """Points (n, 3) in mm of a cell of paths.csv; raises ValueError."""
    if len(text) > _LONGEST_PATH:
        raise ValueError("no path of a lattice is that long")
    if not text.strip():
        raise ValueError("no points")
    return np.array([[float(c) for c in p.split()] for p in text.split(";")]).reshape(-1, 3)
