"""The parameters of a Monolithic Unit, at scale 1, with unit, bounds and source; TOML in and out."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import attrs

from ..errors import InputError, did_you_mean
from ..files import write_bytes
from ..reading import text_in
from ..toml_reader import parsed_toml
from . import lattice_kinds, rules, toml_text
from .assets import asset_file, asset_names
from .dimensions import Dimensions
from .grading import Field, Grading
from .printed import as_printed
from .quantity import PAPER, Description, Groups, choice, describe, in_MPa, quantity, text_quantity
from .wall_factors import WALLS, factors_by_chamber
from .wall_material import OF_RESIN, Wall, require_used

FORMAT = 1
# Up to here a printed body's angles depend on its mesh as they do at 0.45, in half as much time again.
HIGHEST_POISSON = 0.499


@attrs.frozen
class Chambers:
    """Section [chambers]: the actuator, a bellows of parabolic bladders and necks around z; in mm."""

    section: ClassVar[str] = "chambers"
    advanced: ClassVar[Groups] = {
        "profile": ("bladder_share", "wall_factors"),
        "caps and inlet": (
            "base_cap_mm",
            "tip_cap_mm",
            "inlet_diameter_mm",
            "inlet_length_mm",
            "inlet_wall_mm",
        ),
    }

    count: int = quantity(6, "", 3, 24, "number of chambers in series", PAPER)
    cell_mm: float = quantity(12.5, "mm", 4.0, 60.0, "lattice cell U, which is also the chamber pitch", PAPER)
    bladder_diameter_mm: float = quantity(
        25.0, "mm", 8.0, 120.0, "outer diameter at a bladder's apex, 2U by rule", PAPER
    )
    neck_diameter_mm: float = quantity(
        12.5,
        "mm",
        1.0,
        100.0,
        "outer diameter at a neck",
        "assumed: the paper prints none; one cell, half the bladder, "
        "leaves the corner nodes around the axis (at U/sqrt(2)) outside the membrane",
    )
    bladder_share: float = quantity(
        0.6,
        "",
        0.1,
        0.9,
        "share of the pitch that is bladder, the rest is neck",
        "assumed: the paper prints none; a bladder slightly longer than its neck",
    )
    wall_mm: float = quantity(
        0.9,
        "mm",
        0.1,
        6.0,
        "membrane thickness along the surface normal",
        "assumed: the paper prints none; thinner walls (0.8 mm) touch at 20 kPa of vacuum",
    )
    wall_factors: str = text_quantity(
        "",
        WALLS.canonical,
        'factors on the wall of single chambers, as "chamber: factor; ...", chambers counted from 1 at the '
        "inlet; between two apices the wall goes smoothly from one to the other",
        "assumed: the paper's chambers are alike",
    )
    base_cap_mm: float = quantity(
        1.5,
        "mm",
        0.2,
        20.0,
        "thickness of the flat end at the inlet",
        "assumed: the paper prints none; the minimum strut, stiff against the wall",
    )
    tip_cap_mm: float = quantity(
        5.0,
        "mm",
        0.2,
        20.0,
        "thickness of the flat end at the tip",
        "assumed: the paper prints none; a free end of 1.5 mm snaps inward below 4 kPa of vacuum, 5 mm holds",
    )
    inlet_diameter_mm: float = quantity(
        4.0,
        "mm",
        0.5,
        40.0,
        "bore of the inlet",
        "assumed: the paper prints none; takes a 4 mm tube and drains uncured resin",
    )
    inlet_length_mm: float = quantity(
        6.0,
        "mm",
        0.5,
        60.0,
        "length of the inlet boss below z = 0",
        "assumed: the paper prints none; a seat for the tube, one and a half bores long",
    )
    inlet_wall_mm: float = quantity(
        1.5,
        "mm",
        0.2,
        20.0,
        "wall of the inlet boss",
        "assumed: the paper prints none; the minimum strut",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters in use: `wall_factors` is empty if chambers are equal."""
        fields = (f.name for f in attrs.fields(Chambers))
        return tuple(name for name in fields if name != "wall_factors" or self.wall_factors)


