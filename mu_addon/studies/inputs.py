"""Inputs that several studies have and that are no plain values: a unit, a resin."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from .. import design, materials, measured
from ..design.quantity import in_kPa, in_MPa
from ..design.settings import USUAL_RESIN
from ..errors import InputError
from ..run.inputs import named_path, structured
from ..run.study import Input, Written

UNIT = "unit.toml"


@attrs.frozen
class UnitInput(Input):
    """A unit, in a file of its own."""

    kind: str = "unit"

    def write(self, name: str, value: design.Unit) -> Written:
        """The file's name, and its text."""
        return Written({name: UNIT}, files={UNIT: design.to_toml(value)})

    def read(self, name: str, document: dict[str, Any], run: dict[str, Any], path: Path) -> design.Unit:
        """The unit of the folder; raises InputError."""
        document.pop(name, None)
        return design.read_unit(path.parent / UNIT)


@attrs.frozen
class WordsInput(Input):
    """Words, in any number."""

    kind: str = "words"
    many: bool = True

    def made(self, value: str | Sequence[str] | None, given: Mapping[str, Any]) -> tuple[str, ...]:
        """The words of a text, or a list of them."""
        return tuple(value.split() if isinstance(value, str) else value or ())

    def read(self, name: str, document: dict[str, Any], run: dict[str, Any], path: Path) -> tuple[str, ...]:
        """The words of the file; raises InputError."""
        found = document.pop(name, [])
        if not isinstance(found, list) or not all(isinstance(word, str) for word in found):
            raise InputError(f"{found!r} does not fit", f"{path}, {name}", "give a list of texts in quotes")
        return tuple(found)


@attrs.frozen
class MeasuredInput(Input):
    """A folder of measured data, read at its place. data: what of it decides, by the experiments' names."""

    kind: str = "measured"
    data: Callable[[measured.Measured], dict[str, Any]] = lambda found: {
        e.name: e.sha256 for e in found.experiments
    }

    def write(self, name: str, value: measured.Measured) -> Written:
        """Its place, and what decides."""
        return Written({"data": self.data(value)}, {"data": str(value.folder.resolve())})

    def read(self, name: str, document: dict[str, Any], run: dict[str, Any], path: Path) -> measured.Measured:
        """The folder's content; raises InputError where it is gone or another."""
        before = document.pop("data", None)
        found = measured.read_folder(named_path(path, run, "data", "folder of measured data"))
        from ..measured.folder import require_same_data

        require_same_data(found, before, self.data(found))
        return found


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

    def write(self, name: str, value: Resin) -> Written:
        """Its table, the modulus in kPa."""
        values = attrs.asdict(value)
        modulus = in_kPa(values.pop("modulus_MPa"))
        return Written({name: {"name": values.pop("name"), "modulus_kPa": modulus, **values}})

    def read(self, name: str, document: dict[str, Any], run: dict[str, Any], path: Path) -> Resin:
        """The resin of its table; raises InputError."""
        table = document.pop(name, None)
        if isinstance(table, dict) and isinstance(table.get("modulus_kPa"), int | float):
            table["modulus_MPa"] = in_MPa(table.pop("modulus_kPa"))
        return structured(Resin, table, f"{path}, [{name}]")
