"""Checks, exports and specimens of a unit: the job, folders, findings and files.

A unit has one job for the printer at a time, in addition to its simulation.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import attrs
import bpy
import numpy as np
from mathutils import Vector

from ...design.anchors import window
from ...design.parameters import Unit, read_unit
from ...design.printing.printer import Limit, Printer, load_printer, printer_text
from ...design.printing.sheets import measured_limits
from ...design.solid import Solid
from ...design.steps import require_whole
from ...design.surface import stl_bytes
from ...errors import InputError, MuError
from ...files import write_bytes, write_json
from ...reading import file_bytes, file_text, parse_json, parse_toml
from ...run.folder import FolderLayout, write_run
from ..jobs import prepared
from ..jobs.start_child import OWN_FOLDER, JobKind, lacking
from ..shared.blender_property import exact
from ..shared.file_cache import FileCache
from ..simulate import study_folder as studies
from ..simulate import timings
from ..unit import envelope, stack
from ..unit.object import chosen_window
from ..unit.properties import shape_hash, to_unit
from .properties import FORMATS, OWN_PRINTER

CHECK, FILE_CHECK, EXPORT, SPECIMENS = "check", "check-file", "export", "specimens"
"""Jobs for the printer, and their folders in the unit's study folder; the check of a file has another."""
NEEDED = ("scipy", "manifold3d", "matplotlib")
"""Modules that these jobs need; STEP also needs gmsh, and reports that itself."""
MANIFEST = "manifest.json"
OWN = "own.json"
"""Unit and body of the STL that a check was given."""


@attrs.frozen(eq=False)
class Checked:
    """Result of a check: check.json and its digest; stale: why it is not of the present unit."""

    folder: Path
    stale: str
    found: dict[str, Any]
    digest: str

    @property
    def findings(self) -> list[dict[str, Any]]:
        """All findings, as of `Finding.plain`, the most severe first."""
        order = ("error", "warning", "info", "pass")
        return sorted(self.found["findings"], key=lambda f: order.index(f["severity"]))

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Findings that forbid printing."""
        return [f for f in self.findings if f["severity"] == "error"]


def folder_of(root: Any, command: str) -> Path:
    """Folder of the unit's check, export or specimens."""
    return studies.folder_of(root) / command


def latest_folder(root: Any) -> Path:
    """Folder of the unit's latest job for the printer, else of its check."""
    child = PRINTING.child(root)
    return folder_of(root, CHECK) if child is None else child.folder.parent


def _detail(command: str, quality: str) -> str:
    return f"{command} {quality}" if command == EXPORT else command


def _timed(folder: Path) -> tuple[str, dict[str, Any]]:
    """Detail of a finished job for the printer, and the seconds of its stages."""
    inputs = folder / "export.toml"
    quality = parse_toml(file_text(inputs), inputs.name)["quality"] if folder.name == EXPORT else ""
    summary = folder / "summary.json"
    return _detail(folder.name, quality), parse_json(file_bytes(summary), summary.name)["seconds"]


def announced(root: Any, command: str) -> float | None:
    """Expected seconds of a job for the printer, as measured on this machine; None before the first one."""
    settings = root.mu_print
    files = ("solid", *settings.formats, *(["vents"] if settings.vents else [])) if command == EXPORT else ()
    return timings.announced(_detail(command, settings.quality), files)


PRINTING = JobKind("print", lambda root: root.mu_unit.uuid, latest_folder, "print")
timings.READERS[PRINTING.name] = _timed

_printers: FileCache[Printer] = FileCache()
_measured: FileCache[dict[str, Limit]] = FileCache()
_checks: FileCache[Any] = FileCache()
_file_checks: FileCache[tuple[Any, dict[str, Any]]] = FileCache()
_exports: FileCache[tuple[dict[str, Any], str]] = FileCache()


def printer_of(root: Any) -> Printer:
    """The chosen printer, with measured limits; raises InputError for bad files."""
    printer, measured = _printer(root), root.mu_print.limits_file
    if not measured:
        return printer
    path = Path(bpy.path.abspath(measured))
    return printer.with_limits(_measured.read([path], lambda: measured_limits(path)) or measured_limits(path))


def _printer(root: Any) -> Printer:
    settings = root.mu_print
    if settings.printer != OWN_PRINTER:
        return _shipped(settings.printer)
    if not settings.printer_file:
        raise InputError(
            "no file with the printer's limits was chosen", "Print", "choose one, or a shipped printer"
        )
    path = bpy.path.abspath(settings.printer_file)
    # Panels ask often: read only when the file changes, or to report its fault.
    return _printers.read([Path(path)], lambda: load_printer(path)) or load_printer(path)


