"""Materials: figures with source and confidence, and a law for simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.assets import asset_file, asset_names
from ..design.declared_laws import wall_laws, wall_parameters
from ..design.parameters import HIGHEST_POISSON
from ..design.quantity import in_kPa
from ..design.wall_material import DEFAULT, Wall, require_used
from ..errors import InputError
from ..fem import laws
from ..reading import text_in
from ..toml_reader import TomlTable, parsed_toml
from ..toml_writer import toml_text, toml_value
from .coupon import MODES
from .law_forms import with_bulk
from .stability import Stability, check_stability, whole_ranges

if TYPE_CHECKING:
    from ..design.parameters import Unit

FORMAT = 1
CONFIDENCE = ("datasheet", "measured", "fitted", "second hand", "derived", "assumed")

# Of a resin by its name: elastic, and no mere part of a material.
LAWS: dict[str, Any] = {law.name: law for law in laws.LAWS.values() if law.whole and not law.history}
# The quantities a file may give, with the unit each is in.
QUANTITIES = {
    "density": "g/ml",
    "strength": "MPa",
    "elongation": "%",
    "hardness": "Shore A",
    "tear_strength": "kN/m",
    "modulus": "MPa",
    "poisson": "",
    "yeoh_c1": "MPa",
}
_VALUE = ("value", "low", "high", "unit", "confidence", "source")
_POINT = ("mode", "strain", "stress_MPa", "confidence", "source")
_LAW = ("name", "parameters", "low95", "high95", "confidence", "source", "ranges", "fails")
_KEYS: dict[str, Sequence[str]] = {"": ("format", "name", "about", "point"), "law": _LAW}
_KEYS |= dict.fromkeys(QUANTITIES, _VALUE)
# Of a unit's [wall] what no elastic law has; that law's shape is [law]'s.
_SHAPES = [name for key, law in wall_laws().items() if not law.memory for name in wall_parameters(key)]
_WALL = tuple(f.name for f in attrs.fields(Wall) if f.name not in _SHAPES)
_KEYS["wall"] = (*_WALL, "confidence", "source")


@attrs.frozen
class Value:
    """A figure of a material in `unit`, with its source and confidence; low and high bound it where known."""

    name: str
    value: float
    unit: str
    confidence: str
    source: str
    low: float | None = None
    high: float | None = None


@attrs.frozen
class StressPoint:
    """Nominal stress in MPa at a nominal strain, without unit, tension positive, in a mode of `coupon`."""

    mode: str
    strain: float
    stress_MPa: float
    confidence: str
    source: str


@attrs.frozen(eq=False)
class Material:
    """A material: figures by name, points of its stress-strain curve, a law with its row of parameters (p,).

    ranges: lowest and highest stretch, by mode, of the data that the law was fitted to or is meant for;
    fails: modes that it predicts badly; low95, high95: 95 % intervals of fitted parameters. wall: behaviour
    of a unit's wall of this resin beyond the elastic law.
    """

    name: str
    about: str
    values: Mapping[str, Value]
    points: tuple[StressPoint, ...]
    law: Any
    parameters: Array
    law_confidence: str
    law_source: str
    ranges: Mapping[str, tuple[float, float]]
    fails: tuple[str, ...] = ()
    low95: Mapping[str, float] = attrs.field(factory=dict)
    high95: Mapping[str, float] = attrs.field(factory=dict)
    wall: Wall = attrs.field(factory=Wall)
    wall_confidence: str = ""
    wall_source: str = ""

    @property
    def density_g_per_ml(self) -> float:
        """Density in g/ml. Raises InputError where none is given."""
        if "density" not in self.values:
            raise InputError(
                f"{self.name} has no density", "[density]", "weigh a solid body of known volume and add it"
            )
        return self.values["density"].value

    @property
    def modulus_MPa(self) -> float:
        """Young's modulus in MPa of the law at small strain, 9 kappa mu/(3 kappa + mu)."""
        mu, kappa = self.law.small_strain(self.parameters[None])[0]
        return float(9 * kappa * mu / (3 * kappa + mu))

    @property
    def poisson(self) -> float:
        """Poisson's ratio of the law at small strain, (3 kappa - 2 mu)/(6 kappa + 2 mu)."""
        mu, kappa = self.law.small_strain(self.parameters[None])[0]
        return float((3 * kappa - 2 * mu) / (6 * kappa + 2 * mu))

    @cached_property
    def stability(self) -> tuple[Stability, ...]:
        """Stability of the law over its range in every mode; modes without a range as in `whole_ranges`.

        Raises InputError and ConvergenceError as `check_stability` does.
        """
        checked = whole_ranges(self.ranges)
        return tuple(
            check_stability(self.law, self.parameters, mode, *span) for mode, span in checked.items()
        )

    def require_stable(self) -> None:
        """Raise InputError where the law is unstable within its range."""
        for s in self.stability:
            if s.unstable_at is not None:
                raise InputError(
                    f"{self.name}: the {self.law.name} law is unstable {s.where()}",
                    "[law]",
                    "choose another law, or restrict its range to the strains that occur",
                )

    def in_unit(self, unit: Unit) -> Unit:
        """The unit with the moduli (kPa), law, memory and elongation of this material, else unchanged.

        Raises InputError for a law that is not offered for walls, or not together with the memory of [wall],
        for a Poisson's ratio above HIGHEST_POISSON, and where the law is unstable.
        """
        offered, own = wall_laws(), self.law.name.lower()
        law = own if self.wall.law == DEFAULT else self.wall.law
        if own not in offered or own not in (DEFAULT, law, offered[law].builds_on.lower()):
            raise InputError(
                f"a unit's wall cannot have the {self.law.name} law of {self.name}",
                "[law]",
                "fit Yeoh's law: fit-material --laws yeoh",
            )
        self.require_stable()
        # Twelve digits of a ratio survive the way over kappa.
        poisson = round(self.poisson, 12)
        if poisson > HIGHEST_POISSON:
            # Its four digits must not lead above the bound.
            most = with_bulk(self.law, self.parameters, HIGHEST_POISSON - 1e-5)[self.law.bulk]
            raise InputError(
                f"{self.name} has Poisson's ratio {poisson:.6g}, a wall takes {HIGHEST_POISSON:g} at most",
                "[law] parameters",
                f"write kappa_MPa = {most:.4g}, or {HIGHEST_POISSON:g} in [poisson]",
            )
        shape = self.law.wall_of_row(self.parameters.tolist())
        wall = attrs.evolve(self.wall, **{"law": law, **shape})
        material = attrs.evolve(
            unit.material, membrane_modulus_kPa=in_kPa(self.modulus_MPa), membrane_poisson=poisson
        )
        if "elongation" in self.values:
            material = attrs.evolve(material, elongation_at_break=self.values["elongation"].value / 100.0)
        return attrs.evolve(unit, material=material, wall=wall)


