"""One experiment: its specimen and conditions, and the recorded columns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..run.stored import content


def _read_only(columns: Mapping[str, Any]) -> Mapping[str, Array]:
    kept = {}
    for name, values in columns.items():
        kept[name] = np.array(values, np.float64)
        kept[name].flags.writeable = False
    return MappingProxyType(kept)


@attrs.frozen(eq=False)
class Experiment:
    """One experiment of a folder of measured data; keys that its kind lacks, or were not given, are None.

    columns: arrays (n,) by their names, which end with the unit; for a coupon or a lattice that was recorded
    as displacement and force they include strain and nominal stress_kPa (compression positive in
    lattice_compression, tension positive in coupon). A column with _sd_ in its name is the standard deviation
    of an error that its whole record shares. A lattice that was weighed has columns mass_g and mass_sd_g, one
    value throughout. rows (n,): numbers of the lines in the file. orientation_deg: direction of gravity about
    `orientation_axis`, x where none is given, 0 hanging with the tip down; see `unit_pose.down`. strut_mm:
    diameter that straight round struts were drawn with, None for the unit's. gap_mm: from the tip at rest to
    the load cell that holds it. section_mm: width and thickness of the loaded section. accuracy: of
    instruments as stated, by column, in its unit. sha256: of the file's bytes.
    """

    name: str
    kind: str
    role: str
    file: Path
    columns: Mapping[str, Array] = attrs.field(converter=_read_only)
    rows: Array
    sha256: str
    scale: float = 1.0
    orientation_deg: float = 0.0
    specimen: str = ""
    session: str = ""
    temperature_C: float = math.nan
    source: str = ""
    run_order: float | None = None
    mode: str | None = None
    axis: str | None = None
    section_mm: tuple[float, float] | None = None
    length_mm: float | None = None
    cells: tuple[int, int, int] | None = None
    strut_mm: float | None = None
    plates: str | None = None
    mass_g: float | None = None
    mass_sd_g: float | None = None
    added_mass_g: float | None = None
    valve: str | None = None
    orientation_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    gap_mm: float = 0.0
    chamber_volume_mm3: float | None = None
    accuracy: Mapping[str, float] = MappingProxyType({})

    def __getitem__(self, column: str) -> Array:
        """A column (n,) by its name with unit."""
        return self.columns[column]

    def __len__(self) -> int:
        return len(self.rows)

    def hash(self) -> str:
        """Hash of all but its place."""
        return content({f.name: getattr(self, f.name) for f in attrs.fields(Experiment) if f.name != "file"})

    def stated_accuracy(self, column: str) -> float:
        """Accuracy stated for the instrument behind a column, in the column's unit; inf where none was."""
        if column == "stress_kPa" and self.section_mm:
            return 1e3 * self.accuracy.get("force_N", math.inf) / math.prod(self.section_mm)
        if column == "strain" and self.length_mm:
            return self.accuracy.get("displacement_mm", math.inf) / self.length_mm
        return self.accuracy.get(column, math.inf)

    @property
    def markers(self) -> dict[int, Array]:
        """Positions (n, 3) in mm of each marker, by its number; nan where a coordinate was not measured."""
        numbers = sorted({int(c[6 : c.index("_")]) for c in self.columns if c.startswith("marker")})
        unseen = np.full(len(self), np.nan)
        return {
            n: np.stack([self.columns.get(f"marker{n}_{a}_mm", unseen) for a in "xyz"], axis=1)
            for n in numbers
        }
