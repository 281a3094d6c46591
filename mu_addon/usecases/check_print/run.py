"""The printability check of a unit or an STL file in one folder: findings, pictures, a report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.gates import GateError
from ...design.printing.check import PrintCheck, check
from ...design.printing.printer import MEANING, Printer
from ...design.printing.repair import Repair, repaired
from ...design.solid import build_solid
from ...design.surface import Triangles, Vertices, stl_bytes
from ...files import write_bytes, write_json
from ...run.context import RunContext
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from .job import LAYOUT, Job, read_job
from .report import write_report


def check_print(job: Job, folder: Path, context: RunContext) -> PrintCheck:
    """Check a part and write part.stl, check.json and report.html; GateError if it must not be printed."""
    progress = context.progress
    with progress.stage("part"):
        vertices, triangles = surface_of(job)
        mended = repaired(vertices, triangles) if job.repair else None
        if mended is not None:
            vertices, triangles = mended.vertices, mended.triangles
            require_whole(mended, job.stl_name)
        nominal = nominal_of(job)
        progress.made(f"{len(triangles)} triangles")

    if mended is not None:
        progress.warning(f"repaired: {'; '.join(mended.lines())}", job.stl_name, "look at part.stl")

    def verdict(found: PrintCheck) -> None:
        """Report the findings before build directions are compared, which adds none."""
        for finding in found.findings:
            if finding.is_fault:
                first = "not printable: " if finding.severity == "error" else ""
                where = _where(finding.places)
                progress.warning(f"{first}{finding.check}: {finding.what}", where, finding.remedy)
        context.summary |= summary(found, job.printer)
        write_json(folder / "check.json", as_plain(job, found, mended))

    found = check(
        vertices,
        triangles,
        job.printer,
        job.unit,
        job.window,
        job.direction,
        stage=progress.stage,
        nominal=nominal,
        verdict=verdict,
        share=progress.update,
    )
    context.summary |= summary(found, job.printer)
    write_bytes(folder / "part.stl", stl_bytes(vertices, triangles))
    write_json(folder / "check.json", as_plain(job, found, mended))
    context.report = lambda stopped: write_report(
        job, vertices, triangles, found, folder, progress, mended, stopped
    )
    # Before the error of a part that must not be printed: that is the result, and no reason to leave early.
    context.write_report()
    context.report = None
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
    if job.stl_surface is not None:
        return job.stl_surface
    assert job.unit is not None
    solid = build_solid(job.unit, job.window, job.quality)
    return solid.vertices, solid.triangles


def nominal_of(job: Job) -> tuple[Vertices, Triangles] | None:
    """The surface (n, 3), (m, 3) that a file is compared with: its unit's solid.

    None without a unit, or with a unit alone. Raises GateError.
    """
    if job.stl is None or job.unit is None:
        return None
    solid = build_solid(job.unit, job.window, job.quality)
    return solid.vertices, solid.triangles


def require_whole(mended: Repair, name: str) -> None:
    """Raise GateError, with the changes and the remaining faults, unless a repair left none."""
    if not mended.is_whole:
        done = "; ".join(f"{change.count} {change.what}" for change in mended.changes) or "nothing"
        raise GateError(
            f"the repair is not unambiguous: {'; '.join(mended.remains)} (done before that: {done})",
            name,
            "correct the remaining faults in the program that made the part, or check it without "
            "--repair to see the places",
        )


def as_plain(job: Job, found: PrintCheck, mended: Repair | None = None) -> dict[str, Any]:
    """Content of check.json."""
    return {
        "format": 1,
        "part": job.name,
        "printer": job.printer.title,
        "direction": job.direction,
        "verdict": found.worst,
        "findings": [finding.plain() for finding in found.findings],
        "figures": found.figures,
        "limits": standings(job.printer),
        "orientation": [attrs.asdict(build) for build in found.builds],
        **({} if mended is None else {"repair": mended.plain()}),
    }


def summary(found: PrintCheck, printer: Printer) -> dict[str, Any]:
    """Key figures of a check for summary.json, and the grounds of the printer's limits."""
    count = {s: sum(f.severity == s for f in found.findings) for s in ("error", "warning", "pass")}
    best = {"orientation": attrs.asdict(found.builds[0])} if found.builds else {}
    faults = [f"{f.check}: {f.what}" for f in found.findings if f.is_fault]
    notes = [f"{f.check}: {f.what}" for f in found.findings if not f.is_fault and f.remedy]
    return {
        "verdict": found.worst,
        "count": count,
        "figures": found.figures,
        "faults": faults,
        "notes": notes,
        "limits": standings(printer),
        **best,
    }


def standings(printer: Printer) -> dict[str, list[str]]:
    """Names of a printer's limits by their grounds: measured, published or assumed."""
    found: dict[str, list[str]] = {"measured": [], "published": [], "assumed": []}
    for name, limit in printer.limits.items():
        found[limit.standing].append(name)
    return found


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a check's `summary`."""
    count = summary["count"]
    lines = [f"{count['pass']} checks passed, {count['warning']} warnings, {count['error']} errors"]
    lines += summary.get("notes", [])
    if measured := summary["limits"]["measured"]:
        lines.append(f"measured limits: {', '.join(measured)}")
    lines.append(f"assumed limits: {len(summary['limits']['assumed'])} of {len(MEANING)}, see report.html")
    if "orientation" in summary:
        best = summary["orientation"]
        # Rounded first: no minus before a zero.
        towards = ", ".join(f"{round(x, 2) + 0.0:.2f}" for x in best["direction"])
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


def plan_of(job: Job) -> Plan:
    """Stages of a check with the expected seconds of each on two cores."""
    stages = {"part": 2.5, "faces": 1.5, "thickness and gaps": 1.5, "chambers and drains": 1.5}
    return [*stages.items(), ("layers", 0.5), ("build directions", 1.5), ("report", 4.0)]


USE_CASE = UseCase("check", LAYOUT, read_job, check_print, console_summary, plan=plan_of)
