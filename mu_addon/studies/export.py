"""`export`: files of a unit for printers and CAD, each read back and compared, with a manifest."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from .. import design, materials
from ..design.settings import FINE, USUAL_RESIN
from ..errors import InputError, MeshingError, OutputError, did_you_mean
from ..files import json_text
from ..run.inputs import digest, named_path, require_digest
from ..run.parts import Fact, File, Part, Sentence, Table, Warn, echo, recorded
from ..run.study import (
    Found,
    Input,
    Members,
    Node,
    Over,
    Study,
    Tell,
    Written,
    derived,
    given,
    intermediate,
    section,
    setting,
    stage,
)
from .inputs import MaterialInput, NodePath, NumbersInput, OnceInput, PathInput, UnitInput, WordsInput, asked

FORMATS = ("stl", "3mf", "3mf-beams", "step", "txt")
MANIFEST = "manifest.json"
MESH_TOLERANCE = 1e-4
"""Relative difference of volume allowed between a solid and its STL or 3MF read back."""
STEP_TOLERANCE = 5e-3
"""Relative difference of volume allowed of a STEP file, through its mesh."""
SOLID_S = {"interactive": 2.0, "export": 11.0}
DEFORMED = "deformed"
FORMAT_S = {"stl": 0.8, "3mf": 7.0, "3mf-beams": 7.0, "step": 8.0, "txt": 0.1, DEFORMED: 10.0}
"""Approximate seconds to write a format and read it back."""
FRAME = "mm; z from inlet to tip, x = 0 the bending plane, +y the side with more lattice"

# In which order CAD takes the bodies, and what each does to those before it.
_ASSEMBLY = (
    ("envelope.step", "base body: the box of the lattice without the actuator"),
    ("membrane.step", "add: wall, end caps and inlet"),
    ("waveguide.step", "add after all other solids: bar and seats, already trimmed"),
    ("cavity.step", "subtract after everything was added, or keep as the volume of air"),
)


@attrs.frozen
class FormatsInput(WordsInput):
    """File formats; all of them where none is named."""

    kind: str = "formats"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> tuple[str, ...]:
        """The formats, each once."""
        return tuple(dict.fromkeys(super().made(values, given))) or FORMATS


@attrs.frozen
class TakeOff:
    """Print offset in mm that a drawing is made smaller by, in the plane and along z, and its source."""

    xy_z: tuple[float, float] = (0.0, 0.0)
    source: str = ""


@attrs.frozen
class TakeOffInput(Input):
    """A print offset: "unit" for that of the unit, else the filled sheet of the gauge."""

    kind: str = "take off"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> TakeOff:
        """The offset of a source; raises InputError."""
        from ..design.printing.sheets import compensation_offsets

        return TakeOff(*compensation_offsets(given["unit"], values[0] or None))

    def write(self, name: str, value: TakeOff) -> Written:
        """Offset and source."""
        return Written({"take_off_mm": value.xy_z, "offset_source": value.source or None})

    def read(self, name: str, found: Found) -> TakeOff:
        """The offset of the file; raises InputError."""
        offset = found.take("take_off_mm", tuple[float, float], (0.0, 0.0))
        return TakeOff(offset, found.take("offset_source", str, ""))


@attrs.frozen
class Deformed:
    """A pressure in kPa, and the run that simulated the unit's motion, with the SHA-256 of that motion."""

    kPa: float
    run: Path
    sha256: str

    def hash(self) -> str:
        """Hash of what decides: not the run's place."""
        return digest(f"{self.kPa!r} {self.sha256}")


@attrs.frozen
class DeformedInput(Input):
    """A state in which the unit is written as well: its pressure, and the folder of a run."""

    kind: str = DEFORMED

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> Deformed | None:
        """The state of a pressure and a folder; raises InputError."""
        if not values[0]:
            return None
        words, run = values[0]
        try:
            kPa = float(words)
        except (TypeError, ValueError):
            raise InputError(f"{words!r} is not a number", "--deformed", "give kPa, then a folder") from None
        return deformed_in(Path(run), given["unit"], kPa, given["path"])

    def write(self, name: str, value: Deformed | None) -> Written:
        """The pressure, the motion's digest, and the run's place."""
        if value is None:
            return Written()
        keys = {"deformed_kPa": value.kPa, "motion_sha256": value.sha256}
        return Written(keys, {"motion": str(value.run.resolve())})

    def read(self, name: str, found: Found) -> Deformed | None:
        """The state; raises InputError where the motion is gone or another."""
        kPa, before = found.keys.pop("deformed_kPa", None), found.keys.pop("motion_sha256", None)
        if kPa is None:
            return None
        run = named_path(found.path, found.run, "motion", "simulated run")
        state = self.made(((kPa, run),), found.given)
        if state is not None and state.sha256 != before:
            require_digest(run, b"", before, "simulated motion")
        return state


