"""effective.toml: results of homogenizing a lattice, and its law for an analysis mesh."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..design.quantity import in_kPa
from ..errors import InputError
from ..fem.lattice_law import LatticeLaw
from ..fem.laws import Foam
from ..files import write_text
from ..reading import text_in
from ..toml_reader import TomlTable, parsed_toml
from ..toml_writer import Commented, toml_text
from .foam_fit import NAME, FoamFit, Misfit, lattice_law, require_stable, stable_pressed, stable_shear

Array = np.ndarray[Any, Any]

FORMAT = 1
_HEAD = "# Effective moduli of a lattice, and a law of its continuum."
# Every key that is read, by its table; those of [cell], [resin] and [provenance] are whatever was written.
_KEYS = {
    "moduli": ("relative_density", "C11_kPa", "C12_kPa", "C44_kPa"),
    "law": ("name", *Foam.parameter_names, "G_MPa", "C_MPa"),
    "fit": (
        "stretch_low",
        "stretch_high",
        "misfit_tension",
        "misfit_compression",
        "misfit_lateral",
    ),
}
_FREE = ("cell", "resin", "provenance")
_DERIVED = "derived"


@attrs.frozen
class Effective:
    """A homogenized lattice: its origin, its moduli at small strain, and its law.

    cell: kind and geometry, with the print's offset; resin; provenance: software, version and hash of the
    inputs, all three tables of text and numbers. relative_density: solid share of the volume; C11, C12, C44
    in kPa, of cubic symmetry. parameters (6,) of Foam, shear_MPa of CubicShear and diagonal_MPa of
    DiagonalStretch act in parallel; stretch is the range of the fit. Raises InputError for moduli that are
    not positive definite, and a law that is not admissible or not stable.
    """

    cell: Mapping[str, str | float]
    resin: Mapping[str, str | float]
    relative_density: float
    C11_kPa: float
    C12_kPa: float
    C44_kPa: float
    parameters: tuple[float, ...]
    shear_MPa: float
    diagonal_MPa: float
    stretch: tuple[float, float]
    misfit: Misfit
    provenance: Mapping[str, str | float] = attrs.field(factory=dict)

    def __attrs_post_init__(self) -> None:
        _require_moduli(self)
        law = self.law
        low, high = self.stretch
        if not 0 < low < 1 < high:
            raise InputError(
                f"a law fitted from stretch {low:g} to {high:g} does not include the undeformed state",
                "[fit] stretch_low, stretch_high",
                "give a range around 1",
            )
        require_stable(law)

    @property
    def law(self) -> LatticeLaw:
        """The law for the analysis mesh; raises InputError where it is not admissible."""
        return lattice_law(np.array(self.parameters), self.shear_MPa, self.diagonal_MPa, self.stretch)

    @property
    def E100_kPa(self) -> float:
        """Young's modulus in kPa along an axis of the cell at small strain."""
        return (self.C11_kPa - self.C12_kPa) * (1 + self.nu100)

    @property
    def nu100(self) -> float:
        """Poisson's ratio under stress along an axis at small strain, C12/(C11 + C12)."""
        return self.C12_kPa / (self.C11_kPa + self.C12_kPa)

    @property
    def E110_kPa(self) -> float:
        """Young's modulus in kPa along the diagonal of a face at small strain."""
        return self._along(1 / 4)

    @property
    def E111_kPa(self) -> float:
        """Young's modulus in kPa along the diagonal of the cell at small strain."""
        return self._along(1 / 3)

    def _along(self, mixed: float) -> float:
        """Young's modulus along a direction n, of n1^2 n2^2 + n2^2 n3^2 + n3^2 n1^2."""
        S44, soft = 1 / self.C44_kPa, 1 / (self.C11_kPa - self.C12_kPa)
        return 1 / (1 / self.E100_kPa - 2 * (soft - S44 / 2) * mixed)

    @property
    def anisotropy(self) -> float:
        """Zener's ratio 2 C44/(C11 - C12): 1 where the lattice is isotropic."""
        return 2 * self.C44_kPa / (self.C11_kPa - self.C12_kPa)

    def text(self) -> str:
        """The text of effective.toml, with units in keys or comments."""
        law: list[float] = [*self.parameters, self.shear_MPa, self.diagonal_MPa]
        misfit = attrs.astuple(self.misfit)
        derived = {
            "E100_kPa": self.E100_kPa,
            "E110_kPa": self.E110_kPa,
            "E111_kPa": self.E111_kPa,
            "nu100": self.nu100,
            "anisotropy": self.anisotropy,
            "stable_shear": stable_shear(self.law),
            "stable_pressed": stable_pressed(self.law),
        }
        tables: dict[str, tuple[str, Mapping[str, Any]]] = {
            "cell": ("The lattice's cell; lengths in mm.", self.cell),
            "resin": ("Solid material of the struts.", self.resin),
            "moduli": (
                "Stiffness of cubic symmetry at small strain.",
                dict(zip(_KEYS["moduli"], (self.relative_density, *self._moduli), strict=True)),
            ),
            "law": (
                "Foam, cubic shear (G) and diagonal stretch (C), in parallel.",
                dict(zip(_KEYS["law"], (NAME, *law), strict=True)),
            ),
            "fit": (
                "Range of stretch of the fit; misfits: root mean square over the largest value on that side.",
                dict(zip(_KEYS["fit"], (*self.stretch, *misfit), strict=True)),
            ),
            _DERIVED: ("Derived from the tables above for the reader; not read back.", derived),
            "provenance": ("Program and inputs that made this file.", self.provenance),
        }
        noted = {name: Commented(rows, (comment,)) for name, (comment, rows) in tables.items()}
        return toml_text({"format": FORMAT, **noted}, _HEAD)

    @property
    def _moduli(self) -> tuple[float, float, float]:
        return self.C11_kPa, self.C12_kPa, self.C44_kPa


