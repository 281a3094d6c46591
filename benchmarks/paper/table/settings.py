"""Settings of a reproduction of the paper's table, and its sets of values."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from mu_addon.design.parameters import Unit, load_preset
from mu_addon.errors import InputError
from mu_addon.meshing.settings import MeshSettings
from mu_addon.reading import file_text, parse_toml
from mu_addon.run.folder import FolderLayout
from mu_addon.run.inputs import FORMAT, read_inputs, structured
from mu_addon.toml_writer import toml_text
from mu_addon.usecases.simulate_and_place.settings import WORKERS

from .values import with_values

TABLE, AGREEMENT, STATEMENTS, BENDING = "table.csv", "agreement.csv", "statements.csv", "bending.csv"
REPORT = "report.html"
LAYOUT = FolderLayout(
    "reproduce.toml",
    "# The inputs of a reproduction of the paper's table.",
    results=(TABLE, AGREEMENT, STATEMENTS, BENDING, REPORT),
)
DEFAULT = "default"
SETS = Path(__file__).parents[1] / "sets"


def between(low: int, high: int) -> Any:
    """An attrs validator of a number's bounds; InputError names the option."""

    def check(_: object, field: attrs.Attribute[Any], value: float) -> None:
        if not low <= value <= high:
            raise InputError(f"{value:g} is out of bounds", f"--{field.name}", f"give {low} to {high}")

    return check


@attrs.frozen
class Settings:
    """What decides a reproduction. Raises InputError.

    values: of the set that all columns share, beside the preset's own. held_cells: the height from the base,
    in cells, up to which the three units are held fast. mesh: of the table.
    """

    values: Mapping[str, Any] = attrs.field(factory=dict)
    values_name: str = DEFAULT
    held_cells: float = attrs.field(default=0.0, validator=between(0, 5))
    mesh: MeshSettings = attrs.field(factory=MeshSettings)
    # Whether the paper's fourth column is found, too.
    gripper: bool = True
    workers: int = WORKERS.field()

    @property
    def unit(self) -> Unit:
        """The unit at 1.0x with the set's values. Raises InputError where it breaks a rule."""
        return with_values(load_preset("mu-1.0x"), self.values)

    def inputs(self) -> dict[str, Any]:
        """What reproduce.toml says: all that decides the results."""
        return {
            "format": FORMAT,
            "set": self.values_name,
            "held_cells": self.held_cells,
            "gripper": self.gripper,
            "values": dict(sorted(self.values.items())),
            "mesh": self.mesh.table(),
        }

    def texts(self) -> dict[str, str]:
        """Text of the file of inputs, by name."""
        return {LAYOUT.inputs: toml_text(self.inputs(), LAYOUT.header)}


def read_settings(folder: Path) -> Settings:
    """Settings that a reproduction's folder describes; raises InputError."""
    path = folder / LAYOUT.inputs
    values, _ = read_inputs(path)
    if any(key in values for key in ("long", "meshes", "points")):
        raise InputError(
            "the folder belongs to the long studies of random meshes and open values",
            str(path),
            "run `python -m benchmarks.paper.long` with this folder as --out, or choose a new folder",
        )
    name, given = values.pop("set", DEFAULT), values.pop("values", {})
    if not isinstance(name, str) or not isinstance(given, dict):
        raise InputError("set is not a name, or values is not a table", str(path), "correct that key")
    return structured(Settings, values, str(path), values_name=name, values=given)


def read_set(name: str) -> dict[str, Any]:
    """`values` and `held_cells` of Settings from a set of `SETS`, or a TOML file.

    Raises InputError.
    """
    if name == DEFAULT:
        return {}
    path = Path(name) if name.endswith(".toml") else SETS / f"{name}.toml"
    try:
        tables = parse_toml(file_text(path), str(path))
    except OSError:
        names = ", ".join([DEFAULT, *sorted(p.stem for p in SETS.glob("*.toml"))])
        raise InputError(
            f"there is no set of values {name!r}", "--set", f"choose one of {names}, or give a TOML file"
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(f"the set of values is no TOML: {error}", str(path), "correct that line") from error
    values, held_cells = tables.get("values", {}), tables.get("held_cells", 0.0)
    if set(tables) - {"values", "held_cells"} or not isinstance(values, dict):
        raise InputError("a set has held_cells and a table [values]", str(path), "leave out what else it has")
    if isinstance(held_cells, bool) or not isinstance(held_cells, int | float):
        raise InputError(f"held_cells = {held_cells!r} is not a number", str(path), "give a number of cells")
    return {"values": values, "held_cells": float(held_cells)}