def deformed_in(run: Path, unit: design.Unit, kPa: float, path: Any = None) -> Deformed:
    """A state of the motion of a unit, with its path, in a run's folder; raises InputError without it."""
    import numpy as np

    from ..report.motion_files import MODEL_A, read_motion
    from ..run.stored import content

    motion = read_motion(run)
    if design.read_unit(run / "unit.toml") != unit:
        remedy = f"give --unit {run / 'unit.toml'}, or simulate this unit"
        raise InputError("that run simulated another unit", f"--deformed {kPa:g} {run}", remedy)
    if not np.isclose(motion.state_kPa, kPa, rtol=0.0, atol=1e-6).any():
        known = ", ".join(f"{p:g}" for p in motion.state_kPa)
        raise InputError(f"that run has no state at {kPa:g} kPa", str(run), f"choose from {known}")
    moved = motion.sides(path.name if path else MODEL_A)
    return Deformed(kPa, run, content((motion.mesh.hash(), motion.state_kPa, moved)))


@attrs.frozen(eq=False)
class Exported:
    """A file as it was read back: what it is, its bytes and figures."""

    name: str
    what: str
    content: bytes
    read_back: dict[str, Any]

    def plain(self) -> dict[str, Any]:
        """Its entry in the manifest."""
        return {
            "file": self.name,
            "what": self.what,
            "bytes": len(self.content),
            "sha256": digest(self.content),
            "read_back": self.read_back,
        }


@attrs.frozen(eq=False)
class Made:
    """Files of a format; refused: why there are no more, and what to do."""

    files: Sequence[Exported]
    refused: tuple[str, str] | None = None


