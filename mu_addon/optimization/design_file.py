"""design.toml: a unit, its targets, its free parameters, and settings of the search."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from ..design.anchors import windows
from ..design.body import Body, envelope, read_body
from ..design.parameters import Unit, load_preset, read_unit, to_toml
from ..design.printing.printer import DEFAULT, load_printer
from ..design.settings import ORIENTATION, USUAL_RESIN
from ..errors import InputError
from ..materials.library import Material, load_material, material_text, read_material
from ..meshing.settings import MeshSettings
from ..reading import text_in
from ..toml_reader import TomlTable, parsed_toml
from ..toml_writer import toml_text
from . import settings as settings_of
from .freedoms import PATH, Freedom, changed_unit, not_fixed, read_freedoms, with_fixed
from .freedoms import RESIN as RESIN_FREEDOM
from .quantities import Stretch
from .search import SearchSettings
from .settings import BODY, DESIGN, FINER, HEADER, RESIN, UNIT
from .targets import Supplies, Target, read_targets
from .uncertainty import Uncertainty
from .unit_quantities import Mass

FORMAT = 1
_KEYS = (
    "format", "preset", "unit", "refine", "check_refine", "evaluations", "batch", "seed", "resin",
    "printer", "print_tolerance_mm", "modulus_tolerance", "target", "freedom", "run",
    "orientation_deg", "robust", "self_contact", "body",
)  # fmt: skip


@attrs.frozen
class Design:
    """Contents of design.toml.

    unit: where the search starts, with fixed values in it; check_refine: of the mesh for the check of
    proposed units; print_tolerance_mm, modulus_tolerance: standard errors of a print's surfaces, and of the
    resin's modulus as a share of it, for the proposals' uncertainty. document: the file's own tables;
    material: the resin's, for density and elongation at break. orientation_deg: of the unit under its weight,
    0 hanging, tip down, turned about x; None: without weight. robust: targets must be met within the
    uncertainty. materials: choices of the freedom `resin`, by name; body: a closed surface in place of the
    lattice's box, in the unit's frame; self_contact: of walls and struts.
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
    robust: bool = settings_of.ROBUST.default
    materials: Mapping[str, Material] = attrs.field(factory=dict)
    body: Body | None = None
    self_contact: bool = settings_of.SELF_CONTACT.default

    @property
    def uncertainty(self) -> Uncertainty:
        """Scatter from print to print."""
        return Uncertainty(self.print_tolerance_mm, self.modulus_tolerance)

    @property
    def judged(self) -> list[Target]:
        """Targets with a quantity."""
        return [t for t in self.targets if t.quantity is not None]

    @property
    def bare(self) -> Design:
        """The design without its file."""
        targets = tuple(attrs.evolve(t, line="") for t in self.targets)
        return attrs.evolve(self, targets=targets, document={})

    @property
    def simulated(self) -> Design:
        """The design with what decides the values of its units alone: no bound, goal, search or check."""
        asked = tuple(Target("", "", "", t.quantity) for t in self.targets)
        scatter = (self.print_tolerance_mm, self.modulus_tolerance) if self.robust else (0.0, 0.0)
        return attrs.evolve(
            self, unit=attrs.evolve(self.unit, name="unit"), targets=asked, settings=MeshSettings(),
            check_refine=0.0, search=SearchSettings(), printer="", resin="", document={},
            print_tolerance_mm=scatter[0], modulus_tolerance=scatter[1],
        )  # fmt: skip

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; the unit's is separate, with fixed values in it.

        Likewise a user's resin file.
        """
        tables = {key: v for key, v in self.document.items() if key not in ("preset", "unit", "run")}
        tables["unit"] = UNIT
        beside = {UNIT: to_toml(self.unit)}
        if self.resin.endswith(".toml"):
            tables["resin"] = RESIN
            beside[RESIN] = material_text(self.material)
        files = [name for name in self.materials if name.endswith(".toml")]
        renamed = {
            name: RESIN if name == self.resin else f"resin-{n}.toml" for n, name in enumerate(files, 1)
        }
        beside |= {renamed[name]: material_text(self.materials[name]) for name in files}
        if files:
            tables["freedom"] = [
                {**table, "values": [renamed.get(v, v) for v in table["values"]]}
                if table["parameter"] == RESIN_FREEDOM
                else table
                for table in tables["freedom"]
            ]
        if self.body is not None:
            tables["body"] = BODY
            beside[BODY] = self.body.text()
        return {DESIGN: toml_text(tables, HEADER), **beside}

    @property
    def start(self) -> tuple[Any, ...]:
        """The unit's values of the freedoms; for path and resin those of the file, or the first."""
        return tuple(
            f.value_of(self.unit)
            if f.is_of_unit
            else self.resin
            if f.name == RESIN_FREEDOM and self.resin in f.values
            else f.values[0]
            for f in self.freedoms
        )

    def unit_of(self, design: tuple[Any, ...]) -> Unit:
        """The unit with values of the freedoms; raises InputError where it breaks a rule, or leaves its body.

        With another resin it has that one's modulus; a free modulus has priority.
        """
        own = [(f, v) for f, v in zip(self.freedoms, design, strict=True) if f.is_of_unit]
        material = self.chosen(self.choice(design)).material
        unit = self.unit if material is self.material else material.in_unit(self.unit)
        found = changed_unit(unit, [f for f, _ in own], [v for _, v in own])
        if self.body is not None:
            envelope(self.body, found.dimensions)
        return found

    def choice(self, design: tuple[Any, ...]) -> dict[str, str]:
        """Path and resin among a design's values, as far as they are free, by the freedom's name."""
        return {f.name: v for f, v in zip(self.freedoms, design, strict=True) if not f.is_of_unit}

    def chosen(self, choice: Mapping[str, str]) -> Design:
        """The same design of a path and a resin of `choice`, in its targets and its weight."""
        material = self.materials[choice[RESIN_FREEDOM]] if RESIN_FREEDOM in choice else self.material
        targets = tuple(
            t
            if t.quantity is None
            else attrs.evolve(t, quantity=_as_chosen(t.quantity, choice.get(PATH, ""), material))
            for t in self.targets
        )
        return attrs.evolve(self, targets=targets, material=material)


