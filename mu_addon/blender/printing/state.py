"""What was checked and written for the printer of a unit: folders, findings, files, and markers in the view.

A unit has one job for the printer at a time, a check, an export or its specimens, beside its simulation.
"""

# Blender reads the annotations themselves: no `from __future__ import annotations` here.

import hashlib
import importlib.util
import json
import tomllib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np
from bpy.props import (
    EnumProperty,
    FloatProperty,
    FloatVectorProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)
from mathutils import Vector

from ...design.assets import asset_names
from ...design.parameters import Unit, read_unit
from ...design.printing.printer import DEFAULT, Printer, load_printer, printer_text
from ...design.steps import require_whole
from ...design.surface import stl_bytes
from ...errors import InputError, MuError
from ...files import write_bytes, write_json
from ..body import state as bodies
from ..preview import arrays as preview
from ..preview import colours as materials
from ..preview import nodes
from ..shared.compat import set_modifier_input
from ..simulate import study_folder as studies
from ..steps import state as stack
from ..unit import object as unit_object
from ..unit.properties import BESIDE_BLEND_FILE, to_unit

CHECK, EXPORT, SPECIMENS = "check", "export", "specimens"
"""Jobs for the printer, subcommands of the core, and their folders in the unit's study folder."""
NEEDED = ("scipy", "manifold3d", "matplotlib")
"""Modules that these jobs cannot do without; STEP needs gmsh, too, and says so itself."""
OWN_PRINTER = "own"
FORMATS = (
    ("stl", "STL", "The printable solid, mm"),
    ("3mf", "3MF", "The printable solid with its unit of length"),
    ("3mf-beams", "Beams", "3MF with the struts as beams, nominal size: not every slicer knows them"),
    ("step", "STEP", "Cavity, membrane, envelope and waveguide for CAD, nominal size"),
    ("txt", "TXT", "Nodes of the lattice and the anchors"),
)
"""Kinds of files of an export: the core's name, the name here, and what they hold."""
MANIFEST = "manifest.json"
FAULTS = ("error", "warning")
OWN = "own.json"
"""Says of which unit and body the STL is that was handed to a check."""
MARK = unit_object.CHECK
"""Its value on a marker is the finding's number, and `UP` on the arrow along the build direction."""
UP = "up"
LARGER = 1.8
"""How much larger the ball at the place that is looked at is."""
OF = "mu_check_of"
"""On that arrow: digest of the check that is marked."""
MATERIAL = {"error": "MU Flaws", "warning": "MU Doubt"}


class MU_PG_print(bpy.types.PropertyGroup):
    """How a unit is to be printed, and what is written for it."""

    printer: EnumProperty(
        name="Printer",
        description="Whose limits the check compares with",
        items=[
            *(
                (name, name.replace("-", " ").title(), "Comes with the extension")
                for name in asset_names("printers")
            ),
            (
                OWN_PRINTER,
                "Own File",
                "A TOML file of your own; start from printer.toml in the check's folder",
            ),
        ],
        default=DEFAULT,
    )
    printer_file: StringProperty(
        name="Limits",
        description="TOML file of a printer and its resin",
        subtype="FILE_PATH",
        options=BESIDE_BLEND_FILE,
    )
    up: FloatVectorProperty(
        name="Up",
        description="Build direction in the unit's frame, away from the platform. 0 0 1: inlet down",
        subtype="XYZ",
        default=(0.0, 0.0, 1.0),
    )
    formats: EnumProperty(
        name="Files",
        description="What an export writes; each file is read back and compared",
        items=[(*item, 1 << number) for number, item in enumerate(FORMATS)],
        options={"ENUM_FLAG"},
        default={"stl", "3mf"},
    )
    quality: EnumProperty(
        name="Facets",
        description="How finely round parts are cut into flat ones",
        items=[
            ("export", "Fine", "The quality to print"),
            ("interactive", "Coarse", "Quicker, smaller files"),
        ],
    )
    compensate: EnumProperty(
        name="Compensate",
        description="Whether the drawing is made smaller by what the printer adds",
        items=[
            ("none", "Nothing", "The drawing is nominal"),
            ("unit", "How It Prints", "The offsets of this unit, see How It Prints"),
            ("gauge", "Gauge", "What calipers found on the printed gauge of the specimens"),
        ],
    )
    gauge: StringProperty(
        name="Sheet",
        description="gauge.csv of the specimens with the sizes that were measured",
        subtype="FILE_PATH",
        options=BESIDE_BLEND_FILE,
    )
    marker: FloatProperty(
        name="Markers",
        description="Radius of the balls at the places that were found",
        subtype="DISTANCE",
        default=0.8,
        min=0.05,
        max=10.0,
        update=lambda settings, context: resize(settings.id_data),
    )
    # Which finding is looked at, and which of its places; -1: none.
    finding: IntProperty(default=-1, options={"HIDDEN"})
    place: IntProperty(options={"HIDDEN"})


