"""design.toml: a unit, what it shall do, what of it is free, and how the search goes about it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs

from ..design.anchors import windows
from ..design.parameters import Unit, load_preset, read_unit, to_toml
from ..design.printing.printer import DEFAULT, load_printer
from ..design.toml_text import nearest
from ..errors import InputError
from ..materials.library import Material, load_material, material_text, read_material
from ..meshing.settings import FIDELITIES, HOMOGENISED, MeshSettings
from ..reading import parse_toml
from ..toml_writer import toml_text
from .freedoms import UNSEEN, Freedom, changed_unit, fixed_values, read_freedoms
from .search import SearchSettings
from .targets import Supplies, Target, read_targets
from .uncertainty import Uncertainty

FORMAT = 1
UNIT, RESIN = "unit.toml", "resin.toml"
HEADER = "# The inputs of this optimisation; unit.toml beside it is the unit that it starts from."
_KEYS = (
    "format", "preset", "unit", "fidelity", "refine", "check_refine", "evaluations", "batch", "seed", "resin",
    "printer", "print_tolerance_mm", "modulus_tolerance", "target", "freedom", "run",
    "orientation_deg", "robust", "check_fidelity",
)  # fmt: skip
# A finer mesh for what is proposed, over the search's.
FINER = 1.5


@attrs.frozen
class Design:
    """What design.toml says.

    unit: where the search starts, with fixed values in it; check_refine: of the mesh that proposed units are
    simulated on again; print_tolerance_mm, modulus_tolerance: standard errors of a print's surfaces, and of
    the resin's modulus as a share of it, for the uncertainty of what is proposed. document: the file's own
    tables; material: the resin's, for density and elongation at break. orientation_deg: in which the unit
    bears its weight, 0 hanging, tip down, turned about x; None: without weight. robust:
    whether the search asks for what is met within the uncertainty. check_struts: whether what is proposed is
    simulated strut by strut besides.
    """

    unit: Unit
    targets: tuple[Target, ...]
    freedoms: tuple[Freedom, ...]
    settings: MeshSettings
    check_refine: float
    search: SearchSettings
    printer: str
    resin: str
    print_tolerance_mm: float
    modulus_tolerance: float
    document: Mapping[str, Any]
    material: Material
    orientation_deg: float | None = None
    robust: bool = False
    check_struts: bool = False

    @property
    def uncertainty(self) -> Uncertainty:
        """What differs from print to print."""
        return Uncertainty(self.print_tolerance_mm, self.modulus_tolerance)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; the unit lies beside, with fixed values in it.

        So does a resin that is a file of the user's.
        """
        tables = {key: v for key, v in self.document.items() if key not in ("preset", "unit", "run")}
        tables["unit"] = UNIT
        beside = {UNIT: to_toml(self.unit)}
        if self.resin.endswith(".toml"):
            tables["resin"] = RESIN
            beside[RESIN] = material_text(self.material)
        return {"design.toml": toml_text(tables, HEADER), **beside}

    @property
    def start(self) -> tuple[Any, ...]:
        """The unit's own values of the freedoms."""
        return tuple(f.value_of(self.unit) for f in self.freedoms)

    def unit_of(self, design: tuple[Any, ...]) -> Unit:
        """The unit with values of the freedoms; raises InputError where it breaks a rule."""
        return changed_unit(self.unit, self.freedoms, design)


def read_design(path: Path, text: str, unit: Unit | None = None) -> Design:
    """The design of a file's text, see `parse_design`; raises InputError with file, line and key."""
    return parse_design(text, str(path), unit, path.parent)


def parse_design(
    text: str,
    origin: str,
    unit: Unit | None = None,
    folder: Path | None = None,
    material: Material | None = None,
) -> Design:
    """The design in TOML text; raises InputError with file, line and key.

    unit, material: in place of those that the text names; folder: where its files lie.
    """
    with located_keys(text):
        return _design(text, origin, unit, folder, material)


@contextmanager
def located_keys(text: str) -> Iterator[None]:
    """Context that replaces the line of a table by that of its key, where an InputError names both."""
    try:
        yield
    except InputError as error:
        match = re.fullmatch(r"(.*, line )(\d+)(, (\w+))", error.where)
        if match is None:
            raise
        line = int(match[2])
        rest = text.splitlines()[line:]
        for number, row in enumerate(rest, line + 1):
            if re.match(r"\s*\[", row):
                break
            if re.match(rf"\s*{match[4]}\s*=", row):
                raise InputError(error.what, f"{match[1]}{number}{match[3]}", error.remedy) from error
        raise


