"""Inputs of a diagnosis: measured data, and their unit."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import attrs

from ...design.parameters import Unit, load_preset, read_unit, to_toml
from ...design.settings import PRESET
from ...errors import InputError
from ...evidence.extended import ExtendedModel, load_model
from ...evidence.simulator import bends, unit_behind
from ...measured import Measured, read_folder
from ...measured.folder import FILE, described, experiments_digest, require_same_data
from ...meshing.settings import SELF_CONTACT
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, named_path, read_inputs
from ...toml_writer import toml_text

if TYPE_CHECKING:
    from ...evidence.unit_fem import UnitSettings
    from .unknown import Unknown

UNIT = "unit.toml"
KNOWN = "known.toml"
UNKNOWN, SHAPES = "unknown.toml", "shapes.csv"
LAYOUT = FolderLayout(
    "diagnose.toml",
    "# The inputs of this diagnosis; the measured data are named by the SHA-256 of their files.",
    results=("verdict.json", "model.toml", "residuals.csv", "report.html", SHAPES),
    optional=(UNIT, KNOWN, UNKNOWN),
)


@attrs.frozen(eq=False)
class Job:
    """Inputs of a diagnosis.

    unit: of unit_pressure experiments and of blocks with counted cells, at any scale; by default the preset
    `PRESET`. self_contact: of its walls and struts. settings: of the simulation, in place of the printed
    body's. known: result of an earlier diagnosis, or None: its effects are in the model from the start and
    stay; moduli and zeros are fitted again. unknown: parameters of the unit's design to fit, too.
    """

    measured: Measured
    unit: Unit | None = None
    settings: UnitSettings | None = None
    known: ExtendedModel | None = None
    self_contact: bool = SELF_CONTACT.field()
    unknown: Unknown | None = None

    def __attrs_post_init__(self) -> None:
        if self.unknown and not bends(self.measured.experiments):
            raise InputError(
                "no experiment bends a unit, whose parameters could be unknown",
                str(self.measured.folder / FILE),
                "leave --unknown out",
            )
        if not any(e.role == "fit" for e in self.measured.experiments):
            raise InputError(
                "every experiment is held out",
                str(self.measured.folder / FILE),
                'give role = "fit" to some',
            )

    @property
    def subject(self) -> Unit | None:
        """Unit that the experiments are made with."""
        return unit_behind(self.measured.experiments, self.unit)

    @property
    def body(self) -> str:
        """How the unit is modelled, as text; empty if none is simulated."""
        if not bends(self.measured.experiments):
            return ""
        settings = self.unit_settings
        return f"the unit as printed, {'walls kept apart' if settings.self_contact else 'walls may cross'}"

    @property
    def unit_settings(self) -> UnitSettings:
        """Settings of the unit's simulation."""
        from ...evidence.unit_fem import UnitSettings

        settings, subject = self.settings or UnitSettings(self_contact=self.self_contact), self.subject
        if self.unknown is None or subject is None or settings.designs:
            return settings
        return attrs.evolve(settings, designs=self.unknown.designs(subject))

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; diagnose.toml is the first."""
        values = {
            "format": FORMAT,
            "experiments_sha256": experiments_digest(self.measured),
            "program_sha256": _program(),
            "settings": None if self.settings is None else repr(self.settings),
            "self_contact": self.self_contact if bends(self.measured.experiments) else None,
            "data": described(self.measured),
            "run": {"data": str(self.measured.folder.resolve())},
        }
        texts = {LAYOUT.inputs: toml_text(values, LAYOUT.header)}
        if self.known is not None:
            texts[KNOWN] = self.known.text()
        if self.unknown is not None:
            texts[UNKNOWN] = self.unknown.text
        return texts if self.subject is None else texts | {UNIT: to_toml(self.subject)}


def read_job(folder: Path) -> Job:
    """The job that a folder of `diagnose` describes, its data at their original path; raises InputError."""
    path = folder / LAYOUT.inputs
    table, run = read_inputs(path)
    values = table.values
    if "settings" in values:
        raise InputError("this run was made with settings given in Python", str(path), "run it there again")
    measured = read_folder(named_path(path, run, "data", "folder of measured data"))
    require_same_data(measured, values.get("data"), described(measured))
    known, unknown = folder / KNOWN, folder / UNKNOWN
    unit = read_unit(folder / UNIT) if (folder / UNIT).is_file() else None
    if unknown.is_file():
        from .unknown import unknown_of
    return Job(
        measured,
        unit,
        self_contact=values.get("self_contact", SELF_CONTACT.default) is True,
        known=load_model(known) if known.is_file() else None,
        unknown=unknown_of(unknown, unit or load_preset(PRESET)) if unknown.is_file() else None,
    )


@cache
def _program() -> str:
    """SHA-256 of the code that a verdict depends on."""
    package = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        name = path.relative_to(package).as_posix()
        if not name.startswith("blender/"):
            digest.update(name.encode() + path.read_bytes())
    return digest.hexdigest()