@attrs.frozen(eq=False)
class Checked:
    """What a check found: check.json and its digest; stale: why it is not one of the unit as it is now."""

    folder: Path
    stale: str
    found: dict[str, Any]
    digest: str

    @property
    def findings(self) -> list[dict[str, Any]]:
        """Every finding, as `Finding.plain` has it, the gravest first."""
        order = ("error", "warning", "info", "pass")
        return sorted(self.found["findings"], key=lambda f: order.index(f["severity"]))

    @property
    def errors(self) -> list[dict[str, Any]]:
        """The findings for which it must not be printed."""
        return [f for f in self.findings if f["severity"] == "error"]


def job(root: Any) -> str:
    """Name under which the unit's jobs for the printer run beside its simulation."""
    return f"{root.mu_unit.uuid}:print"


def folder_of(root: Any, command: str) -> Path:
    """Folder of the unit's check, export or specimens."""
    return studies.folder_of(root) / command


def missing() -> list[str]:
    """Names of the modules that a job for the printer needs and this Blender does not find."""
    return [name for name in NEEDED if importlib.util.find_spec(name) is None]


def printer_of(root: Any) -> Printer:
    """The printer that is chosen; raises InputError for a file that is none."""
    settings = root.mu_print
    if settings.printer != OWN_PRINTER:
        return _shipped(settings.printer)
    if not settings.printer_file:
        raise InputError(
            "no file with the printer's limits was chosen", "Print", "choose one, or a shipped printer"
        )
    path = bpy.path.abspath(settings.printer_file)
    # Panels ask often: read again only when the file changes, or to say what is wrong with it.
    return _kept([Path(path)], lambda: load_printer(path)) or load_printer(path)


@cache
def _shipped(name: str) -> Printer:
    return load_printer(name)


def path_of(root: Any, unit: Unit) -> str:
    """Name of the window that the waveguide follows, or nothing; raises InputError for muted steps."""
    given = stack.given(root, unit)
    require_whole(given)
    return "" if "path" in given.muted else given.path


def trouble(root: Any, command: str) -> str:
    """Why a job for the printer cannot be started now, or nothing."""
    lacking = missing()
    if lacking:
        return f"Not in this Blender: {', '.join(lacking)}"
    settings = root.mu_print
    if command in (CHECK, EXPORT):
        try:
            path_of(root, to_unit(root.mu_unit))
            if command == CHECK:
                printer_of(root)
        except MuError as error:
            return f"{error.what}: {error.remedy}"
    if command == CHECK and Vector(settings.up).length < 1e-3:
        return "Up is no direction: give three figures, such as 0 0 1"
    if command == EXPORT:
        if not settings.formats:
            return "Choose at least one kind of file"
        if own_body(root):
            return "With a body of your own only STL is written: use Export STL As"
        if settings.compensate == "gauge" and not settings.gauge:
            return "Choose the gauge's sheet with the sizes that were measured"
        if settings.compensate == "unit" and not any(
            (root.mu_unit.print.offset_xy_mm, root.mu_unit.print.offset_z_mm)
        ):
            return "The unit has no offsets to take off: set them under How It Prints"
    return ""


def own_body(root: Any) -> bool:
    """Whether the user's own body takes the place of the lattice's box."""
    return bool(bodies.fingerprint(root))