@cache
def _shipped(name: str) -> Printer:
    return load_printer(name)


def path_of(root: Any, unit: Unit) -> str:
    """Name of the window that the waveguide follows, or ""; raises InputError for muted steps."""
    given = stack.given(root, unit)
    require_whole(given)
    return "" if "path" in given.muted else given.path


def trouble(root: Any, command: str) -> str:
    """Return the reason why a job for the printer cannot be started now, or ""."""
    if absent := lacking(NEEDED):
        return absent
    settings = root.mu_print
    if command == FILE_CHECK and not settings.stl_file:
        return "Choose the STL file"
    if command in (CHECK, FILE_CHECK, EXPORT):
        try:
            if command != FILE_CHECK or settings.against_unit:
                path_of(root, to_unit(root.mu_unit))
            if command != EXPORT:
                printer_of(root)
        except MuError as error:
            return f"{error.what}: {error.remedy}"
    along_up = command in (CHECK, FILE_CHECK) or (command == EXPORT and settings.vents)
    if along_up and Vector(settings.up).length < 1e-3:
        return "Up is not a direction: give three numbers, such as 0 0 1"
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
            return "The unit has no print offsets: set them under Print Offsets"
    return ""


def own_body(root: Any) -> bool:
    """Return True if a user-defined body replaces the lattice's box."""
    return bool(envelope.fingerprint(root))


def write_inputs(root: Any, command: str, folder: Path) -> None:
    """Write the inputs of a job for the printer into its folder; raises MuError."""
    unit = to_unit(root.mu_unit)
    inputs = {CHECK: _check, FILE_CHECK: _check_file, EXPORT: _export, SPECIMENS: _specimens}[command]
    layout, job = inputs(root, unit, folder)
    write_run(folder, layout, job.texts())


# Imported late: the core's jobs need packages that a Blender may lack.


def _check(root: Any, unit: Unit, folder: Path) -> tuple[FolderLayout, Any]:
    """Check of the unit; one in a user-defined body is checked by its STL, which is built first."""
    from ...studies.check import Check, read_part

    up = tuple(exact(x) for x in root.mu_print.up)
    if own_body(root):
        stl = read_part(_own_stl(root, unit, folder / OWN_FOLDER))
        return Check.layout(), Check(printer=printer_of(root), stl=stl, direction=up)
    path = path_of(root, unit)
    along = window(unit, path) if path else None
    return Check.layout(), Check(printer=printer_of(root), unit=unit, path=along, direction=up)


def _check_file(root: Any, unit: Unit, folder: Path) -> tuple[FolderLayout, Any]:
    """Check of an STL file, repaired first if asked, and compared with the unit."""
    from ...studies.check import Check, read_part

    settings = root.mu_print
    path = path_of(root, unit) if settings.against_unit else ""
    return Check.layout(), Check(
        printer=printer_of(root),
        unit=unit if settings.against_unit else None,
        path=window(unit, path) if path else None,
        stl=read_part(Path(bpy.path.abspath(settings.stl_file))),
        direction=tuple(exact(x) for x in settings.up),
        repair=settings.repair,
    )


def _export(root: Any, unit: Unit, folder: Path) -> tuple[FolderLayout, Any]:
    from ...design.printing.sheets import compensation_offsets
    from ...studies.export import Export, TakeOff

    settings, path = root.mu_print, path_of(root, unit)
    source = {"none": None, "unit": "unit", "gauge": bpy.path.abspath(settings.gauge)}[settings.compensate]
    return Export.layout(), Export(
        unit=unit,
        path=window(unit, path) if path else None,
        formats=tuple(name for name, _, _ in FORMATS if name in settings.formats),
        quality=settings.quality,
        take_off=TakeOff(*compensation_offsets(unit, source)),
        vent_along=tuple(exact(x) for x in settings.up) if settings.vents else (),
    )


def _specimens(root: Any, unit: Unit, folder: Path) -> tuple[FolderLayout, Any]:
    from ...studies.specimens import Specimens

    return Specimens.layout(), Specimens(unit=unit, resin=None, printer=_printer(root))


