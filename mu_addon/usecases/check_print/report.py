"""The report of a printability check: verdict, location of each finding, build directions."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ...design.printing.check import PrintCheck
from ...design.printing.finding import Finding, counted
from ...design.printing.orientation import Build, directions
from ...design.printing.printer import MEANING
from ...design.printing.repair import Repair
from ...design.printing.slices import Slice, even_heights, signed_area, slices
from ...design.solid import chamber
from ...design.surface import Triangles, Vertices
from ...files import write_bytes, write_text
from ...report import plots
from ...report.html import cards, facts_table, figure, note, page, picture_figure, table
from ...report.render import Floats, Part, fit, png, render
from ...report.results import Picture
from ...report.shapes import ball, tube
from ...run.progress import Progress
from ...run.versions import package_versions
from .job import Job

FILES = {
    "check.toml": "inputs of this check",
    "printer.toml": "limits of the printer; a template for `check --printer`",
    "unit.toml": "parameters of the unit",
    "part.stl": "the part that was checked",
    "check.json": "every finding with its locations, and every build direction",
    "summary.json": "key figures",
    "log.ndjson": "log of this run",
}
COLORS = {"error": (0.75, 0.05, 0.10), "warning": (0.95, 0.55, 0.0)}
GREY = (0.66, 0.70, 0.76)
MOST_ROWS = 12
# Number of layers drawn by default.
LAYERS = 12


def write_report(
    job: Job,
    vertices: Vertices,
    triangles: Triangles,
    found: PrintCheck,
    folder: Path,
    progress: Progress,
    mended: Repair | None = None,
    stopped: str = "",
) -> None:
    """Write places.png and report.html; `stopped`: why an incomplete run stopped."""
    with progress.stage("report"):
        picture = places_picture(vertices, triangles, found, job.direction)
        write_bytes(folder / "places.png", picture.png)
        write_text(folder / "report.html", report(job, vertices, triangles, found, picture, mended, stopped))


def report(
    job: Job,
    vertices: Vertices,
    triangles: Triangles,
    found: PrintCheck,
    picture: Picture,
    mended: Repair | None = None,
    stopped: str = "",
) -> str:
    """The whole report as HTML text."""
    files = {name: text for name, text in FILES.items() if name != "unit.toml" or job.unit is not None}
    sections = [
        ("findings", "What was checked", _findings(found)),
        ("layers", "Layers", _layers(job, vertices, triangles)),
        ("orientation", "Build direction", _orientation(found.builds)),
        ("limits", "The printer's limits", _limits(job)),
        ("files", "Files of this check", facts_table("file", "content", files)),
        ("versions", "Versions", facts_table("program", "version", package_versions())),
    ]
    if mended is not None:
        sections.insert(0, ("repair", "Repair", _repair(mended)))
    assumed = sum(limit.standing == "assumed" for limit in job.printer.limits.values())
    notes = [
        (
            f"{assumed} of {len(MEANING)} limits are assumed, because no published values were found for "
            "this resin. Print the parts limit-... of `specimens`, and give the measured limits by --limits."
        )
    ]
    measured = [MEANING[name] for name, limit in job.printer.limits.items() if limit.measured]
    notes = [*(notes if assumed else []), *([f"Measured: {', '.join(measured)}."] if measured else [])]
    lead = f'<div class="lead"><div>{_headline(job, found)}</div>{picture_figure(picture)}</div>'
    return page(f"Print check: {job.name}", job.printer.title, note(notes, stopped), lead, sections)


def _headline(job: Job, found: PrintCheck) -> str:
    faults = [f for f in found.findings if f.severity == "error"]
    warned = [f for f in found.findings if f.severity == "warning"]
    words = {
        "error": f"<strong>Not printable</strong>: {_joined(faults)}.",
        "warning": f"<strong>Printable with warnings</strong>: {_joined(warned)}.",
        "pass": "<strong>Printable</strong>: every check passed.",
    }[found.worst]
    figures = found.figures
    facts = [("size", " x ".join(f"{figures[f'{a}_mm']:.4g}" for a in "xyz") + " mm")]
    facts.append(("resin in the part", f"{figures['volume_ml']:.3g} ml"))
    if "mass_g" in figures:
        facts.append(("mass", f"{figures['mass_g']:.3g} g"))
    if "chamber_ml" in figures:
        facts.append(("resin to drain from chambers", f"{figures['chamber_ml']:.3g} ml"))
    if "trapped_ml" in figures:
        facts.append(("resin trapped in sealed voids", f"{figures['trapped_ml']:.3f} ml"))
    up = direction_name(job.direction)
    return (
        f'<p class="answer">{words}</p><p>Built along {escape(up)}, away from the platform, on supports. '
        "Spheres mark findings: red must be corrected, orange needs a decision."
        f"</p>{cards(facts)}"
    )


def _joined(findings: Sequence[Finding]) -> str:
    return escape("; ".join(f"{f.check}, {f.what}" for f in findings))


def _findings(found: PrintCheck) -> str:
    words = {"error": "FAILED", "warning": "warning", "pass": "passed", "info": "note"}
    order = ("error", "warning", "info", "pass")
    head = [("check", ""), ("outcome", ""), ("found", "text"), ("limit", "n"), ("where, mm", "line")]
    rows = []
    for f in sorted(found.findings, key=lambda f: order.index(f.severity)):
        limit = "" if f.limit is None else f"{f.limit:g} {f.unit}".strip() + (" *" if f.assumed else "")
        remedy = f". {f.remedy[:1].upper()}{f.remedy[1:]}." if f.remedy else ""
        rows.append(([f.check, words[f.severity], f.what + remedy, limit, _where(f)], False))
    return table("* assumed, see the printer's limits", head, rows) + _places(found)


def _repair(mended: Repair) -> str:
    """Changes by the repair before the check, and their size."""
    rows = [([change.what, str(change.count)], False) for change in mended.changes]
    rows += [
        (["largest move of a vertex, mm", f"{mended.largest_move_mm:.2g}"], False),
        (["volume of the file's surface, mm³", f"{mended.volume_before_mm3:.6g}"], False),
        (["volume once repaired, mm³", f"{mended.volume_after_mm3:.6g}"], False),
    ]
    words = "<p>The file was repaired where there is only one way to; part.stl is the repaired part.</p>"
    return words + table("", [("change", "text"), ("", "n")], rows)


def _where(f: Finding) -> str:
    if not len(f.places):
        return ""
    first = ", ".join(f"{x:.2f}" for x in f.places[0])
    return f"({first})" + (f" + {f.count - 1}" if f.count > 1 else "")


def _places(found: PrintCheck) -> str:
    """Table of all locations of every fault."""
    rows = []
    for f in found.findings:
        if f.is_fault and len(f.places) > 1:
            text = "; ".join(f"({x:.1f}, {y:.1f}, {z:.1f})" for x, y, z in f.places[:MOST_ROWS])
            rows.append(([f.check, text + (" ..." if f.count > MOST_ROWS else "")], False))
    return table("Locations in mm, worst first", [("check", ""), ("places", "text")], rows) if rows else ""


def _orientation(builds: Sequence[Build]) -> str:
    if not builds:
        return ""
    head = [
        ("build direction", ""),
        ("cup ml", "n"),
        ("in chambers mm²", "n"),
        ("islands", "n"),
        ("to support mm²", "n"),
        ("height mm", "n"),
        ("Pareto-optimal", ""),
    ]
    rows = []
    for k, b in enumerate([*builds[:MOST_ROWS], *(b for b in builds[MOST_ROWS:] if b.best_among)]):
        name = direction_name(b.direction) + ("" if b.fits else " (does not fit)")
        cells = [
            f"{b.cup_ml:.2g}",
            f"{b.inner_mm2:.0f}",
            b.islands,
            f"{b.support_mm2:.0f}",
            f"{b.height_mm:.0f}",
        ]
        rows.append(([name, *cells, "yes" if b.best_among else ""], k == 0))
    words = (
        f"{len(builds)} directions, pointing away from the platform: faces, edges and corners of a cube, "
        "and eight tilted by 20 degrees from the best of these. Order of criteria: the "
        "part fits, no cup of 0.5 ml or more, least flat surface in chambers (supports there cannot be "
        "removed), fewest islands, least supported surface, least height. A direction is Pareto-optimal if "
        "no other is at least as good in all of these criteria and better in one."
    )
    svg = trade_off(builds)
    alt = "Supported surface against the largest cup, one point per build direction"
    caption = (
        "Supported surface against the largest cup: one point per build direction, recommended "
        "direction in orange."
    )
    return f"<p>{escape(words)}</p>" + figure(svg, caption, alt, "chart") + table("", head, rows)


def _limits(job: Job) -> str:
    head = [("limit", "text"), ("value", "n"), ("rests on", ""), ("source", "text")]
    rows = [
        ([MEANING[name], f"{limit.value:g}", limit.standing, limit.source], False)
        for name, limit in job.printer.limits.items()
    ]
    return table("mm, degrees, ml and g/ml", head, rows)


def _layers(job: Job, vertices: Vertices, triangles: Triangles) -> str:
    """Pictures of the requested layers, or of some evenly spaced."""
    heights = job.layers or even_heights(vertices, job.direction, LAYERS)
    # A file's chamber may lie elsewhere than its unit's.
    within = chamber(job.unit) if job.stl is None and job.unit is not None else None
    found = slices(vertices, triangles, job.direction, heights, within)
    if not found:
        return "<p>The surface encloses no volume: it has no layers.</p>"
    caption = (
        "Layers by their height above the part's lowest point: material in grey; areas that a layer "
        "encloses, such as a chamber, in blue with its size. A unit's chamber is also blue at its inlet."
    )
    return figure(layer_pictures(found), caption, "Sections of the part at several heights")


def layer_pictures(found: Sequence[Slice]) -> str:
    """Sections of a part side by side, to one scale, as SVG text."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    across = 4
    rows = -(-len(found) // across)
    points = np.concatenate([ring for s in found for ring in s.outlines])
    low, high = points.min(axis=0), points.max(axis=0)
    wide = plots.WIDTH * 1.6
    tall = (0.4 + wide / across * float((high - low)[1] / (high - low)[0])) * rows
    with plots.canvas(wide, tall) as (chart, svg):
        for k, section in enumerate(found):
            axes = chart.add_subplot(rows, across, k + 1)
            blue = plots.BY_LENGTH[3]
            for ring in section.open_chamber:
                axes.add_patch(PathPatch(Outline(np.vstack([ring, ring[:1]]), closed=True), fc=blue, lw=0))
            # Holes last, filled: material may stand in them.
            for ring in sorted(section.outlines, key=lambda ring: abs(signed_area(ring)), reverse=True):
                edge = Outline(np.vstack([ring, ring[:1]]), closed=True)
                color = GREY if signed_area(ring) > 0 else blue
                axes.add_patch(PathPatch(edge, facecolor=color, edgecolor=plots.INK, linewidth=0.3))
            title = f"{section.height_mm:.1f} mm"
            inside_mm2 = section.enclosed_mm2 + section.open_mm2
            if inside_mm2 >= 1.0:
                title += f", {inside_mm2:.0f} mm²"
            axes.set_title(title, fontsize=8)
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
            axes.axis("off")
        chart.tight_layout(pad=0.3)
    return svg()


def direction_name(direction: Sequence[float]) -> str:
    """A direction as text: +z, +x−y, or `20° from +z toward −x`."""
    way = np.asarray(direction, float) / np.linalg.norm(direction)
    every = directions()
    k = int((every @ way).argmax())
    if every[k] @ way > np.cos(np.radians(1.0)):
        return _signs(every[k])
    axis = every[int((every[:6] @ way).argmax())]
    aside = way - (way @ axis) * axis
    toward = every[int((every @ aside).argmax())]
    return f"{np.degrees(np.arccos(way @ axis)):.0f}° from {_signs(axis)} toward {_signs(toward)}"


def _signs(way: Floats) -> str:
    return "".join(
        f"{'+' if s > 0 else '−'}{a}" for a, s in zip("xyz", way.tolist(), strict=True) if abs(s) > 1e-9
    )


def trade_off(builds: Sequence[Build]) -> str:
    """Surface to support against the largest cup, as SVG text."""
    with plots.canvas(plots.WIDTH, 3.0) as (chart, svg):
        axes = chart.add_axes((0.15, 0.16, 0.81, 0.78))
        x = np.array([b.support_mm2 for b in builds]) / 100.0
        y = np.array([b.cup_ml for b in builds])
        optimal = np.array([b.best_among for b in builds])
        axes.plot(x[~optimal], y[~optimal], "o", color=plots.QUIET, markersize=4, alpha=0.7)
        axes.plot(x[optimal], y[optimal], "o", color=plots.BY_LENGTH[0], markersize=6)
        axes.plot(x[:1], y[:1], "o", color=plots.CHOSEN, markersize=9)
        axes.annotate(
            direction_name(builds[0].direction),
            (x[0], y[0]),
            (9, 7),
            textcoords="offset points",
            fontsize=8,
            color=plots.CHOSEN,
        )
        axes.set(xlabel="flat surface to support [cm²]", ylabel="largest cup [ml]")
        axes.set_xlim(0.0, 1.08 * float(x.max(initial=1.0)))
        axes.set_ylim(-0.04 * max(float(y.max()), 0.1), 1.08 * max(float(y.max()), 0.1))
    return svg()


def places_picture(
    vertices: Vertices, triangles: Triangles, found: PrintCheck, up: Sequence[float], width: int = 760
) -> Picture:
    """The part, seen through, with a ball at each place of each fault, and an arrow along the build."""
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    parts = [Part(vertices, triangles, GREY, opacity=0.15)]
    count = 0
    for f in found.findings:
        if f.is_fault:
            count += len(f.places)
            parts += [Part(*ball(place, 0.016 * size), COLORS[f.severity], whole=True) for place in f.places]
    way = np.asarray(up, float) / np.linalg.norm(up)
    foot = vertices.mean(axis=0) + np.array([0.0, -0.75 * np.ptp(vertices[:, 1]), 0.0])
    arrow = np.stack([foot - 0.1 * size * way, foot + 0.1 * size * way])
    parts.append(Part(*tube(arrow, 0.005 * size), plots_ink(), whole=True))
    parts.append(Part(*_cone(arrow[1], way, 0.015 * size, 0.05 * size), plots_ink(), whole=True))
    towards, aspect = (1.0, -0.45, 0.3), 0.85
    camera = fit(parts, towards, aspect=aspect)
    image = render(parts, camera, width, round(width / aspect), background=(1.0, 1.0, 1.0), layers=4)
    caption = (
        f"{counted(count, 'place', 'places')}; the arrow is the build direction, away from the platform."
    )
    return Picture(png(image), caption, "Transparent view of the part with spheres at the findings")


def plots_ink() -> tuple[float, float, float]:
    """The ink of charts as a colour of a picture."""
    ink = plots.INK
    return tuple(int(ink[k : k + 2], 16) / 255.0 for k in (1, 3, 5))  # type: ignore[return-value]


def _cone(base: Any, way: Any, radius: float, height: float, sides: int = 24) -> tuple[Any, Any]:
    from ...design.printing.voxels import frame_along

    x, y, z = frame_along(way)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    rim = base + radius * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y)
    points = np.concatenate([rim, [base, base + height * z]])
    i = np.arange(sides)
    j = (i + 1) % sides
    sides_ = np.stack([i, j, np.full(sides, sides + 1)], 1)
    bottom = np.stack([j, i, np.full(sides, sides)], 1)
    return points, np.concatenate([sides_, bottom])