@attrs.frozen
class Envelope:
    """Section [lattice]: kind of cell, numbers of cells around the actuator, and strut diameters in mm."""

    section: ClassVar[str] = "lattice"
    advanced: ClassVar[Groups] = {"custom cell and symmetry": ("struts", "allow_symmetric")}

    kind: str = choice("body-centred", lattice_kinds.names, "kind of lattice cell", PAPER)
    struts: str = text_quantity(
        "",
        lattice_kinds.canonical_text,
        'struts of a custom kind: "x y z to x y z; ...", in cells; no taper after "straight;"',
        "assumed: the paper's cells are body-centred",
    )
    cells_x: int = quantity(
        3,
        "",
        3,
        15,
        "cells across x, odd",
        "assumed: the paper prints none; the fewest that put nodes on both apices",
    )
    cells_y_minus: int = quantity(
        1,
        "",
        1,
        7,
        "cells on the -y side of the axis cell",
        "assumed: the paper prints none; the fewest that put a node on the apex",
    )
    cells_y_plus: int = quantity(
        2,
        "",
        1,
        7,
        "cells on the +y side of the axis cell",
        "assumed: the paper prints none; one more than on -y, so that the unit bends",
    )
    allow_symmetric: bool = quantity(
        False,
        "",
        0,
        1,
        "accept as many cells on -y as on +y: a unit that extends and does not bend",
        "assumed: the paper's units bend",
    )
    junction_diameter_mm: float = quantity(
        1.5, "mm", 0.2, 20.0, "strut diameter at a junction, the minimum", PAPER
    )
    midspan_diameter_mm: float = quantity(
        2.0,
        "mm",
        0.2,
        20.0,
        "strut diameter at mid-span, the maximum",
        "assumed: the paper says wider than the junction and prints none; a third wider",
    )

    def __attrs_post_init__(self) -> None:
        if self.kind == lattice_kinds.CUSTOM and not self.struts:
            raise InputError(
                "a custom lattice has no struts",
                "[lattice] kind",
                'write struts = "...", or kind = "FILE.toml"',
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters in use: `struts` only of a custom kind."""
        fields = (f.name for f in attrs.fields(Envelope))
        return tuple(name for name in fields if name != "struts" or self.kind == lattice_kinds.CUSTOM)


@attrs.frozen
class Waveguide:
    """Section [waveguide]: the optical waveguide along the anchors; in mm, the same at every scale."""

    section: ClassVar[str] = "waveguide"
    advanced: ClassVar[Groups] = {
        "section and wells": (
            "section_mm",
            "well_width_mm",
            "well_depth_mm",
            "end_mm",
            "inclusion_radius_mm",
        ),
        "seats": (
            *("seats", "part_length_mm", "part_width_mm", "part_height_mm"),
            *("seat_clearance_mm", "seat_wall_mm", "cable_mm"),
        ),
    }

    row: int = quantity(
        2,
        "",
        -7,
        7,
        "lattice row j of the anchors, at y = jU",
        "assumed: the paper prints none; the outermost row on the wider side, clear of the bladders",
    )
    section_mm: float = quantity(1.5, "mm", 0.5, 6.0, "side of the square section", PAPER, fixed=True)
    well_width_mm: float = quantity(1.0, "mm", 0.1, 6.0, "width of a well along the path", PAPER, fixed=True)
    well_depth_mm: float = quantity(0.65, "mm", 0.05, 6.0, "depth of a well", PAPER, fixed=True)
    well_pitch_mm: float = quantity(
        3.125,
        "mm",
        0.2,
        20.0,
        "distance between wells",
        "assumed: the paper prints none; it divides U at 0.75x, 1.0x and 1.5x alike, "
        "so that every junction lies midway between two wells",
        fixed=True,
    )
    end_mm: float = quantity(
        2.5,
        "mm",
        0.0,
        20.0,
        "least length beyond each end anchor; longer where a seat has no room",
        "assumed: the paper prints none; carries the end faces clear of the junction, "
        "where light source and detector sit",
        fixed=True,
    )
    seats: bool = quantity(
        True,
        "",
        0,
        1,
        "print a seat for the light source and one for the detector at the waveguide's ends",
        "assumed: the paper says where they are and not how they are held",
    )
    part_length_mm: float = quantity(
        2.0,
        "mm",
        0.5,
        10.0,
        "length of light source and detector, across the waveguide",
        "assumed: the paper names VSMY1850 and VEMT7100X01 and no size; their package, 0805, has 2.0 x 1.25",
        fixed=True,
    )
    part_width_mm: float = quantity(
        1.25,
        "mm",
        0.5,
        10.0,
        "width of light source and detector, across the waveguide",
        "assumed: as for the length",
        fixed=True,
    )
    part_height_mm: float = quantity(
        0.85,
        "mm",
        0.2,
        10.0,
        "height of light source and detector, along the waveguide",
        "assumed: as for the length; 0.85 mm in that package",
        fixed=True,
    )
    seat_clearance_mm: float = quantity(
        0.15,
        "mm",
        0.0,
        2.0,
        "room on every side of a part in its seat",
        "assumed: slips in by hand; less than the overcure found in the paper's lattices would close",
        fixed=True,
    )
    seat_wall_mm: float = quantity(
        0.8,
        "mm",
        0.2,
        5.0,
        "wall of a seat, around the part and before it",
        "assumed: above the 0.6 mm that guidelines ask of unsupported walls",
        fixed=True,
    )
    cable_mm: float = quantity(
        0.8,
        "mm",
        0.2,
        5.0,
        "width of the notch in a seat's wall through which the wires leave",
        "assumed: two enamelled wires of 0.3 mm side by side",
        fixed=True,
    )
    inclusion_radius_mm: float = quantity(
        1.0, "mm", 0.1, 6.0, "radius r_s of the virtual inclusion", PAPER, fixed=True
    )


@attrs.frozen
class Printing:
    """Section [print]: difference of the printed part from the nominal one; in mm, equal at every scale."""

    section: ClassVar[str] = "print"
    advanced: ClassVar[Groups] = {"print offsets": ()}

    offset_xy_mm: float = quantity(
        0.0,
        "mm",
        -0.3,
        0.5,
        "outward move of every surface in the plane when printed (overcure)",
        "assumed: the paper prints none; nominal CAD unless a measurement says otherwise",
        fixed=True,
    )
    offset_z_mm: float = quantity(
        0.0,
        "mm",
        -0.3,
        0.5,
        "outward move of every surface along the build axis z when printed (overcure)",
        "assumed: the paper prints none; nominal CAD unless a measurement says otherwise",
        fixed=True,
    )
    skin_depth_mm: float = quantity(
        0.0,
        "mm",
        0.0,
        5.0,
        "depth of the more cured skin below every surface",
        "assumed: the paper prints none; no skin unless a measurement says otherwise",
        fixed=True,
    )
    skin_factor: float = quantity(
        1.0,
        "",
        0.1,
        20.0,
        "modulus of the skin over that of the core",
        "assumed: the paper prints none; no skin unless a measurement says otherwise",
    )


@attrs.frozen
class Material:
    """Section [material]: elastic constants at small strain, moduli in kPa."""

    section: ClassVar[str] = "material"
    advanced: ClassVar[Groups] = OF_RESIN

    lattice_modulus_kPa: float = quantity(
        18.34,
        "kPa",
        0.1,
        10000.0,
        "effective Young's modulus of the lattice as a block, as measured: no simulation uses it",
        "paper: measured 21.70, 18.34 and 16.38 kPa at 0.75x, 1.0x and 1.5x",
    )
    membrane_modulus_kPa: float = quantity(
        2500.0,
        "kPa",
        10.0,
        1e6,
        "Young's modulus of the membrane",
        "assumed: the paper says nominal and prints none; published Elastic 50A data give 1900 to 2700 kPa",
    )
    membrane_poisson: float = quantity(
        0.45,
        "",
        0.0,
        HIGHEST_POISSON,
        "Poisson's ratio of the membrane",
        "assumed: the paper prints none; nearly incompressible, yet free of volumetric locking",
    )
    elongation_at_break: float = quantity(
        1.6,
        "",
        0.01,
        20.0,
        "elongation at break of the resin",
        "assumed: the paper prints none; the datasheet of Elastic 50A as PMC10406103 reprints it",
    )

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that a file states: a default elongation keeps the hash of units from before it."""
        every = [d.name for d in describe(Material)]
        if self.elongation_at_break == attrs.fields(Material).elongation_at_break.default:
            every.remove("elongation_at_break")
        return tuple(every)

    @property
    def membrane_modulus_MPa(self) -> float:
        """Young's modulus of the membrane in MPa."""
        return in_MPa(self.membrane_modulus_kPa)


def _printable(unit: Any, field: Any, value: Any) -> None:
    if not (isinstance(value, str) and value and len(value) <= 80 and value.isprintable()):
        raise InputError(
            f"name = {value!r} is not a name",
            "name",
            "give one line of 1 to 80 printable characters, in quotes",
        )


def _is_section(unit: Any, field: Any, value: Any) -> None:
    kind = field.default.factory
    if not isinstance(value, kind):
        names = [d.name for section in SECTIONS for d in describe(section)]
        raise InputError(
            f"{field.name} is a section of parameters, not a value{did_you_mean(field.name, names)}",
            f"{field.name} = {value!r}",
            f"give a parameter by its name, or the whole section as a {kind.__name__}",
        )


@attrs.frozen
class Unit:
    """All parameters of one Monolithic Unit, at scale 1; `dimensions` are the lengths at its scale.

    Each section is an attrs class whose fields carry unit, bounds, meaning and source (`quantity.describe`).
    A value out of bounds, or one that breaks a co-design rule (`rules`), raises InputError with a valid
    value. Units are immutable: `evolve` makes another.

    >>> thicker = Unit(scale=0.75).evolve(wall_mm=1.2, midspan_diameter_mm=2.0)
    >>> round(thicker.dimensions.wall, 3)
    0.9
    """

    section: ClassVar[str] = ""

    name: str = attrs.field(default="custom", validator=_printable)
    scale: float = quantity(1.0, "", 0.2, 5.0, "factor on every length that is not fixed", PAPER)
    chambers: Chambers = attrs.field(factory=Chambers, validator=_is_section)
    lattice: Envelope = attrs.field(factory=Envelope, validator=_is_section)
    grading: Grading = attrs.field(factory=Grading, validator=_is_section)
    waveguide: Waveguide = attrs.field(factory=Waveguide, validator=_is_section)
    print: Printing = attrs.field(factory=Printing, validator=_is_section)
    material: Material = attrs.field(factory=Material, validator=_is_section)
    wall: Wall = attrs.field(factory=Wall, validator=_is_section)

    def __attrs_post_init__(self) -> None:
        rules.check(self.dimensions, self.lattice.allow_symmetric)
        rules.check_printed(self.dimensions, self.print.offset_xy_mm, self.print.offset_z_mm)

    def evolve(self, **values: Any) -> Unit:
        """The unit with other values of some parameters, by name; rules are checked after all changes.

        Whole sections can be given, too. Raises InputError for a name that is no parameter's and for a value
        that does not fit.
        """
        sections = {d.name: _attribute(s) for s in SECTIONS for d in describe(s)}
        head = [field.name for field in attrs.fields(Unit)]
        given: dict[str, Any] = {name: values.pop(name) for name in head if name in values}
        changes: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            if name not in sections:
                known = [*head, *sections]
                raise InputError(
                    f"there is no parameter {name!r}{did_you_mean(name, known)}",
                    "Unit.evolve",
                    f"choose from {', '.join(known)}",
                )
            changes.setdefault(sections[name], {})[name] = value
        changed = {s: attrs.evolve(given.get(s, getattr(self, s)), **own) for s, own in changes.items()}
        return attrs.evolve(self, **{**given, **changed})

    @cached_property
    def printed(self) -> Dimensions:
        """Lengths in mm at the unit's scale as they come out of the printer, see `as_printed`."""
        return as_printed(self.dimensions, self.print.offset_xy_mm, self.print.offset_z_mm)

    @cached_property
    def dimensions(self) -> Dimensions:
        """Nominal lengths in mm at the unit's scale, those of the exported files.

        Raises InputError for a lattice kind that is not registered.
        """
        c, t, w, s = self.chambers, self.lattice, self.waveguide, self.scale
        half_pitch = s * c.cell_mm / 2.0
        a = c.bladder_share * half_pitch
        return Dimensions(
            scale=s,
            cell=s * c.cell_mm,
            count=c.count,
            R=s * c.bladder_diameter_mm / 2.0,
            r=s * c.neck_diameter_mm / 2.0,
            a=a,
            b=half_pitch - a,
            wall=s * c.wall_mm,
            wall_factors=factors_by_chamber(c.wall_factors, c.count),
            base_cap=s * c.base_cap_mm,
            tip_cap=s * c.tip_cap_mm,
            inlet_radius=s * c.inlet_diameter_mm / 2.0,
            inlet_length=s * c.inlet_length_mm,
            inlet_wall=s * c.inlet_wall_mm,
            cells_x=t.cells_x,
            cells_y_minus=t.cells_y_minus,
            cells_y_plus=t.cells_y_plus,
            kind=lattice_kinds.kind(t.kind, t.struts if t.kind == lattice_kinds.CUSTOM else ""),
            junction_diameter=s * t.junction_diameter_mm,
            midspan_diameter=s * t.midspan_diameter_mm,
            row=w.row,
            waveguide_section=w.section_mm,
            waveguide_end=w.end_mm,
            well_width=w.well_width_mm,
            well_depth=w.well_depth_mm,
            well_pitch=w.well_pitch_mm,
            seats=w.seats,
            part_length=w.part_length_mm,
            part_width=w.part_width_mm,
            part_height=w.part_height_mm,
            seat_clearance=w.seat_clearance_mm,
            seat_wall=w.seat_wall_mm,
            cable=w.cable_mm,
            inclusion_radius=w.inclusion_radius_mm,
            grading=self.grading_field if self.grading.names else None,
        )

    @property
    def grading_field(self) -> Field:
        """The grading over the unit's envelope."""
        t = self.lattice
        u = self.scale * self.chambers.cell_mm
        return Field(self.grading, u, self.chambers.count, t.cells_x // 2, t.cells_y_minus, t.cells_y_plus)

    def hash(self) -> str:
        """SHA-256, in hexadecimal, of the unit's canonical TOML without comments."""
        return hashlib.sha256(to_toml(self, comments=False).encode()).hexdigest()


SECTIONS: tuple[type, ...] = (Chambers, Envelope, Grading, Waveguide, Printing, Material, Wall)


class Assumption(NamedTuple):
    """A value that the source paper does not give: path `section.name`, value, unit and reason."""

    path: str
    value: Any
    unit: str
    reason: str


def assumed(unit: Unit) -> list[Assumption]:
    """Every value of the unit that the source paper does not give, in the order of its file.

    >>> assumed(Unit())[0].path
    'chambers.neck_diameter_mm'
    """
    found = []
    for section, d, value in stated(unit):
        if d.assumed:
            reason = d.source.removeprefix("assumed: ")
            if value != d.default:
                reason = f"chosen by the user (default {d.default!r}: {reason})"
            found.append(Assumption(f"{section}.{d.name}", value, d.unit, reason))
    return found


def stated(unit: Unit) -> Iterator[tuple[str, Description, Any]]:
    """Section, description and value of every parameter in use, in the order of the unit's file.

    Parameters that a section's `names` leaves out are not written: of a wall those that its law does not use,
    of a grading those without effect, of a material a default that was added later.
    """
    for section in SECTIONS:
        values = getattr(unit, _attribute(section))
        names = getattr(values, "names", None)
        for d in describe(section):
            if names is None or d.name in names:
                yield _attribute(section), d, getattr(values, d.name)


def to_toml(unit: Unit, comments: bool = True) -> str:
    """The unit as TOML text in one canonical order, by default with unit, meaning and source as comments.

    >>> from_toml(to_toml(Unit(scale=1.5))).scale
    1.5
    """
    tables: dict[str, list[tuple[Description, Any]]] = {}
    for section, d, value in stated(unit):
        tables.setdefault(section, []).append((d, value))
    head = {"format": FORMAT, "name": unit.name, "scale": unit.scale}
    return toml_text.compose(head, tables, comments)


def from_toml(text: str, origin: str = "", beside: Path | None = None) -> Unit:
    """The unit in TOML text; keys left out keep their defaults.

    origin: name of the file, for messages; beside: its folder, in which a lattice kind's file lies. Raises
    InputError with file and line.

    >>> from_toml('format = 1').chambers.count
    6
    """
    head = {"format": int, "name": str, **{d.name: d.type for d in describe(Unit)}}
    keys = {"": list(head)} | {_attribute(s): [d.name for d in describe(s)] for s in SECTIONS}
    table = parsed_toml(text, origin).only_tables(keys).of_format(FORMAT)
    document = table.values
    with table.located():
        _take_kind(document.get("lattice", {}), beside or Path())
        sections = {_attribute(s): s(**document.get(_attribute(s), {})) for s in SECTIONS}
        require_used(sections["wall"], document.get("wall", {}))
        rest = {key: document[key] for key in ("name", "scale") if key in document}
        return Unit(**rest, **sections)


def _take_kind(lattice: dict[str, Any], folder: Path) -> None:
    """Put the struts of the file that `kind` names in its place, so that a unit carries them everywhere."""
    kind = lattice.get("kind")
    if "struts" in lattice and kind != lattice_kinds.CUSTOM:
        raise InputError(
            "struts has no effect with another kind",
            "[lattice] struts",
            f'write kind = "{lattice_kinds.CUSTOM}", or leave it out',
        )
    if isinstance(kind, str) and kind.endswith(".toml"):
        lattice |= {"kind": lattice_kinds.CUSTOM, "struts": lattice_kinds.read_struts(folder / kind)}


def read_unit(path: str | Path) -> Unit:
    """The unit in a TOML file. Raises InputError with file, line and remedy."""
    path = Path(path)
    return from_toml(text_in(path, "unit", "give the path of a unit's TOML file"), str(path), path.parent)


def write_unit(unit: Unit, path: str | Path) -> None:
    """Write the unit as commented TOML; the file is replaced only once it is complete. Raises OutputError."""
    write_bytes(Path(path), to_toml(unit).encode())


def preset_names() -> list[str]:
    """Sorted names of the shipped presets. Raises InputError where the folder of assets is missing.

    >>> preset_names()
    ['mu-0.75x', 'mu-1.0x', 'mu-1.5x']
    """
    return asset_names("presets")


def load_preset(name: str) -> Unit:
    """The shipped unit of this name. Raises InputError, which lists the valid names.

    >>> load_preset("mu-0.75x").scale
    0.75
    """
    return read_unit(asset_file("presets", "preset", name))


def _attribute(section: Any) -> str:
    return str(section.section)
