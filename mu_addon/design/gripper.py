"""A gripper of two units that face each other on a base plate, as one printable part.

Frame: that of a unit (z from the inlet to the tips), the middle between the fingers at y = 0, the plate below
z = 0. Pressure bends a unit toward its side of more lattice, +y, so that this side faces inward. Both fingers
are the same unit, the second turned by half a turn about z.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..reading import text_in
from ..toml_reader import parsed_toml
from . import shapes, toml_text
from .anchors import window
from .assets import asset_file, asset_names
from .gates import CAVITY_TOLERANCE, of_surface, require
from .parameters import FORMAT, Unit, load_preset, read_unit
from .profile import cavity_volume
from .quantity import describe, quantity
from .solid import QUALITY, Solid, build_solid, printable
from .surface import Triangles, Vertices, area, bad_edges, stl_bytes, stl_surface, volume
from .waveguide import ROOM, Bar, waveguide

KIND = "gripper"
ROOT = 0.1
"""Depth in mm of the plate in the fingers, one printed layer, so that all is one body."""


@attrs.frozen
class Fingers:
    """Section [fingers]: the distance in mm between the two units at rest."""

    section: ClassVar[str] = "fingers"

    gap_mm: float = quantity(
        30.0,
        "mm",
        1.0,
        200.0,
        "distance between the inner faces of the fingers at rest",
        "assumed: the paper prints none; takes the 25 mm cube with 2.5 mm to spare on either side, and tips "
        "that close on nothing at 40 kPa stop half a millimetre short of the middle",
        fixed=True,
    )


@attrs.frozen
class Plate:
    """Section [plate]: thickness, margin and mounting holes of the base plate, in mm."""

    section: ClassVar[str] = "plate"

    thickness_mm: float = quantity(
        5.0,
        "mm",
        1.0,
        50.0,
        "thickness of the base plate",
        "assumed: the paper prints none; five times a unit's wall, and the inlets still stand out below it",
        fixed=True,
    )
    margin_mm: float = quantity(
        10.0,
        "mm",
        0.0,
        50.0,
        "how far the base plate reaches beyond the fingers on every side",
        "assumed: the paper prints none; room for a screw's head in each corner",
        fixed=True,
    )
    hole_diameter_mm: float = quantity(
        4.3,
        "mm",
        0.0,
        20.0,
        "diameter of the mounting hole in each corner of the plate, 0 for none",
        "assumed: the paper prints none; clearance of an M4 screw",
        fixed=True,
    )


SECTIONS: tuple[Any, ...] = (Fingers, Plate)


def _one_line(gripper: Any, field: Any, value: Any) -> None:
    if not (isinstance(value, str) and 0 < len(value) <= 80 and value.isprintable()):
        raise InputError(f"{field.name} = {value!r} is not a name", field.name, "give one line of text")


@attrs.frozen
class Gripper:
    """Two equal units on a base plate, each with its waveguide along the window `path`.

    Raises InputError for a path that the unit has not, or mounting holes wider than half the plate's margin.
    """

    section: ClassVar[str] = ""

    unit: Unit
    name: str = attrs.field(default=KIND, validator=_one_line)
    path: str = attrs.field(default="alpha4", validator=_one_line)
    fingers: Fingers = Fingers()
    plate: Plate = Plate()

    def __attrs_post_init__(self) -> None:
        window(self.unit, self.path)
        if 2.0 * self.plate.hole_diameter_mm > self.plate.margin_mm:
            raise InputError(
                f"holes of {self.plate.hole_diameter_mm:g} mm leave too little of a margin of "
                f"{self.plate.margin_mm:g} mm",
                "[plate] hole_diameter_mm",
                f"choose at most {self.plate.margin_mm / 2.0:g} mm, half the margin, or 0 for none",
            )

    @property
    def axis_mm(self) -> float:
        """Distance in mm of each finger's z axis from the middle plane y = 0."""
        return self.fingers.gap_mm / 2.0 + self.unit.dimensions.bounds[1][1]

    @property
    def size_mm(self) -> tuple[float, float]:
        """Extents of the plate along x and y, in mm."""
        (x0, x1), (y0, y1), _ = self.unit.dimensions.bounds
        more = 2.0 * self.plate.margin_mm
        return x1 - x0 + more, 2.0 * (y1 - y0) + self.fingers.gap_mm + more

    @property
    def placements(self) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Rotation (3, 3) and then shift (3,) in mm of each finger that move a unit to its place."""
        shift = np.array([0.0, self.axis_mm, 0.0])
        return (np.eye(3), -shift), (np.diag([-1.0, -1.0, 1.0]), shift)


@attrs.frozen
class GripperGates:
    """Measurements on the gripper's solid, next to the values they must have; mm2, mm3 and counts.

    See `build_gripper` for their required values.
    """

    components: int
    bad_edges: int
    bad_edges_after_stl: int
    inner_shells: int
    inner_volumes_mm3: tuple[float, ...]
    inner_volume_expected_mm3: float
    genus: int
    genus_expected: int
    volume_mm3: float
    area_mm2: float
    vertices: int
    triangles: int


@attrs.frozen(eq=False)
class GripperSolid:
    """Outward oriented surface of the whole gripper: vertices (n, 3) in mm, triangles (m, 3), its gates.

    finger: the solid of one finger in its frame.
    """

    vertices: Vertices
    triangles: Triangles
    gates: GripperGates
    finger: Solid


def build_gripper(gripper: Gripper, quality: str = "interactive") -> GripperSolid:
    """The printable gripper: two fingers with their waveguides, and the plate with both inlets through it.

    quality: "interactive" or "export", the number of facets. Gates: one component; closed, also once the STL
    is read back; with both inlets plugged exactly two inner shells, each of a finger's cavity; and the genus
    that the Euler characteristics of fingers, plate and their intersections add up to. Raises GateError where
    one fails, InputError where the plate covers a seat.
    """
    from manifold3d import Manifold, Mesh64, OpType

    d = gripper.unit.dimensions
    path = window(gripper.unit, gripper.path)
    _require_open_seats(gripper, waveguide(gripper.unit, path))
    finger = build_solid(gripper.unit, path, quality)
    body = Manifold(Mesh64(finger.vertices, finger.triangles.astype(np.uint64)))
    fingers = [_placed(body, *placement) for placement in gripper.placements]
    plate = _plate(gripper, QUALITY[quality].around_axis)
    vertices, triangles = printable(Manifold.batch_boolean([*fingers, plate], OpType.Add))

    whole = Manifold(Mesh64(vertices, triangles.astype(np.uint64)))
    foot = max(d.inlet_length, gripper.plate.thickness_mm)
    plug = shapes.cylinder(
        d.inlet_radius + 0.75 * d.inlet_wall, -1.5 * foot, -0.5 * d.inlet_length, QUALITY[quality].around_axis
    )
    plugs = [_placed(plug, *placement) for placement in gripper.placements]
    sealed = Manifold.batch_boolean([whole, *plugs], OpType.Add).decompose()
    inner = tuple(-shell.volume() for shell in sealed if shell.volume() < 0.0)
    shared = [_characteristic(one ^ plate) for one in fingers]
    expected = sum(_characteristic(solid) for solid in (*fingers, plate)) - sum(shared)
    gates = GripperGates(
        components=len(whole.decompose()),
        bad_edges=bad_edges(triangles),
        bad_edges_after_stl=bad_edges(stl_surface(stl_bytes(vertices, triangles))[1]),
        inner_shells=len(inner),
        inner_volumes_mm3=inner,
        inner_volume_expected_mm3=cavity_volume(d)
        + np.pi * d.inlet_radius**2 * (d.base_cap + 0.5 * d.inlet_length),
        genus=whole.genus(),
        genus_expected=1 - expected,
        volume_mm3=volume(vertices, triangles),
        area_mm2=area(vertices, triangles),
        vertices=len(vertices),
        triangles=len(triangles),
    )
    _require(gates)
    return GripperSolid(vertices, triangles, gates, finger)


def _placed(body: Any, rotation: Array, shift: Array) -> Any:
    return body.transform(np.column_stack([rotation, shift]))


def _characteristic(solid: Any) -> int:
    """Euler characteristic of a body, of one piece or several: half its surface's."""
    return 1 - int(solid.genus())