def material_names() -> list[str]:
    """Sorted names of the shipped materials. Raises InputError where the folder of assets is missing."""
    return asset_names("materials")


def load_material(name: str) -> Material:
    """The shipped material of this name. Raises InputError, which lists the valid names."""
    return read_material(asset_file("materials", "material", name))


def read_material(path: str | Path) -> Material:
    """The material in a TOML file. Raises InputError with file, line and key."""
    remedy = f"shipped materials: {', '.join(material_names())}"
    return parse_material(text_in(path, "file", remedy), str(path))


def parse_material(text: str, origin: str = "") -> Material:
    """The material in TOML text; origin: name of the file, for messages.

    Raises InputError with `origin`, line and key.
    """
    document = parsed_toml(text, origin).only_tables(_KEYS).of_format(FORMAT)
    values = {name: _value(document.inner(name)) for name in QUANTITIES if name in document}
    if "law" not in document:
        raise InputError(
            "there is no [law]", origin or "TOML text", 'add [law] with its name, such as "neo-Hooke"'
        )
    return Material(
        name=document.word("name"),
        about=document.word("about", default=""),
        values=values,
        points=tuple(_point(table) for table in document.tables("point")),
        **_law(document.inner("law"), values),
        **(_wall(document.inner("wall")) if "wall" in document else {}),
    )


def _value(table: TomlTable) -> Value:
    name, unit = table.name, table.values.get("unit")
    if unit != QUANTITIES[name]:
        raise InputError(f"{name} is in {unit!r}", table.at("unit"), f"give it in {QUANTITIES[name]!r}")
    bounds = (-1.0, 0.5) if name == "poisson" else (0.0, 1e6)
    value = table.number("value", *bounds)
    span = {key: table.number(key, *bounds) for key in ("low", "high") if key in table}
    if not span.get("low", value) <= value <= span.get("high", value):
        what = f"{name} = {value:g} does not lie between its low and high"
        raise InputError(what, table.at("value"), "correct one")
    return Value(name, value, unit, table.word("confidence", CONFIDENCE), table.word("source"), **span)


