"""Checks, exports and specimens of a unit: the job, folders, findings and files.

A unit has one job for the printer at a time, in addition to its simulation.
"""

from __future__ import annotations

import hashlib
from functools import cache, partial
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...design.anchors import Window, window
from ...design.parameters import Unit
from ...design.printing.finding import counted
from ...design.printing.printer import Limit, Printer, load_printer, printer_text
from ...design.printing.sheets import measured_limits
from ...design.solid import Solid
from ...design.steps import require_whole
from ...design.surface import stl_bytes
from ...errors import InputError, MuError
from ...files import write_bytes, write_json
from ...reading import file_bytes, file_text, parse_json, parse_toml
from ..jobs import prepared
from ..jobs.start_child import OWN_FOLDER, JobKind
from ..shared.blender_property import exact
from ..shared.file_cache import FileCache
from ..simulate import study_folder as studies
from ..simulate import study_job, timings
from ..unit import envelope, stack
from ..unit.object import chosen_window
from ..unit.properties import shape_hash, to_unit
from .properties import FORMATS, OWN_PRINTER

NEEDED = ("scipy", "manifold3d", "matplotlib")
"""Modules that these jobs need; a check also needs Warp for its pictures; STEP needs gmsh, and says so."""
OWN = "own.json"
"""Unit and body of the STL that a check was given."""
ORDER = ("error", "warning", "info", "pass")
"""Severities of findings, the most severe first."""


def folder_of(root: Any, command: str) -> Path:
    """Folder of the unit's check, export or specimens."""
    return studies.folder_of(root) / command


def latest_folder(root: Any) -> Path:
    """Folder of the unit's latest job for the printer, else of its check."""
    child = PRINTING.child(root)
    return folder_of(root, CHECK.study) if child is None else child.folder.parent


PRINTING = JobKind(
    "print", lambda root: root.mu_unit.uuid, latest_folder, "job for the printer", prefix="print_"
)
timings.READERS[PRINTING.name] = timings.of_run

_printers: FileCache[Printer] = FileCache()
_measured: FileCache[dict[str, Limit]] = FileCache()
_own: FileCache[tuple[list[str], list[float]]] = FileCache()
_shipped = cache(load_printer)


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


def path_of(root: Any, unit: Unit) -> str:
    """Name of the window that the waveguide follows, or ""; raises InputError for muted steps."""
    given = stack.given(root, unit)
    require_whole(given)
    return "" if "path" in given.muted else given.path


def own_body(root: Any) -> bool:
    """Return True if a user-defined body replaces the lattice's box."""
    return root.mu_unit.envelope is not None


def along(root: Any, unit: Unit) -> Window | None:
    """The window that the waveguide follows, if there is one; raises InputError."""
    path = path_of(root, unit)
    return window(unit, path) if path else None


def _up(root: Any) -> tuple[float, ...]:
    return tuple(exact(x) for x in root.mu_print.up)


def _check(root: Any) -> dict[str, Any]:
    """Inputs of the unit's check; one in a user-defined body is checked by its STL, which is built first."""
    unit, given = to_unit(root.mu_unit), {"printer": printer_of(root), "direction": _up(root)}
    if not own_body(root):
        return given | {"unit": unit, "path": along(root, unit)}
    return given | {"stl": _part(_own_stl(root, unit, folder_of(root, CHECK.study) / OWN_FOLDER))}


def _check_file(root: Any) -> dict[str, Any]:
    """Inputs of the check of an STL file, repaired first if asked, and compared with the unit."""
    unit = to_unit(root.mu_unit) if root.mu_print.against_unit else None
    path = along(root, unit) if unit else None
    given = {"printer": printer_of(root), "direction": _up(root), "unit": unit, "path": path}
    return given | {"stl": _part(Path(bpy.path.abspath(root.mu_print.stl_file)))}


def _part(path: Path) -> Any:
    from ...studies.check import read_part

    return read_part(path)


def _export(root: Any) -> dict[str, Any]:
    """Inputs of the unit's export."""
    from ...design.printing.sheets import compensation_offsets
    from ...studies.export import TakeOff

    settings, unit = root.mu_print, to_unit(root.mu_unit)
    source = {"none": None, "unit": "unit", "gauge": bpy.path.abspath(settings.gauge)}[settings.compensate]
    return {
        "unit": unit,
        "path": along(root, unit),
        "formats": tuple(name for name, _, _ in FORMATS if name in settings.formats),
        "take_off": TakeOff(*compensation_offsets(unit, source)),
        "vent_along": _up(root) if settings.vents else (),
    }


def _not_exported(root: Any) -> str:
    """Why the unit cannot be exported, beside what the study says."""
    settings = root.mu_print
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