def words(root: Any, unit: Unit, command: str) -> list[str]:
    """The command line of a job for the printer, but for its folder and --json; raises MuError.

    A unit in a body of the user's own is checked by its STL, which is built and written first.
    """
    settings, own = root.mu_print, folder_of(root, command) / "blender"
    line = [command, "--unit", str(own / "unit.toml")]
    if command == SPECIMENS:
        return line
    path = path_of(root, unit)
    line += ["--path", path] if path else []
    if command == CHECK:
        if own_body(root):
            line = [command, "--stl", str(_own_stl(root, unit, own))]
        name = settings.printer
        if name == OWN_PRINTER:
            name = bpy.path.abspath(settings.printer_file)
        return [*line, "--printer", name, "--up", *(f"{x:.6g}" for x in settings.up)]
    line += [
        "--formats",
        *(name for name, _, _ in FORMATS if name in settings.formats),
        "--quality",
        settings.quality,
    ]
    if settings.compensate == "unit":
        line.append("--compensate")
    elif settings.compensate == "gauge":
        line += ["--compensate", bpy.path.abspath(settings.gauge)]
    return line


def _own_stl(root: Any, unit: Unit, folder: Path) -> Path:
    """Write the solid of a unit in the user's own body, and of what it is."""
    solid = unit_object.solid_of(root, unit)
    content = stl_bytes(solid.vertices, solid.triangles)
    write_bytes(folder / "own.stl", content)
    digest = hashlib.sha256(content).hexdigest()
    write_json(folder / OWN, {"stl_sha256": digest, "of": _shape(root, unit)})
    return folder / "own.stl"


def _shape(root: Any, unit: Unit) -> list[str]:
    return [unit.hash(), path_of(root, unit), bodies.fingerprint(root)]


_read: dict[Path, tuple[Any, Any]] = {}


def _kept(files: list[Path], read: Callable[[], Any]) -> Any:
    """What `read` makes of files, None where it cannot; done again only when they change."""
    state = []
    for path in files:
        try:
            stat = path.stat()
            state.append((stat.st_mtime_ns, stat.st_size))
        except OSError:
            state.append((0, 0))
    if not any(state[0]):
        return None
    kept = _read.get(files[0])
    if kept is None or kept[0] != state:
        try:
            kept = state, read()
        except (OSError, ValueError, KeyError, TypeError, MuError):
            kept = state, None
        _read[files[0]] = kept
    return kept[1]


def checked(root: Any) -> Checked | None:
    """What the check in the unit's folder found, or None where there is none."""
    folder = folder_of(root, CHECK)
    found, inputs, unit, limits = (
        folder / name for name in ("check.json", "check.toml", "unit.toml", "printer.toml")
    )
    own = folder / "blender" / OWN

    def read() -> Any:
        content = found.read_bytes()
        said = json.loads(content)
        for finding in said["findings"]:
            finding["places"] = np.array(finding["places"], float).reshape(-1, 3)
        of = tomllib.loads(inputs.read_text(encoding="utf-8"))
        if "stl_sha256" in of:
            shape = json.loads(own.read_text(encoding="utf-8"))
            shape = shape["of"] if shape["stl_sha256"] == of["stl_sha256"] else []
        else:
            shape = [read_unit(unit).hash(), of.get("path", ""), ""]
        digest = hashlib.sha256(content).hexdigest()
        return said, digest, shape, of["direction"], limits.read_text(encoding="utf-8")

    known = _kept([found, inputs, unit, limits, own], read)
    return None if known is None else Checked(folder, _stale(root, *known[2:]), *known[:2])


def _stale(root: Any, shape: list[str], up: list[float], limits: str) -> str:
    """Why a check is not one of the unit as it is, or nothing."""
    try:
        if _shape(root, to_unit(root.mu_unit)) != shape:
            return "it is of the unit with other parameters"
        if printer_text(printer_of(root)) != limits:
            return "it is for another printer"
    except MuError as error:
        return error.what
    same = (Vector(up).normalized() - Vector(root.mu_print.up).normalized()).length < 1e-3
    return "" if same else "it is of another build direction"


@attrs.frozen(eq=False)
class Exported:
    """The manifest of an export; stale: why it is not of the unit now."""

    folder: Path
    stale: str
    manifest: dict[str, Any]


