"""The printability check of a unit or an STL file in one folder: findings, pictures, a report."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.anchors import Window
from ...design.gates import GateError
from ...design.parameters import Unit, to_toml
from ...design.printing.check import PrintCheck, check
from ...design.printing.printer import Printer, printer_text
from ...design.solid import build_solid
from ...design.surface import Triangles, Vertices, stl_bytes, stl_surface
from ...errors import InputError
from ...files import write_bytes, write_json
from ...run.context import RunContext
from ...run.folder import begin
from ...run.progress import Progress

HEADER = "# The inputs of this print check; the files beside it belong to it."
RESULTS = ("part.stl", "check.json", "report.html", "places.png")


@attrs.frozen(eq=False)
class Job:
    """Inputs of a check: a unit, or the bytes of an STL file, or a file checked against its unit.

    direction points away from the platform, in the part's frame.
    """

    printer: Printer
    unit: Unit | None = None
    window: Window | None = None
    quality: str = "interactive"
    stl: bytes | None = None
    stl_name: str = ""
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def name(self) -> str:
        """What is checked, in a few words."""
        unit = "" if self.unit is None else self.unit.name
        path = "" if self.window is None else f", {self.window.name}"
        if self.stl is None:
            return unit + path
        return self.stl_name + (f" against {unit}{path}" if unit else "")

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; check.toml is the first."""
        lines = [HEADER, "format = 1", 'printer = "printer.toml"']
        if self.unit is not None:
            lines += ['unit = "unit.toml"', f'quality = "{self.quality}"']
        if self.window is not None:
            lines.append(f'path = "{self.window.name}"')
        if self.stl is not None:
            lines.append(f'stl_sha256 = "{hashlib.sha256(self.stl).hexdigest()}"')
        lines.append(f"direction = [{', '.join(f'{x:g}' for x in self.direction)}]")
        texts = {"check.toml": "\n".join(lines) + "\n", "printer.toml": printer_text(self.printer)}
        return texts if self.unit is None else texts | {"unit.toml": to_toml(self.unit)}


def check_print(job: Job, folder: Path, progress: Progress, context: RunContext) -> PrintCheck:
    """Check a part and leave part.stl, check.json and report.html; GateError if it must not be printed."""
    from .report import write_report

    begin(context, folder, HEADER, job.texts(), RESULTS, optional=("unit.toml",))
    with progress.stage("part"):
        vertices, triangles = surface_of(job)
    found = check(
        vertices,
        triangles,
        job.printer,
        job.unit,
        job.window,
        job.direction,
        stage=progress.stage,
    )
    context.summary |= summary(found)
    write_bytes(folder / "part.stl", stl_bytes(vertices, triangles))
    write_json(folder / "check.json", as_plain(job, found))
    write_report(job, vertices, triangles, found, folder, progress)
    for finding in found.findings:
        if finding.severity == "warning":
            progress.warning(f"{finding.check}: {finding.what}", _where(finding.places), finding.remedy)
    errors = [f for f in found.findings if f.severity == "error"]
    if errors:
        first = errors[0]
        more = f" (and {len(errors) - 1} more errors, see report.html)" if len(errors) > 1 else ""
        raise GateError(
            f"not printable: {first.check}: {first.what}{more}", _where(first.places), first.remedy
        )
    return found


def surface_of(job: Job) -> tuple[Vertices, Triangles]:
    """The surface (n, 3), (m, 3) that is checked; raises InputError and GateError."""
    if job.stl is not None:
        return read_surface(job.stl, job.stl_name)
    assert job.unit is not None
    solid = build_solid(job.unit, job.window, job.quality)
    return solid.vertices, solid.triangles


def read_surface(content: bytes, name: str) -> tuple[Vertices, Triangles]:
    """Surface of a binary or text STL, equal corners merged; raises InputError."""
    if len(content) == 84:
        raise InputError("the STL file holds no triangles", name, "export the part again")
    try:
        vertices, triangles = stl_surface(content)
    except InputError:
        vertices, triangles = _text_stl(content, name)
    if not len(triangles):
        raise InputError("the STL file holds no triangles", name, "export the part again")
    if not np.isfinite(vertices).all():
        raise InputError("the STL file holds numbers that are not finite", name, "export the part again")
    return vertices, triangles


def _text_stl(content: bytes, name: str) -> tuple[Vertices, Triangles]:
    words = content.split()
    try:
        if not words or words[0] != b"solid":
            raise ValueError("no STL")
        at = np.flatnonzero(np.array(words) == b"vertex")
        corners = np.array([[float(word) for word in words[k + 1 : k + 4]] for k in at.tolist()])
        vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        return vertices, np.ravel(index).reshape(-1, 3).astype(np.int64)
    except ValueError as error:
        raise InputError(
            "the STL file is truncated or malformed", name, "export the part again as binary STL"
        ) from error


def as_plain(job: Job, found: PrintCheck) -> dict[str, Any]:
    """What check.json holds."""
    return {
        "format": 1,
        "part": job.name,
        "printer": job.printer.title,
        "direction": job.direction,
        "verdict": found.worst,
        "findings": [finding.plain() for finding in found.findings],
        "figures": found.figures,
        "orientation": [attrs.asdict(build) for build in found.builds],
    }


def summary(found: PrintCheck) -> dict[str, Any]:
    """Key figures of a check for summary.json."""
    count = {s: sum(f.severity == s for f in found.findings) for s in ("error", "warning", "pass")}
    best = {"orientation": attrs.asdict(found.builds[0])} if found.builds else {}
    faults = [f"{f.check}: {f.what}" for f in found.findings if f.is_fault]
    return {"verdict": found.worst, "count": count, "figures": found.figures, "faults": faults, **best}


def console_summary(summary: Mapping[str, Any]) -> list[str]:
    """What a check found, in a few lines of text, of its `summary`."""
    count = summary["count"]
    lines = [f"{count['pass']} checks passed, {count['warning']} warnings, {count['error']} errors"]
    if "orientation" in summary:
        best = summary["orientation"]
        towards = ", ".join(f"{x:.2f}" for x in best["direction"])
        lines.append(
            f"best build direction ({towards}): {best['islands']} islands, {best['support_mm2']:.0f} mm2 to "
            f"support, of it {best['inner_mm2']:.0f} mm2 in chambers, cups of {best['cup_ml']:.2g} ml"
        )
    return lines


def _where(places: np.ndarray[Any, Any]) -> str:
    if not len(places):
        return ""
    x, y, z = places[0]
    more = f" and {len(places) - 1} places more" if len(places) > 1 else ""
    return f"({x:.2f}, {y:.2f}, {z:.2f}) mm{more}"