@attrs.frozen(kw_only=True, eq=False)
class Export(Study):
    """Export a unit as STL, 3MF, STEP and node list. Each file is read back and verified; a manifest lists
    them.
    """

    name = "export"
    example = "export --preset mu-1.0x --path alpha4 --out out/print"
    files = {
        "unit.stl": "printable unit, binary, mm",
        "unit_at_*_kPa.stl": "the unit as a run deformed it, mm",
        "unit.3mf": "printable unit, mm",
        "unit-beams.3mf": "actuator and waveguide as meshes, lattice as beams, nominal size, mm",
        "*.step": "bodies with exact surfaces, nominal size, mm",
        "nodes.txt": "lattice nodes and anchors, mm",
        "plug-*.stl": "plugs of the vents",
        MANIFEST: "every file with size, SHA-256 and what was read back",
    }
    node = Node(
        "Print",
        "files for printer and CAD",
        (("files", "file", "the files"),),
        lambda summary: f"{len(summary['files'])} files",
        hidden=("path_row", "take_off", "vent_along", "deformed"),
        no_body="the export",
    )

    unit: design.Unit = given(UnitInput())
    path_row: str = asked(
        OnceInput,
        "path_row",
        "path to take from the paths.csv of --path; empty: its first, the best one",
        empty="",
        metavar="NAME",
    )
    path: design.Window | NodePath | None = asked(
        PathInput,
        "path",
        "path of the waveguide: alpha1, alpha2, ..., or a paths.csv of `place --paths graph`, whose best "
        "path is taken; empty: none",
        metavar="NAME|CSV",
    )
    formats: tuple[str, ...] = asked(
        FormatsInput,
        "formats",
        f"file formats: {', '.join(FORMATS)}; empty: all",
        " ".join(FORMATS),
        empty=FORMATS,
        metavar="F",
    )
    quality: str = setting(FINE)
    take_off: TakeOff = asked(
        TakeOffInput,
        "compensate",
        "compensate the print offset: subtract it from the nominal geometry. Without a value: the [print] "
        "offset of the unit or of --model. With a CSV file: the offset measured on the calibration coupon of "
        "`specimens`; empty: none",
        empty=TakeOff(),
        metavar="CSV",
        alone="unit",
    )
    vent_along: tuple[float, ...] = asked(
        NumbersInput,
        "vent_along",
        "vent the cups that trap resin when the unit is built along this direction, away from the platform: "
        "a hole through the wall for each cup, in STL and 3MF, and plug-1.stl, ... to close it; empty: none",
        empty=(),
        metavar=("X", "Y", "Z"),
        many=3,
    )
    deformed: Deformed | None = asked(
        DeformedInput,
        DEFORMED,
        "also write the unit as it is at a pressure, by the motion in the folder of a `simulate` or `place` "
        "run of it (with --path: of a `place` run); empty: none",
        metavar=("KPA", "RUN"),
        many=2,
    )
    resin: materials.Material | None = asked(
        MaterialInput,
        "resin",
        f"resin: a material of the library or a TOML file; empty: {USUAL_RESIN}",
        metavar="NAME|FILE",
    )

    def __attrs_post_init__(self) -> None:
        for name in self.formats:
            if name not in FORMATS:
                what = f"there is no format {name!r}{did_you_mean(name, FORMATS)}"
                raise InputError(what, "--formats", f"choose from {', '.join(FORMATS)}")
        along = self.vent_along
        if along and (len(along) != 3 or not 1e-6 < sum(x * x for x in along) < 1e12):
            raise InputError(
                f"{along} is not a direction", "--vent-along", "give three numbers, such as 0 0 -1"
            )

    @derived
    def material(self, resin: materials.Material | None) -> materials.Material:
        """The resin that gives the mass."""
        return resin or materials.load_material(USUAL_RESIN)

    @stage("solid", lambda study: SOLID_S[study.quality], kept=False)
    def solid(
        self, unit: design.Unit, path: design.Window | NodePath | None, quality: str, take_off: TakeOff,
        tell: Tell,
    ) -> design.Solid:  # fmt: skip
        """The printable solid, smaller by the print offset."""
        along = path.points if isinstance(path, NodePath) else path
        made = design.build_solid(unit, along, quality, take_off=take_off.xy_z)
        tell.made(f"{len(made.triangles)} triangles")
        return made

    @stage(
        "vents",
        10.0,
        kept=False,
        over=Over(("along",), lambda study: [study.vent_along] if study.vent_along else []),
    )
    def vents(self, along: tuple[float, ...], solid: design.Solid) -> design.Vented:
        """The solid with vents for resin trapped along the build direction."""
        return design.vented(solid.vertices, solid.triangles, along, design.load_printer())

    @intermediate()
    def part(self, solid: design.Solid, vents: Members) -> design.Solid:
        """The solid that is written, with its vents."""
        from ..design import surface

        for found in (v for v in vents.values() if v.vents):
            v, t = found.vertices, found.triangles
            gates = attrs.evolve(
                solid.gates, bad_edges=surface.bad_edges(t), genus=surface.genus(v, t), vertices=len(v),
                volume_mm3=surface.volume(v, t), area_mm2=surface.area(v, t), triangles=len(t),
            )  # fmt: skip
            solid = attrs.evolve(solid, vertices=v, triangles=t, gates=gates)
        return solid

    @intermediate()
    def plugs(self, vents: Members) -> tuple[Exported, ...]:
        """The plugs that close the vents."""
        return tuple(
            _plug(number, vent) for found in vents.values() for number, vent in enumerate(found.vents, 1)
        )

    @stage(
        "{format}",
        FORMAT_S,
        kept=False,
        over=Over(("format",), lambda study: [*study.formats, *([DEFORMED] if study.deformed else [])]),
    )
    def made(
        self, format: str, part: design.Solid, unit: design.Unit, path: design.Window | NodePath | None,
        deformed: Deformed | None, tell: Tell,
    ) -> Made:  # fmt: skip
        """The files of a format, read back."""
        if format == "step":
            return _step(part, unit, tell)
        make: dict[str, Callable[[], Exported]] = {
            "stl": lambda: _stl("unit.stl", "printable unit, binary, mm", part),
            "3mf": lambda: _3mf(part, unit.name),
            "3mf-beams": lambda: _beams(part, unit),
            "txt": lambda: _nodes(unit),
            DEFORMED: lambda: _deformed(part, deformed, path),  # type: ignore[arg-type]
        }
        return Made([make[format]()])

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it scale and path."""
        return f"Export: {self.unit.name}", f"scale {self.unit.scale:g}" + (
            f", waveguide along {self.path.name}" if self.path else ""
        )

    @section()
    def warned(self, vents: Members) -> Iterator[Part]:
        """What was not done along the build direction."""
        (found,) = vents.values()
        kept = [name for name in self.formats if name in ("3mf-beams", "step")]
        words = [(name, name.upper(), "has no vents: it keeps its nominal shape") for name in kept]
        if not found.vents:
            words.append(("no", "No", f"vent is needed: {found.before_ml:.3g} ml are trapped at most"))
        for name, first, text in words:
            yield Warn(f"{name} {text}", "--vent-along", repeated=False)
            yield Sentence(f"{first} {text}.", note=True)

    @section()
    def answer(self, part: design.Solid, material: materials.Material) -> Iterator[Part]:
        """The part's figures."""
        size, ml, bar = _box(part.vertices), part.volume_mm3 / 1e3, part.bar
        (xy, z), source = self.take_off.xy_z, self.take_off.source
        yield Fact("size", "", " x ".join(f"{s:.4g}" for s in size[1] - size[0]) + " mm")
        yield Fact("resin in the part", "", f"{ml:.2f} ml")
        yield Fact("mass", "", f"{ml * material.density_g_per_ml:.1f} g")
        yield Fact("triangles", "", str(part.gates.triangles))
        yield Sentence(f"Mass by the density of {material.name}, {material.density_g_per_ml:g} g/ml.")
        if bar is not None:
            yield Sentence(
                f"Waveguide: {bar.path_mm:.2f} mm, {len(bar.wells)} wells, {len(bar.seats)} seats."
            )
        if xy or z:
            yield Sentence(
                f"Smaller by the print offset: {xy:g} mm in the plane, {z:g} mm along z ({source})."
            )

    @section("exported", "Files for printer and CAD")
    def listed(
        self, part: design.Solid, made: Members, plugs: Sequence[Exported], material: materials.Material,
        vents: Members | None = None,
    ) -> Iterator[Part]:  # fmt: skip
        """Every file; once all are there, the manifest."""
        files, rows = [*plugs, *(one for found in made.values() for one in found.files)], []
        for one in files:
            mb, back = f"{len(one.content) / 1e6:.2f}", one.read_back
            yield File(one.name, one.content)
            yield from echo(f"{one.name}: {mb} MB, read back and verified")
            error = f"{back['volume_error']:+.1e}" if "volume_error" in back else "-"
            volume = back.get("volume_mm3", back.get("frusta_mm3"))
            rows.append((one.name, one.what, mb, "-" if volume is None else f"{volume:.2f}", error))
        yield Sentence("Each file was read back and compared with what it was written from.")
        head = ["file", ("content", "text"), *Table.numbers("MB", "volume read back [mm³]", "error")]
        yield Table("error: relative, of the volume; of unit-beams.3mf the volume of all beams", head, rows)
        if not made.complete:
            return
        refused = []
        for name, (why, remedy) in ((name, one.refused) for name, one in made.items() if one.refused):
            text = f"No {name.upper()}: {why}. What to do: {remedy}."
            refused.append({"format": name, "why": why, "what_to_do": remedy})
            yield Warn(text, repeated=False)
            yield Sentence(text, note=True)
            yield from echo(f"not written: {name}: {why}")
        manifest = self._manifest(part, material, next(iter((vents or {}).values()), None))
        order = [one for one in _ASSEMBLY if one[0] in {file.name for file in files}]
        steps = [{"order": n, "file": name, "how": how} for n, (name, how) in enumerate(order, 1)]
        manifest |= {"files": [one.plain() for one in files], "refused": refused, "assembly": steps}
        yield File(MANIFEST, lambda path: json_text(manifest))
        for key, value in manifest.items():
            yield recorded(key, value)
        resin = manifest["resin"]
        text = f"{resin['ml']:.2f} ml, {resin['g']:.1f} g of {resin['name']}"
        yield from echo(text)
        if steps:
            head = [("", "n"), "file", ("how", "text")]
            yield Table("Assembly of the STEP files in CAD", head, [(*map(str, s.values()),) for s in steps])

    def _manifest(
        self, part: design.Solid, material: materials.Material, vented: design.Vented | None
    ) -> dict[str, Any]:
        """Content of the manifest but for the files."""
        gates, bar, off, density = part.gates, part.bar, self.take_off, material.density_g_per_ml
        path, vents, ml = None, None, gates.volume_mm3 / 1e3
        if bar is not None and self.path is not None:
            path = {"name": self.path.name, "axis_mm": bar.points, "length_mm": bar.path_mm}
            path |= {"wells": len(bar.wells), "seats": len(bar.seats)}
        if vented is not None:
            trapped = {"trapped_before_ml": vented.before_ml, "trapped_after_ml": vented.after_ml}
            vents = {"along": self.vent_along, **trapped, "vents": [vent.plain() for vent in vented.vents]}
        return {
            "unit": {"name": self.unit.name, "scale": self.unit.scale, "sha256": self.unit.hash()},
            "frame": FRAME,
            "path": path,
            "solid": {
                "quality": self.quality,
                "volume_mm3": gates.volume_mm3,
                "cavity_mm3": gates.inner_volume_mm3,
                "bounding_box_mm": _box(part.vertices),
                "triangles": gates.triangles,
                "gates": attrs.asdict(gates),
            },
            "taken_off_mm": {
                "xy": off.xy_z[0],
                "z": off.xy_z[1],
                "source": off.source or "nothing: nominal geometry",
            },
            "vents": vents,
            "resin": {"name": material.name, "density_g_per_ml": density, "ml": ml, "g": ml * density},
        }

    @section("vents", "Vents")
    def drilled(self, vents: Members) -> Iterator[Part]:
        """Every vent with its plug."""
        (found,) = vents.values()
        if found.vents:
            yield Sentence(
                f"The largest cup traps {found.before_ml:.3g} ml without vents and {found.after_ml:.2g} ml "
                "with them. Glue the plugs in once the unit is washed."
            )
            head = ["plug", ("vent at, mm", "line"), *Table.numbers("diameter [mm]", "length [mm]")]
            places = [", ".join(f"{round(x, 2) + 0.0:.2f}" for x in vent.outer) for vent in found.vents]
            sizes = [(f"{vent.diameter:g}", f"{vent.length:.2f}") for vent in found.vents]
            rows = [(f"plug-{n}.stl", p, *s) for n, (p, s) in enumerate(zip(places, sizes, strict=True), 1)]
            yield Table("", head, rows)


