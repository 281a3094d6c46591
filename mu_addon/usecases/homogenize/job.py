"""Inputs of a homogenisation: the unit, its resin, the block between plates."""

from __future__ import annotations

from pathlib import Path

import attrs

from ...design.parameters import Unit, read_unit, to_toml
from ...design.settings import USUAL_RESIN
from ...design.strut_cell import StrutCell, strut_cell
from ...errors import InputError
from ...homogenize.cell_mesh import CellMeshSettings
from ...homogenize.compression import STRAINS, Friction
from ...materials.library import Material, load_material, read_material
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, read_inputs, structured
from ...toml_writer import toml_text
from .settings import BOTH, CELLS, FRICTIONS, REFINE, STRAIN

UNIT = "unit.toml"
LAYOUT = FolderLayout(
    "homogenize.toml",
    "# The inputs of this homogenisation; unit.toml beside it belongs to them.",
    results=(
        "effective.toml",
        "tensor.csv",
        "cell.csv",
        "cell.vtu",
        "cell.png",
        "modulus.png",
        "specimen.stl",
        "specimen_slide.csv",
        "specimen_stick.csv",
        "specimen_*.png",
        "report.html",
    ),
)
# Elements to a strut's diameter in the block: its cell's modulus is within 2 % of a fine mesh's.
BLOCK_PER_DIAMETER = 1.0
# Below it less than half an element to a diameter, which no cell is meshed with.
SPECIMEN_REFINE = 0.5


@attrs.frozen
class Resin:
    """Resin of the struts: neo-Hookean, Young's modulus in MPa, Poisson's ratio; density in g/ml."""

    name: str
    modulus_MPa: float
    poisson: float
    density_g_per_ml: float

    @classmethod
    def of_unit(cls, unit: Unit, known: Material) -> Resin:
        """Resin of the unit: its struts are printed with its membrane, with a known resin's density."""
        m = unit.material
        modulus = m.membrane_modulus_MPa
        return cls("that of the unit's membrane", modulus, m.membrane_poisson, known.density_g_per_ml)

    @classmethod
    def of(cls, known: Material) -> Resin:
        """Resin of the library, or of a file."""
        return cls(known.name, known.modulus_MPa, known.poisson, known.density_g_per_ml)


@attrs.frozen
class Job:
    """Inputs of a homogenisation. cells: of the specimen, per side; frictions: without any, no specimen."""

    unit: Unit
    resin: Resin
    cells: int = CELLS.field()
    frictions: tuple[Friction, ...] = FRICTIONS
    strain: float = STRAIN.field()
    refine: float = REFINE.field()

    def __attrs_post_init__(self) -> None:
        if self.frictions and self.refine < SPECIMEN_REFINE:
            raise InputError(
                f"refine = {self.refine:g} is too coarse for the specimen",
                "refine",
                f"give {SPECIMEN_REFINE:g} or more, or leave the specimen out",
            )

    @property
    def cell(self) -> StrutCell:
        """Cell of the unit, as printed."""
        return strut_cell(self.unit)

    @property
    def mesh(self) -> CellMeshSettings:
        """Settings of the cell's mesh."""
        standard = CellMeshSettings()
        return attrs.evolve(standard, per_diameter=standard.per_diameter * self.refine)

    @property
    def block_mesh(self) -> CellMeshSettings:
        """Settings of each cell's mesh in the block: coarse, as there are many."""
        return attrs.evolve(self.mesh, per_diameter=BLOCK_PER_DIAMETER * self.refine)

    @property
    def strains(self) -> tuple[float, ...]:
        """Nominal strains of the specimen's test."""
        return (*(s for s in STRAINS if s < self.strain - 1e-9), self.strain)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; homogenize.toml is the first."""
        resin = attrs.asdict(self.resin)
        values = {
            "format": FORMAT,
            "unit": UNIT,
            "cells": self.cells,
            "frictions": self.frictions,
            "strain": self.strain,
            "refine": self.refine,
            "resin": {"name": resin.pop("name"), "modulus_kPa": 1e3 * resin.pop("modulus_MPa"), **resin},
        }
        return {LAYOUT.inputs: toml_text(values, LAYOUT.header), UNIT: to_toml(self.unit)}


def read_job(folder: Path) -> Job:
    """The job that a folder of `homogenize` describes; raises InputError."""
    path = folder / LAYOUT.inputs
    values, _ = read_inputs(path)
    values.pop("unit", None)
    resin = values.get("resin")
    if isinstance(resin, dict) and isinstance(resin.get("modulus_kPa"), int | float):
        resin["modulus_MPa"] = resin.pop("modulus_kPa") / 1e3
    return structured(Job, values, str(path), unit=read_unit(folder / UNIT))


def frictions_of(name: str) -> tuple[Friction, ...]:
    """Contacts of the specimen that a setting names."""
    return tuple(f for f in FRICTIONS if name in (f, BOTH))


def resin_of(name: str | None, unit: Unit) -> Resin:
    """The resin of a name in the library or of a file, by default the unit's. Raises InputError."""
    if not name:
        return Resin.of_unit(unit, load_material(USUAL_RESIN))
    path = Path(name)
    return Resin.of(read_material(path) if path.suffix == ".toml" else load_material(name))