def exported(root: Any) -> Exported | None:
    """What the unit's folder of exports holds, or None where there is nothing whole."""
    path = folder_of(root, EXPORT) / MANIFEST

    def read() -> dict[str, Any]:
        said = json.loads(path.read_text(encoding="utf-8"))
        return {name: said[name] for name in ("unit", "path", "resin", "files", "refused")}

    found = _kept([path], read)
    if found is None:
        return None
    of = [found["unit"]["sha256"], (found["path"] or {}).get("name", ""), ""]
    try:
        same = _shape(root, to_unit(root.mu_unit)) == of
    except MuError:
        same = False
    return Exported(path.parent, "" if same else "they are of the unit with other parameters", found)


def marks(root: Any) -> list[Any]:
    """The objects that show where a check found something."""
    return [child for child in root.children if MARK in child]


def marked(root: Any) -> str:
    """Digest of the check whose places are marked, or nothing."""
    return next((obj[OF] for obj in marks(root) if obj[MARK] == UP), "")


def clear(root: Any) -> None:
    """Take the markers out."""
    for obj in marks(root):
        unit_object.remove_part(obj)
    root.mu_print.finding = -1


def mark(root: Any, found: Checked) -> None:
    """Put a ball at every place of every error and warning, in place of those that were there."""
    clear(root)
    for number, finding in enumerate(found.findings):
        if finding["severity"] not in FAULTS or not len(finding["places"]):
            continue
        name = f"{finding['check'].capitalize()} ({finding['severity']})"
        obj = _marker(root, name, bpy.data.meshes.new(name), str(number))
        radius = np.full(len(finding["places"]), root.mu_print.marker)
        preview.write(obj.data, preview.Skeleton(finding["places"], attributes={"radius": radius}))
        materials.assign(obj.data, MATERIAL[finding["severity"]])
        set_modifier_input(nodes.skin(obj, "MU Balls"), "Material", obj.data.materials[0])
        obj.hide_render = True
    arrow = _marker(root, "Build Direction", None, UP)
    arrow[OF] = found.digest
    arrow.empty_display_type = "SINGLE_ARROW"
    unit = to_unit(root.mu_unit).dimensions
    arrow.empty_display_size = 2.0 * unit.cell
    arrow.location = (0.0, unit.bounds[1][0] - unit.cell, 0.0)
    arrow.rotation_mode = "QUATERNION"
    arrow.rotation_quaternion = Vector(found.found["direction"]).to_track_quat("Z", "Y")


def _marker(root: Any, name: str, data: Any, value: str) -> Any:
    obj = bpy.data.objects.new(name, data)
    obj[MARK] = value
    for collection in root.users_collection:
        collection.objects.link(obj)
    obj.parent = root
    obj.lock_location = obj.lock_rotation = obj.lock_scale = (True, True, True)
    obj.show_in_front = True
    return obj


def resize(root: Any) -> None:
    """Give the markers the radius that is set, and the place that is looked at a larger one."""
    settings = root.mu_print
    for obj in marks(root):
        if obj.data is None:
            continue
        values = np.full(len(obj.data.vertices), settings.marker, np.float32)
        if obj[MARK] == str(settings.finding):
            values[settings.place % len(values)] *= LARGER
        obj.data.attributes["radius"].data.foreach_set("value", values)
        obj.data.update()


def frame(context: Any, root: Any, place: Any, reach: float) -> None:
    """Turn every 3D view to a place (3,) in mm of the unit's frame, so that `reach` mm around it are seen."""
    centre = root.matrix_world @ Vector(place)
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                view = area.spaces.active.region_3d
                view.view_location = centre
                view.view_distance = 4.0 * reach
                if view.view_perspective == "CAMERA":
                    view.view_perspective = "PERSP"


def register() -> None:
    """The property group and the one property on objects that holds it."""
    bpy.utils.register_class(MU_PG_print)
    bpy.types.Object.mu_print = PointerProperty(
        type=MU_PG_print, description="How a unit is to be printed, and what is written for it"
    )


def unregister() -> None:
    """Take them out again; values stay in the file."""
    del bpy.types.Object.mu_print
    bpy.utils.unregister_class(MU_PG_print)
