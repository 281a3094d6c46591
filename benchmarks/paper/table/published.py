"""What the paper prints, from assets/paper: its Table I, its measured moduli and its bending ranges."""

from __future__ import annotations

import csv
from typing import Any

import attrs
import numpy as np

from mu_addon.design.assets import asset_root
from mu_addon.errors import InputError
from mu_addon.reading import file_text, parse_toml
from mu_addon.report.results import Path

Array = np.ndarray[Any, Any]

FOLDER = "paper"
TABLE, MEASURED = "table1_deviation_mm.csv", "measured.toml"
GRIPPER = "gripper"


@attrs.frozen(eq=False)
class Published:
    """The paper's figures.

    J_hat: Table I, a column of ten paths in mm by scale, and by "gripper" the gripper's. modulus_kPa: of
    the lattice by scale. bending_deg: the ends of the angle's range, at the least and the most of
    bending_kPa, by scale.
    """

    paths: tuple[Path, ...]
    J_hat: dict[str, Array]
    modulus_kPa: dict[float, float]
    bending_deg: dict[float, tuple[float, float]]
    bending_kPa: tuple[float, float] = (-20.0, 50.0)

    @property
    def scales(self) -> tuple[float, ...]:
        """0.75, 1 and 1.5."""
        return tuple(self.modulus_kPa)

    def like(self, name: str) -> Array:
        """Table I's column (10,) in mm that one of ours is set beside: "gripper" for "gripper, 25 mm"."""
        return self.J_hat[name.partition(",")[0]]

    def table_column(self, scale: float) -> Array:
        """Table I's column (10,) in mm of a scale."""
        return self.J_hat[name_of(scale)]


def name_of(scale: float) -> str:
    """A column's name: "0.75x"."""
    return f"{scale:.3g}x" if scale != int(scale) else f"{scale:.1f}x"


def published() -> Published:
    """The figures that come with the package. Raises InputError where they are missing or damaged."""
    folder = asset_root() / FOLDER
    try:
        lines = file_text(folder / TABLE).splitlines()
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        measured = parse_toml(file_text(folder / MEASURED), str(folder / MEASURED))
        paths = tuple(Path(r["path"], int(r["start"]), int(r["length"])) for r in rows)
        modulus = {float(s): float(mean) for s, (mean, _) in measured["lattice_modulus_kPa"].items()}
        bending = {float(s): (float(a), float(b)) for s, (a, b) in measured["bending_angle_deg"].items()}
        columns = {name_of(s): f"scale_{s:.2f}" for s in modulus} | {GRIPPER: GRIPPER}
        J_hat = {name: np.array([float(r[key]) for r in rows]) for name, key in columns.items()}
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(
            f"the paper's figures cannot be read: {error}", str(folder), "install the whole extension"
        ) from error
    return Published(paths, J_hat, modulus, bending)