def _as_chosen(quantity: Any, path: str, material: Material) -> Any:
    """A quantity with the chosen path and the chosen resin's density or elongation."""
    if path and getattr(quantity, "path", None) == "":
        quantity = attrs.evolve(quantity, path=path)
    if isinstance(quantity, Mass):
        return attrs.evolve(quantity, density_g_per_ml=material.density_g_per_ml)
    if isinstance(quantity, Stretch) and quantity.elongation is not None:
        return attrs.evolve(quantity, elongation=_elongation(material))
    return quantity


def _elongation(material: Material) -> float:
    """Elongation at break as a ratio; raises InputError where a resin's file has none."""
    if "elongation" not in material.values:
        raise InputError(
            f"{material.name} has no elongation at break", "resin", "add [elongation] to its file"
        )
    return material.values["elongation"].value / 100.0


def read_design(path: Path, unit: Unit | None = None, body: Body | None = None) -> Design:
    """The design of a file, see `parse_design`; raises InputError with file, line and key."""
    text = text_in(path, "design", "give the path of a design.toml")
    return parse_design(text, str(path), unit, path.parent, body)


def parse_design(
    text: str,
    origin: str,
    unit: Unit | None = None,
    folder: Path = Path(),
    body: Body | None = None,
) -> Design:
    """The design in TOML text; raises InputError with file, line and key.

    unit, body: replace those that the text names; folder: of its files.
    """
    document = parsed_toml(text, origin).only(_KEYS).of_format(FORMAT)
    number, asked, free = document.setting, document.tables("target"), document.tables("freedom")
    base = with_fixed(unit or _unit(document, folder), free)
    freedoms = read_freedoms(free, base)
    resin, printer = document.word("resin", default=USUAL_RESIN), document.word("printer", default=DEFAULT)
    material = _material(resin, folder, document.at("resin"))
    choices = {f.name: (f.values, table) for f, table in zip(freedoms, not_fixed(free), strict=True)}
    names, resins = choices.get(RESIN_FREEDOM, ((), document))
    materials = {
        name: material if name == resin else _material(name, folder, resins.at("values")) for name in names
    }
    if body is None and "body" in document:
        body = read_body(folder / document.word("body"))
    paths = [w.name for w in windows(min(choices.get("chambers.count", ([base.chambers.count],))[0]))]
    turned = number(ORIENTATION) if "orientation_deg" in document else None
    targets = read_targets(
        asked,
        Supplies(
            _elongation(material),
            material.density_g_per_ml,
            load_printer(printer),
            paths,
            turned is not None,
            PATH in choices,
            body,
        ),
    )
    named, table = choices.get(PATH, ((), document))
    for path in named:
        if path not in paths:
            what = f"{path!r} is not a path of the unit"
            raise InputError(what, table.at("values"), f"of: {', '.join(paths)}")
    settings = MeshSettings(refine=number(settings_of.REFINE))
    search = SearchSettings(
        *(number(d) for d in (settings_of.EVALUATIONS, settings_of.BATCH, settings_of.SEED))
    )
    return Design(
        base, tuple(targets), tuple(freedoms), settings,
        number(settings_of.CHECK_REFINE, min(FINER * settings.refine, settings_of.REFINE.high)), search,
        printer, resin,
        number(settings_of.PRINT_TOLERANCE), number(settings_of.MODULUS_TOLERANCE), document.values,
        material, turned, number(settings_of.ROBUST), materials, body,
        number(settings_of.SELF_CONTACT),
    )  # fmt: skip


def _material(name: str, folder: Path, where: str) -> Material:
    """The resin of the library, or in a file; raises InputError."""
    found = read_material(folder / name) if name.endswith(".toml") else load_material(name)
    try:
        _elongation(found)
    except InputError as error:
        raise InputError(error.what, where, error.remedy) from error
    return found


def _unit(document: TomlTable, folder: Path) -> Unit:
    if ("preset" in document) == ("unit" in document):
        raise InputError(
            "no unit is given, or two are",
            document.at(),
            'write preset = "mu-1.0x" or unit = "my-unit.toml"',
        )
    if "preset" in document:
        return load_preset(document.word("preset"))
    return read_unit(folder / document.word("unit"))