def _design(
    text: str, origin: str, unit: Unit | None, folder: Path | None, material: Material | None
) -> Design:
    document = parse_toml(text, origin)
    for key in document:
        if key not in _KEYS:
            raise InputError(
                f"unknown key {key!r}{nearest(key, _KEYS)}",
                f"{origin}, {_line(text, key)}, {key}",
                f"known: {', '.join(_KEYS)}",
            )
    if document.get("format") != FORMAT or isinstance(document.get("format"), bool):
        raise InputError(
            f"format = {document.get('format', 'missing')}", f"{origin}, format", f"write format = {FORMAT}"
        )
    tables = {key: _tables(document, key, origin) for key in ("target", "freedom")}
    where = {key: _places(text, key, origin, len(rows)) for key, rows in tables.items()}
    number = _Numbers(document, text, origin)
    base = unit or _unit(document, origin, folder or Path())
    fixed = fixed_values(tables["freedom"], where["freedom"])
    base = changed_unit(base, [Freedom(name) for name in fixed], list(fixed.values()))
    freedoms = read_freedoms(tables["freedom"], where["freedom"], base)
    settings = MeshSettings(
        refine=number("refine", 0.5, 0.2, 8.0),
        fidelity=_word(document, "fidelity", HOMOGENISED, origin, FIDELITIES),
    )
    resin, printer = (
        _word(document, "resin", "elastic-50a-v1", origin),
        _word(document, "printer", DEFAULT, origin),
    )
    if material is None:
        own = resin.endswith(".toml")
        material = read_material((folder or Path()) / resin) if own else load_material(resin)
    if "elongation" not in material.values:
        raise InputError(
            f"{resin} has no elongation at break", f"{origin}, resin", "add [elongation] to its file"
        )
    counts = [v for f in freedoms if f.name == "chambers.count" for v in f.values] or [base.chambers.count]
    turned = number("orientation_deg", 0.0, -360.0, 360.0) if "orientation_deg" in document else None
    targets = read_targets(
        tables["target"],
        where["target"],
        Supplies(
            material.values["elongation"].value / 100.0,
            material.density_g_per_ml,
            load_printer(printer),
            [w.name for w in windows(min(counts))],
            turned is not None,
        ),
    )
    if not settings.resolved:
        _require_homogenised(freedoms, targets, tables["freedom"], where["freedom"])
    search = SearchSettings(
        evaluations=int(number("evaluations", 40, 1, 100_000, whole=True)),
        batch=int(number("batch", 1, 1, 256, whole=True)),
        seed=int(number("seed", 0, 0, 2**31, whole=True)),
    )
    return Design(
        base, tuple(targets), tuple(freedoms), settings,
        number("check_refine", min(FINER * settings.refine, 8.0), 0.2, 8.0), search, printer, resin,
        number("print_tolerance_mm", 0.05, 0.0, 0.3), number("modulus_tolerance", 0.1, 0.0, 1.0), document,
        material, turned, _flag(document, "robust", text, origin),
        not settings.resolved
        and _word(document, "check_fidelity", HOMOGENISED, origin, FIDELITIES) != HOMOGENISED,
    )  # fmt: skip


def _require_homogenised(
    freedoms: list[Freedom], targets: list[Target], tables: list[dict[str, Any]], where: list[str]
) -> None:
    """Raise InputError for what a homogenised lattice has no struts for."""
    places = {table.get("parameter"): place for table, place in zip(tables, where, strict=True)}
    for freedom in freedoms:
        if freedom.name in UNSEEN:
            raise InputError(
                f"the homogenised lattice does not see {freedom.name}: its modulus is a parameter",
                places.get(freedom.name, freedom.name),
                'free material.lattice_modulus_kPa instead, or write fidelity = "resolved"',
            )
    for target in targets:
        if getattr(target.quantity, "region", "") == "struts":
            raise InputError(
                "a homogenised lattice has no struts to stretch", f"{target.line}, region",
                'write fidelity = "resolved"',
            )  # fmt: skip


def _unit(document: Mapping[str, Any], origin: str, folder: Path) -> Unit:
    if ("preset" in document) == ("unit" in document):
        raise InputError(
            "no unit is given, or two", origin, 'write preset = "mu-1.0x" or unit = "my-unit.toml"'
        )
    if "preset" in document:
        return load_preset(_word(document, "preset", "", origin))
    return read_unit(folder / _word(document, "unit", "", origin))


def _tables(document: Mapping[str, Any], key: str, origin: str) -> list[dict[str, Any]]:
    found = document.get(key, [])
    if not isinstance(found, list) or not all(isinstance(table, dict) for table in found):
        raise InputError(f"{key} is not a list of tables", f"{origin}, {key}", f"begin each with [[{key}]]")
    return found


def _places(text: str, key: str, origin: str, count: int) -> list[str]:
    """File and line of each [[key]]; of the file alone where the tables are written otherwise."""
    lines = [n for n, line in enumerate(text.splitlines(), 1) if re.match(rf"\s*\[\[\s*{key}\s*\]\]", line)]
    if len(lines) != count:
        return [f"{origin}, {key} {number}" for number in range(1, count + 1)]
    return [f"{origin}, line {line}" for line in lines]


def _line(text: str, key: str) -> str:
    for number, line in enumerate(text.splitlines(), 1):
        if re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", line):
            return f"line {number}"
    return "line ?"


def _word(
    document: Mapping[str, Any], key: str, default: str, origin: str, allowed: tuple[str, ...] = ()
) -> str:
    found = document.get(key, default)
    if not isinstance(found, str) or (allowed and found not in allowed):
        words = f"one of: {', '.join(allowed)}" if allowed else "write it in quotes"
        raise InputError(f"{key} = {found!r} is not offered", f"{origin}, {key}", words)
    return found


def _flag(document: Mapping[str, Any], key: str, text: str, origin: str) -> bool:
    found = document.get(key, False)
    if not isinstance(found, bool):
        raise InputError(
            f"{key} = {found!r} is neither true nor false",
            f"{origin}, {_line(text, key)}, {key}",
            "write true or false",
        )
    return found


@attrs.frozen
class _Numbers:
    document: Mapping[str, Any]
    text: str
    origin: str

    def __call__(self, key: str, default: float, low: float, high: float, whole: bool = False) -> float:
        found = self.document.get(key, default)
        kinds = int if whole else (int, float)
        if isinstance(found, bool) or not isinstance(found, kinds) or not low <= found <= high:
            raise InputError(
                f"{key} = {found!r} is out of bounds",
                f"{self.origin}, {_line(self.text, key)}, {key}",
                f"give {'a whole number' if whole else 'a number'} from {low:g} to {high:g}",
            )
        return found