def effective(
    fit: FoamFit,
    moduli_MPa: tuple[float, float, float],
    relative_density: float,
    cell: Mapping[str, str | float],
    resin: Mapping[str, str | float],
    inputs: str,
) -> Effective:
    """A homogenized lattice of its fit and its C11, C12 and C44 in MPa.

    relative_density: share of the volume that is solid. cell, resin: text and numbers that describe them;
    inputs: text of all inputs, whose hash the provenance keeps. Raises InputError as `Effective`.
    """
    provenance = {
        "software": "mu_addon",
        "version": _version(),
        "inputs_sha256": hashlib.sha256(inputs.encode()).hexdigest(),
    }
    C11, C12, C44 = (in_kPa(float(c)) for c in moduli_MPa)
    parameters = tuple(float(p) for p in fit.parameters)
    return Effective(
        cell,
        resin,
        float(relative_density),
        C11,
        C12,
        C44,
        parameters,
        float(fit.shear_MPa),
        float(fit.diagonal_MPa),
        fit.stretch,
        fit.misfit,
        provenance,
    )


def write_effective(path: Path, found: Effective) -> None:
    """Write effective.toml; raises OutputError."""
    write_text(path, found.text())


def read_effective(path: str | Path) -> Effective:
    """Read effective.toml.

    Raises InputError where the file cannot be read or is not text, and as `parse_effective`.
    """
    return parse_effective(text_in(path, "lattice's law", "give an effective.toml"), str(path))


def parse_effective(text: str, origin: str = "effective.toml") -> Effective:
    """A homogenized lattice from the text of effective.toml.

    Raises InputError with file and key if the format is unknown, a key is missing, unknown or not a number,
    or the law is inadmissible or unstable.
    """
    document = parsed_toml(text, origin)
    document.of_format(FORMAT, f"give a file of format {FORMAT}, as `run.py homogenize` writes it")
    document.only(("format", _DERIVED, *_KEYS, *_FREE))
    rows = {name: _numbers(document.inner(name), keys) for name, keys in _KEYS.items()}
    law, fit, moduli = rows["law"], rows["fit"], rows["moduli"]
    free = {name: _described(document.inner(name)) for name in _FREE}
    with document.located():
        return Effective(
            cell=free["cell"],
            resin=free["resin"],
            **moduli,
            parameters=tuple(law[name] for name in Foam.parameter_names),
            shear_MPa=law["G_MPa"],
            diagonal_MPa=law["C_MPa"],
            stretch=(fit["stretch_low"], fit["stretch_high"]),
            misfit=Misfit(fit["misfit_tension"], fit["misfit_compression"], fit["misfit_lateral"]),
            provenance=free["provenance"],
        )


def _numbers(table: TomlTable, keys: tuple[str, ...]) -> dict[str, float]:
    """The finite numbers of a table, every one of `keys`, and no other key."""
    table.only(keys)
    if "name" in keys:
        table.word("name", (NAME,))
    return {key: table.number(key) for key in keys if key != "name"}


def _described(table: TomlTable) -> dict[str, str | float]:
    for key, value in table.values.items():
        if not isinstance(value, str | int | float):
            raise InputError(f"{key} is neither a text nor a number", table.at(key), "write one key a line")
    return dict(table.values)


def _require_moduli(found: Effective) -> None:
    """Raise InputError unless the stiffness is positive definite and the density that of an open lattice."""
    C11, C12, C44 = found._moduli
    for name, value in (("C11 - C12", C11 - C12), ("C11 + 2 C12", C11 + 2 * C12), ("C44", C44)):
        if not value > 0:
            raise InputError(
                f"{name} = {value:.6g} kPa must be positive",
                "[moduli]",
                "the moduli are not those of an elastic lattice",
            )
    if not 0 < found.relative_density <= 1:
        raise InputError(
            f"the relative density is {found.relative_density:.6g}",
            "[moduli] relative_density",
            "give a share of the volume, above 0 and up to 1",
        )


def _version() -> str:
    try:
        return metadata.version("mu_addon")
    except metadata.PackageNotFoundError:
        return "not installed as a package"