def solid_of(root: Any, unit: Unit, quality: str = "interactive", stl: str = "") -> Solid:
    """The printable solid of a unit in the scene; raises InputError, GateError and, in a window, NotPrepared.

    stl: file to write it to, as made elsewhere; such a solid, of many facets, is not kept.
    """
    given = stack.given(root, unit, quality)
    require_whole(given)
    if prepared.at_once() or (not stl and stack.STACK.has("solid", given)):
        solid: Solid = stack.STACK.value("solid", given)
        return solid
    from ...studies.prepare import Prepare, solid_of

    window = chosen_window(root, unit)
    of = {"path": window.name if window else "", "quality": quality, "stl": stl}
    job = Prepare(result="solid", of=of, unit=unit, body=given.body)

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
    write_json(folder / OWN, {"stl_sha256": digest, "of": [shape_hash(unit), envelope.fingerprint(root)]})
    return folder / "own.stl"


def _own_stale(root: Any, folder: Path) -> str | None:
    """Why the check of a user-defined body is not of the unit as it is; None to compare the inputs."""
    path = folder / OWN_FOLDER / OWN
    known = _own.read([folder / "check.toml", path], lambda: _own_checked(folder / "check.toml", path))
    if known is None and not own_body(root):
        return None
    try:
        now = [shape_hash(to_unit(root.mu_unit)), envelope.fingerprint(root)]
        if known is None or known[0] != now:
            return "made with other parameters"
        if printer_text(printer_of(root)) != file_text(folder / "printer.toml"):
            return "made with another printer"
    except (OSError, MuError) as error:
        return getattr(error, "what", str(error))
    return "" if known[1] == list(_up(root)) else "made with another direction"


def _own_checked(inputs: Path, own: Path) -> tuple[list[str], list[float]]:
    """What was checked by its STL, and along which direction; raises KeyError if a unit was checked."""
    of, shape = parse_toml(file_text(inputs), inputs.name), parse_json(file_bytes(own), own.name)
    if of["stl_sha256"] != shape["stl_sha256"]:
        raise KeyError(own.name)
    return shape["of"], of["direction"]


def _file_stale(root: Any, folder: Path) -> str:
    """Why the check of a file is not of the chosen one with the present settings, or ""."""
    of, settings = parse_toml(file_text(folder / "check.toml"), "check.toml"), root.mu_print
    file = of.get("run", {}).get("stl") == str(Path(bpy.path.abspath(settings.stl_file)).resolve())
    asked = (of.get("repair", False), "unit" in of) == (settings.repair, settings.against_unit)
    return "" if file and asked else "made of another file, or asked otherwise"


def _places(check: dict[str, Any], folder: Path) -> dict[str, Any]:
    """A check with its findings by severity, their places as (n, 3)."""
    for finding in check["findings"]:
        finding["places"] = np.array(finding["places"], float).reshape(-1, 3)
    check["findings"].sort(key=lambda f: ORDER.index(f["severity"]))
    return check


def errors(root: Any) -> str:
    """Names of the findings that forbid printing, of a check of the unit as it is; else ""."""
    found = CHECK.found(root)
    findings = [] if found is None or found.stale else found.content["findings"]
    return ", ".join(f["check"] for f in findings if f["severity"] == "error")


def faults(content: dict[str, Any]) -> tuple[int, str]:
    """Number of errors that a check found, and these and its warnings as text: "no errors, 2 warnings"."""
    errors, warnings = (sum(f["severity"] == s for f in content["findings"]) for s in ("error", "warning"))
    words = counted(errors, "error", "errors") if errors else "no errors"
    return errors, f"{words}, {counted(warnings, 'warning', 'warnings')}" if warnings else words


def _job(name: str, given: Any, where: str = "", **more: Any) -> study_job.StudyJob:
    """A study for the printer; where: its folder, if it has not its name."""
    place = partial(folder_of, command=where or name)
    needed = (*NEEDED, "warp") if name == "check" else NEEDED
    return study_job.StudyJob(name, PRINTING, place, given, "mu_print", needed=needed, **more)


CHECK = _job(
    "check",
    _check,
    result="check.json",
    made_of=_places,
    stale=_own_stale,
    quick=lambda root: not own_body(root),
)
FILE_CHECK = _job(
    "check",
    _check_file,
    "check-file",
    fields={"repair": "repair"},
    hindered=lambda root: "" if root.mu_print.stl_file else "Choose the STL file",
    result="check.json",
    made_of=_places,
    stale=_file_stale,
    quick=lambda root: False,
)
EXPORT = _job(
    "export",
    _export,
    fields={"quality": "quality"},
    hindered=_not_exported,
    result="manifest.json",
    made_of=lambda found, folder: {name: found[name] for name in ("resin", "files", "refused", "vents")},
    beside=("formats",),
    stale=lambda root, folder: "made with other parameters" if own_body(root) else None,
)
SPECIMENS = _job(
    "specimens",
    lambda root: {"unit": to_unit(root.mu_unit), "printer": _printer(root)},
    result="manifest.json",
)
