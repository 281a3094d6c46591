"""Inputs that several studies have and that are no plain values: a unit, a resin."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from .. import design, materials
from ..design.quantity import in_kPa, in_MPa
from ..design.settings import USUAL_RESIN
from ..run.inputs import structured
from ..run.study import Input

UNIT = "unit.toml"


@attrs.frozen
class UnitInput(Input):
    """A unit, in a file of its own."""

    kind: str = "unit"

    def write(self, name: str, value: design.Unit) -> tuple[dict[str, Any], dict[str, str]]:
        """The file's name, and its text."""
        return {name: UNIT}, {UNIT: design.to_toml(value)}

    def read(self, name: str, document: dict[str, Any], folder: Path) -> design.Unit:
        """The unit of the folder; raises InputError."""
        document.pop(name, None)
        return design.read_unit(folder / UNIT)


@attrs.frozen
class Resin:
    """Resin of the struts: neo-Hookean, Young's modulus in MPa, Poisson's ratio; density in g/ml."""

    name: str
    modulus_MPa: float
    poisson: float
    density_g_per_ml: float


@attrs.frozen
class ResinInput(Input):
    """A resin, by a name of the library or a file, or the unit's own. Its values are kept with the inputs."""

    kind: str = "resin"

    def made(self, value: str | None, given: Mapping[str, Any]) -> Resin:
        """The resin of a name, of a file, or of the unit: its struts are printed with its membrane."""
        if not value:
            own, known = given["unit"].material, materials.load_material(USUAL_RESIN)
            values = own.membrane_modulus_MPa, own.membrane_poisson, known.density_g_per_ml
            return Resin("that of the unit's membrane", *values)
        path = Path(value)
        known = materials.read_material(path) if path.suffix == ".toml" else materials.load_material(value)
        return Resin(known.name, known.modulus_MPa, known.poisson, known.density_g_per_ml)

    def write(self, name: str, value: Resin) -> tuple[dict[str, Any], dict[str, str]]:
        """Its table, the modulus in kPa."""
        values = attrs.asdict(value)
        return {
            name: {"name": values.pop("name"), "modulus_kPa": in_kPa(values.pop("modulus_MPa")), **values}
        }, {}

    def read(self, name: str, document: dict[str, Any], folder: Path) -> Resin:
        """The resin of its table; raises InputError."""
        table = document.pop(name, None)
        if isinstance(table, dict) and isinstance(table.get("modulus_kPa"), int | float):
            table["modulus_MPa"] = in_MPa(table.pop("modulus_kPa"))
        return structured(Resin, table, f"{folder}, [{name}]")