# The files of each format, each read back.


def _box(vertices: Any) -> Any:
    """Lowest and highest corner (2, 3) in mm."""
    import numpy as np

    return np.stack([vertices.min(axis=0), vertices.max(axis=0)])


def _mismatch(name: str, what: str) -> OutputError:
    return OutputError(
        f"{name}, read back, {what}", name, "report it with the unit's TOML; do not print this file"
    )


def _compared(solid: design.Solid, name: str, vertices: Any, triangles: Any) -> dict[str, Any]:
    """A mesh read back against the solid it was written from."""
    from ..design.surface import bad_edges, volume

    enclosed, open_edges = volume(vertices, triangles), bad_edges(triangles)
    error = enclosed / solid.gates.volume_mm3 - 1.0
    if open_edges:
        raise _mismatch(name, f"has {open_edges} edges not shared by exactly two triangles")
    if len(triangles) != len(solid.triangles):
        raise _mismatch(name, f"has {len(triangles)} triangles, expected {len(solid.triangles)}")
    if abs(error) > MESH_TOLERANCE:
        raise _mismatch(name, f"encloses {enclosed:.3f} mm3 and not {solid.gates.volume_mm3:.3f} mm3")
    figures = {"volume_mm3": enclosed, "volume_error": error, "triangles": len(triangles)}
    return {**figures, "open_edges": open_edges, "bounding_box_mm": _box(vertices)}