def _plate(gripper: Gripper, n: int) -> Any:
    """The plate as a Manifold, with a hole for each inlet's bore and for each screw.

    An inlet's hole ends within the wall of its boss, so that no two faces coincide.
    """
    from manifold3d import Manifold, OpType

    d, low = gripper.unit.dimensions, -gripper.plate.thickness_mm
    x, y = (extent / 2.0 for extent in gripper.size_mm)
    through = (1.5 * low, 2.0 * ROOT)
    inlet = shapes.cylinder(d.inlet_radius + d.inlet_wall / 2.0, *through, n)
    holes = [_placed(inlet, *placement) for placement in gripper.placements]
    radius, inset = gripper.plate.hole_diameter_mm / 2.0, gripper.plate.margin_mm / 2.0
    if radius:
        screw = shapes.cylinder(radius, *through, n)
        corners = [(a * (x - inset), b * (y - inset), 0.0) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
        holes += [screw.translate(corner) for corner in corners]
    return Manifold.batch_boolean([shapes.box([-x, -y, low], [x, y, ROOT]), *holes], OpType.Subtract)


def _require_open_seats(gripper: Gripper, bar: Bar) -> None:
    """Raise InputError where the plate blocks the way of a part into its seat."""
    more = gripper.unit.dimensions.part_height + ROOM
    for seat in bar.seats:
        if seat.pocket.longer(0, more).corners[:, 2].min() < ROOT:
            raise InputError(
                f"the base plate covers the seat at the inlet's end of {gripper.path}",
                "path",
                "choose a path that begins farther from the inlet, such as alpha4",
            )


def _require(gates: GripperGates) -> None:
    g = gates
    off = [abs(v / g.inner_volume_expected_mm3 - 1.0) for v in g.inner_volumes_mm3]
    require(
        *of_surface(g.components, g.bad_edges, g.bad_edges_after_stl),
        (g.inner_shells == 2, "two cavities", f"with both inlets plugged there are {g.inner_shells} shells"),
        (max(off, default=0.0) <= CAVITY_TOLERANCE, "cavity volume", f"cavities hold {g.inner_volumes_mm3}"),
        (g.genus == g.genus_expected, "genus", f"genus {g.genus}, its parts make {g.genus_expected}"),
        of="gripper",
        remedy="try the other quality or a slightly different gap",
    )


def to_toml(gripper: Gripper, unit: str, comments: bool = True) -> str:
    """The gripper as TOML text, by default with unit, meaning and source of each value as comments.

    unit: the fingers' unit as named in the file, a preset or a TOML file in the same folder.
    """
    head = {
        "format": FORMAT,
        "kind": KIND,
        "name": gripper.name,
        "unit": unit,
        "path": gripper.path,
    }
    tables = {}
    for section in SECTIONS:
        values = getattr(gripper, section.section)
        tables[section.section] = [(d, getattr(values, d.name)) for d in describe(section)]
    return toml_text.compose(head, tables, comments)


def from_toml(text: str, origin: str = "", beside: Path | None = None) -> Gripper:
    """The gripper in TOML text; keys left out keep their defaults.

    origin: name of the file, for messages; beside: folder of the unit's file that the text may name. Raises
    InputError with file and line.
    """
    keys = {"": ["format", "kind", "name", "unit", "path"]}
    keys |= {section.section: [d.name for d in describe(section)] for section in SECTIONS}
    table = parsed_toml(text, origin).only_tables(keys).of_format(FORMAT)
    document = table.values
    if document.get("kind") != KIND:
        remedy = f'write kind = "{KIND}", or give a gripper file instead of a unit file'
        raise InputError("the file is not a gripper", table.at("kind"), remedy)
    named = table.word("unit")
    with table.located():
        sections = {s.section: s(**document.get(s.section, {})) for s in SECTIONS}
        rest = {key: document[key] for key in ("name", "path") if key in document}
    from_file = named.endswith(".toml")
    unit = read_unit((beside or Path()) / named) if from_file else load_preset(named)
    with table.located():
        return Gripper(unit=unit, **rest, **sections)


def read_gripper(path: str | Path) -> Gripper:
    """The gripper in a TOML file. Raises InputError with file, line and remedy."""
    path = Path(path)
    return from_toml(text_in(path, "gripper", "give a gripper's TOML file"), str(path), path.parent)


def gripper_names() -> list[str]:
    """Sorted names of the shipped grippers. Raises InputError where the folder of assets is missing."""
    return asset_names("presets", KIND)


def load_gripper(name: str) -> Gripper:
    """The shipped gripper of this name. Raises InputError, which lists the valid names."""
    return read_gripper(asset_file("presets", "gripper", name, KIND))