def solid_of(root: Any, unit: Unit, quality: str = "interactive", stl: str = "") -> Solid:
    """The printable solid of a unit in the scene; raises InputError, GateError and, in a window, NotPrepared.

    stl: file to write it to, as made elsewhere; such a solid, of many facets, is not kept.
    """
    given = stack.given(root, unit, quality)
    require_whole(given)
    if prepared.at_once() or (not stl and stack.STACK.has("solid", given)):
        solid: Solid = stack.STACK.value("solid", given)
        return solid
    from ...usecases.prepare import Job, solid_of

    window = chosen_window(root, unit)
    of = {"path": window.name if window else "", "quality": quality, "stl": stl}
    job = Job("solid", of, unit, given.body)

    def keep(arrays: Any, trouble: str) -> None:
        if arrays is not None and not stl:
            stack.STACK.keep("solid", given, solid_of(arrays, job))

    folder = studies.folder_of(root) / ("stl" if stl else "solid")
    raise prepared.NotPrepared(root, f"STL in {stl}" if stl else "solid", folder, job, keep, repeats=not stl)


def _own_stl(root: Any, unit: Unit, folder: Path) -> Path:
    """Write the solid of a unit in a user-defined body, and its origin."""
    solid = solid_of(root, unit)
    content = stl_bytes(solid.vertices, solid.triangles)
    write_bytes(folder / "own.stl", content)
    digest = hashlib.sha256(content).hexdigest()
    write_json(folder / OWN, {"stl_sha256": digest, "of": _shape(root, unit)})
    return folder / "own.stl"


def _shape(root: Any, unit: Unit) -> list[str]:
    return [shape_hash(unit), path_of(root, unit), envelope.fingerprint(root)]


def checked(root: Any) -> Checked | None:
    """Result of the check in the unit's folder, or None."""
    folder = folder_of(root, CHECK)
    found, inputs, unit, limits = (
        folder / name for name in ("check.json", "check.toml", "unit.toml", "printer.toml")
    )
    own = folder / OWN_FOLDER / OWN

    def read() -> Any:
        content = file_bytes(found)
        check = parse_json(content, found.name)
        for finding in check["findings"]:
            finding["places"] = np.array(finding["places"], float).reshape(-1, 3)
        of = parse_toml(file_text(inputs), inputs.name)
        if "stl_sha256" in of:
            shape = parse_json(file_bytes(own), own.name)
            shape = shape["of"] if shape["stl_sha256"] == of["stl_sha256"] else []
        else:
            shape = [shape_hash(read_unit(unit)), of.get("path", ""), ""]
        digest = hashlib.sha256(content).hexdigest()
        return check, digest, shape, of["direction"], file_text(limits)

    known = _checks.read([found, inputs, unit, limits, own], read)
    return None if known is None else Checked(folder, _stale(root, *known[2:]), *known[:2])


def _stale(root: Any, shape: list[str], up: list[float], limits: str) -> str:
    """Return the reason why a check is not of the unit in its present state, or ""."""
    try:
        if _shape(root, to_unit(root.mu_unit)) != shape:
            return "made with other parameters"
        if printer_text(printer_of(root)) != limits:
            return "made with another printer"
    except MuError as error:
        return error.what
    same = (Vector(up).normalized() - Vector(root.mu_print.up).normalized()).length < 1e-3
    return "" if same else "made with another build direction"


def checked_file(root: Any) -> dict[str, Any] | None:
    """check.json of the chosen file with the present settings; None where there is none."""
    settings = root.mu_print
    folder = folder_of(root, FILE_CHECK)
    found, inputs = folder / "check.json", folder / "check.toml"

    def read() -> tuple[Any, dict[str, Any]]:
        check = parse_json(file_bytes(found), found.name)
        return check, parse_toml(file_text(inputs), inputs.name)

    known = _file_checks.read([found, inputs], read)
    if known is None:
        return None
    check, of = known
    file = of.get("run", {}).get("stl") == str(Path(bpy.path.abspath(settings.stl_file)).resolve())
    asked = (of.get("repair", False), "unit" in of) == (settings.repair, settings.against_unit)
    return dict(check) if file and asked else None


@attrs.frozen(eq=False)
class Exported:
    """Manifest of an export; stale: why it is not of the present unit."""

    folder: Path
    stale: str
    manifest: dict[str, Any]


def exported(root: Any) -> Exported | None:
    """Content of the unit's folder of exports, or None if nothing there is complete."""
    path, unit = (folder_of(root, EXPORT) / name for name in (MANIFEST, "unit.toml"))

    def read() -> tuple[dict[str, Any], str]:
        manifest = parse_json(file_bytes(path), path.name)
        kept = {name: manifest[name] for name in ("path", "resin", "files", "refused", "vents")}
        return kept, shape_hash(read_unit(unit))

    known = _exports.read([path, unit], read)
    if known is None:
        return None
    found, shape = known
    of = [shape, (found["path"] or {}).get("name", ""), ""]
    try:
        same = _shape(root, to_unit(root.mu_unit)) == of
    except MuError:
        same = False
    return Exported(path.parent, "" if same else "made with other parameters", found)