def _stl(name: str, what: str, solid: design.Solid) -> Exported:
    from ..design.surface import stl_surface

    made = design.stl_bytes(solid.vertices, solid.triangles)
    return Exported(name, what, made, _compared(solid, name, *stl_surface(made)))


def _plug(number: int, vent: Any) -> Exported:
    from ..design.surface import bad_edges, stl_surface, volume

    name, made = f"plug-{number}.stl", design.stl_bytes(*vent.plug_surface())
    back = stl_surface(made)
    if bad_edges(back[1]) or abs(volume(*back) / vent.plug.volume() - 1.0) > 1e-3:
        raise _mismatch(name, "is another body than the plug")
    x, y, z = vent.outer
    what = f"plug of the vent at ({x:.2f}, {y:.2f}, {z:.2f}) mm, glued in once the unit is washed"
    return Exported(name, what, made, {"volume_mm3": volume(*back), "open_edges": 0})


def _deformed(solid: design.Solid, state: Deformed, path: design.Window | NodePath | None) -> Exported:
    """The solid as it is in a state of the simulated motion: its surface follows the mesh."""
    import numpy as np

    from ..design.surface import volume
    from ..report.motion_files import MODEL_A, read_motion

    motion = read_motion(state.run)
    number = int(np.abs(motion.state_kPa - state.kPa).argmin())
    moved = motion.carried(path.name if path else MODEL_A, motion.embedding(solid.vertices))[number]
    vertices = solid.vertices + moved
    gates = attrs.evolve(solid.gates, volume_mm3=volume(vertices, solid.triangles))
    what = f"the unit at {state.kPa:g} kPa, by the motion in {state.run}, mm"
    return _stl(f"unit_at_{state.kPa:g}_kPa.stl", what, attrs.evolve(solid, vertices=vertices, gates=gates))