def _point(table: TomlTable) -> StressPoint:
    table.only(_POINT)
    return StressPoint(
        table.word("mode", MODES),
        table.number("strain", -0.99, 20.0),
        table.number("stress_MPa", -1e6, 1e6),
        table.word("confidence", CONFIDENCE),
        table.word("source"),
    )


def _law(table: TomlTable, values: Mapping[str, Value]) -> dict[str, Any]:
    law = LAWS[table.word("name", tuple(LAWS))]
    if "parameters" in table:
        given = table.inner("parameters").only(law.parameter_names)
        row = np.array([given.number(name, -1e9, 1e9) for name in law.parameter_names])
    elif law is laws.NeoHooke and {"modulus", "poisson"} <= set(values):
        row = law.parameters(values["modulus"].value, values["poisson"].value)[0]
    else:
        raise InputError(
            f"the {law.name} law has no parameters",
            table.at("parameters"),
            f"give parameters = {{ {', '.join(f'{name} = ...' for name in law.parameter_names)} }}"
            + (", or [modulus] and [poisson]" if law is laws.NeoHooke else ""),
        )
    try:
        law.valid(row[None])
    except InputError as error:
        raise InputError(error.what, table.at("parameters"), error.remedy) from error
    intervals = {key: table.inner(key).only(law.parameter_names) for key in ("low95", "high95")}
    return {
        "law": law,
        "parameters": row,
        "law_confidence": table.word("confidence", CONFIDENCE),
        "law_source": table.word("source"),
        "ranges": _ranges(table),
        "fails": table.words("fails", MODES),
        **{key: {name: t.number(name, -1e30, 1e30) for name in t.values} for key, t in intervals.items()},
    }


def _wall(table: TomlTable) -> dict[str, Any]:
    given = {name: value for name, value in table.values.items() if name in _WALL}
    with table.located():
        wall = Wall(**given)
        require_used(wall, given)
    return {
        "wall": wall,
        "wall_confidence": table.word("confidence", CONFIDENCE),
        "wall_source": table.word("source"),
    }


def _ranges(table: TomlTable) -> dict[str, tuple[float, float]]:
    ranges: dict[str, tuple[float, float]] = table.take("ranges", dict[str, tuple[float, float]], {})
    where = table.at("ranges")
    remedy = "give the stretches it is valid for, such as { uniaxial = [0.7, 1.5] }"
    if not ranges or not set(ranges) <= set(MODES):
        raise InputError(f"ranges = {ranges!r} does not name modes", where, remedy)
    for mode, (low, high) in ranges.items():
        if not 0 < low <= 1 <= high or low == high:
            what = f"the range of {mode}, {[low, high]}, does not go from above 0 up to 1 and from 1 on"
            raise InputError(what, where, remedy)
    return ranges


def material_text(material: Material, head: str = "") -> str:
    """A material as TOML text, below the lines of `head` as comments; floats keep every digit."""
    figures = {v.name: {key: getattr(v, key) for key in _VALUE} for v in material.values.values()}
    about = material.about or None
    text = toml_text({"format": FORMAT, "name": material.name, "about": about, **figures}, head)
    for point in material.points:
        text += "\n[[point]]\n" + toml_text({key: getattr(point, key) for key in _POINT})
    law = {
        "name": material.law.name,
        "parameters": dict(zip(material.law.parameter_names, material.parameters.tolist(), strict=True)),
        "low95": material.low95,
        "high95": material.high95,
        "confidence": material.law_confidence,
        "source": material.law_source,
        "ranges": material.ranges,
        "fails": material.fails,
    }
    # Its tables stand on one line each.
    lines = [f"{key} = {toml_value(value)}\n" for key, value in law.items() if value not in ({}, ())]
    text += "\n[law]\n" + "".join(lines)
    wall = {name: getattr(material.wall, name) for name in material.wall.names if name in _WALL}
    if wall:
        wall |= {"confidence": material.wall_confidence, "source": material.wall_source}
        text += "\n" + toml_text({"wall": wall})
    return text