def _3mf(solid: design.Solid, title: str) -> Exported:
    from ..design.threemf import Part, read_3mf

    name = "unit.3mf"
    made = design.write_3mf([Part(title, solid.vertices, solid.triangles)], [1], title)
    objects, printed = read_3mf(made)
    found = objects[printed[0]]
    back = _compared(solid, name, found.vertices, found.triangles)
    return Exported(name, "printable unit, mm", made, back)


def _beams(solid: design.Solid, unit: design.Unit) -> Exported:
    import numpy as np

    from ..design.beams import beam_parts
    from ..design.lattice import lattice_of
    from ..design.solid import QUALITY
    from ..design.surface import bad_edges, volume
    from ..design.threemf import read_3mf

    name, d, bar = "unit-beams.3mf", unit.dimensions, solid.bar
    parts, printed = beam_parts(d, QUALITY[solid.quality], bar)
    made = design.write_3mf(parts, printed, f"{unit.name}, lattice as beams")
    found, again = read_3mf(made)
    read = list(found.values())
    if again != printed or len(read) != len(parts):
        raise _mismatch(name, "has other objects")
    for wrote, back in zip(parts, read, strict=True):
        if wrote.beams is not None and back.beams is not None:
            same = np.array_equal(wrote.beams.pairs, back.beams.pairs)
            if not same or abs(back.beams.volume / wrote.beams.volume - 1.0) > MESH_TOLERANCE:
                raise _mismatch(name, "has other beams")
            continue
        error = volume(back.vertices, back.triangles) / volume(wrote.vertices, wrote.triangles) - 1.0
        if abs(error) > MESH_TOLERANCE or bad_edges(back.triangles):
            raise _mismatch(name, f"has another {wrote.name}")
    beams = next(part.beams for part in read if part.beams is not None)
    struts = int(np.count_nonzero(~bar.replaced)) if bar else len(lattice_of(d).struts)
    figures = {"nodes": len(beams.nodes), "beams": len(beams.pairs), "struts": struts}
    what = "actuator and waveguide as meshes, lattice as beams, nominal size, mm"
    return Exported(name, what, made, {**figures, "frusta_mm3": beams.volume})


def _step(solid: design.Solid, unit: design.Unit, tell: Tell) -> Made:
    from ..meshing.step_file import bodies, step_bytes

    files: list[Exported] = []
    every = bodies(unit.dimensions, solid.bar)
    try:
        for number, (body, exact) in enumerate(every.items(), 1):
            name = f"{body}.step"
            made, solids, found = step_bytes(body, unit.dimensions, solid.bar)
            error = found / exact - 1.0
            if solids != 1:
                raise _mismatch(name, f"holds {solids} solids, not one")
            if abs(error) > STEP_TOLERANCE:
                raise _mismatch(name, f"encloses {found:.2f} mm3 and not {exact:.2f} mm3")
            tell(number / len(every))
            back = {"solids": solids, "volume_mm3": found, "volume_error": error}
            files.append(Exported(name, f"{body}, exact surfaces, nominal size, mm", made, back))
    except MeshingError as error:
        return Made(files, (error.what, error.remedy))
    return Made(files)


def _nodes(unit: design.Unit) -> Exported:
    import numpy as np

    from ..design.lattice import lattice_of
    from ..design.stl_and_nodes import nodes_text

    name, text = "nodes.txt", nodes_text(unit)
    rows = [line.split() for line in text.splitlines() if not line.startswith("#")]
    nodes = lattice_of(unit.dimensions).nodes
    read = np.array([row[2:] for row in rows], dtype=float)
    if read.shape != nodes.shape or np.abs(read - nodes).max() > 1e-6:
        raise _mismatch(name, "has other nodes")
    anchors = sum(row[1].startswith("P") for row in rows)
    back = {"nodes": len(rows), "anchors": anchors}
    return Exported(name, "lattice nodes and anchors, mm", text.encode(), back)
