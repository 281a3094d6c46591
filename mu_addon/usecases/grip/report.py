"""The report of a gripper: the part, its grasps, its light signal, its sensor paths, and the assumptions."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ...design.gripper import SECTIONS, GripperSolid
from ...design.quantity import describe
from ...files import write_bytes, write_text
from ...report.html import cards, facts_table, figure, note, page, picture_figure, table
from ...report.plots import label, signed
from ...report.results import Picture
from ...run.versions import package_versions
from . import charts as pictures
from .phases import MEANING

if TYPE_CHECKING:
    from .run import Gripping

FILES = {
    "grip.toml": "inputs of this run",
    "gripper.toml": "gripper parameters; unit.toml holds those of its units",
    "protocol.csv": "pressure and phases",
    "gripper.stl": "the printable part, mm",
    "gripper.3mf": "the same as 3MF",
    "grasp_SIDE.csv": "time series of the grasp of a cube",
    "pull_SIDE.csv": "friction capacity against displacement of the cube",
    "cube-SIDE": "its motion: finger.pvd (ParaView), motion/, gripper.npz, left.pc2, right.pc2 (Blender)",
    "summary.json": "all results of this run as numbers",
    "log.ndjson": "log of this run",
}


def write_report(run: Gripping, stopped: str = "") -> None:
    """Write the pictures and report.html; `stopped`: why an incomplete run stopped."""
    if run.solid is None:
        return
    with run.progress.stage("report"):
        versions = run.context.summary["versions"] = package_versions()
        # Pictures take most of the time: a run that was asked to stop leaves them out.
        part, frames = (None, {}) if run.context.hurried else _write_pictures(run, run.solid)
        write_text(run.folder / "report.html", report(run, part, frames, versions, stopped))


def _write_pictures(run: Gripping, solid: GripperSolid) -> tuple[Picture, dict[float, list[Picture]]]:
    """Draw and write the part, and the phases of each grasp by the cube's side in mm."""
    part = pictures.part_picture(run.job.gripper, solid)
    write_bytes(run.folder / "gripper.png", part.png)
    frames = {}
    for side, found in run.grasps.items():
        assert run.mesh is not None
        frames[side] = pictures.frames(run.job.gripper, run.mesh, found)
        for name, picture in zip(MEANING, frames[side], strict=True):
            write_bytes(run.folder / f"frame_{side:g}_{name}.png", picture.png)
    return part, frames


def report(
    run: Gripping,
    part: Picture | None,
    frames: dict[float, list[Picture]],
    versions: dict[str, str],
    stopped: str = "",
) -> str:
    """The whole report as HTML text, of all finished stages."""
    job = run.job
    sections = [
        ("frames", "The grasp, phase by phase", _frames(run, frames)),
        ("force", "Forces", _forces(run)),
        ("lift", "Lifting", _lift(run)),
        ("light", "Waveguide signal", _light(run)),
        ("assumed", "Assumptions", _assumed(run)),
        ("files", "Files of this run", facts_table("file", "content", FILES)),
        ("versions", "Versions", facts_table("program", "version", versions)),
    ]
    gap = job.gripper.fingers.gap_mm
    subtitle = f"Two {job.gripper.unit.name} {gap:g} mm apart, {label(job.gripper.path)} in each"
    lead = f'<div class="lead"><div>{_headline(run)}</div>{picture_figure(part) if part else ""}</div>'
    return page(f"Gripper: {job.gripper.name}", subtitle, note(run.warnings, stopped), lead, sections)


def _headline(run: Gripping) -> str:
    summary = run.context.summary
    x, y, z = summary["size_mm"]
    facts = [
        ("part", f"{x:g} x {y:g} x {z:.4g} mm"),
        ("resin", f"{summary['gates']['volume_mm3'] / 1e3:.3g} ml"),
    ]
    sentences = []
    for side, found in run.grasps.items():
        hold, lift = found.end("iii"), found.lift
        facts.append((f"{side:g} mm, plateau", f"{found.angle_deg[hold]:.1f}°, {found.normal_N[hold]:.2f} N"))
        sentences.append(
            f"The cube of {side:g} mm is lifted: friction can carry {lift.margin:.1f} times its weight."
            if lift.held
            else f"The cube of {side:g} mm is dropped: friction can carry {lift.capacity_N:.2g} N of "
            f"{lift.weight_N:.2g} N."
        )
    words = " ".join(sentences) or "The printable part passed every geometry check."
    return f'<p class="answer">{escape(words)}</p>{cards(facts)}'


def _frames(run: Gripping, frames: dict[float, list[Picture]]) -> str:
    if not frames:
        return ""
    meaning = "; ".join(f"{name}: {words}" for name, words in MEANING.items())
    html = f"<p>{escape(meaning)}. The gripper hangs, tips down; fingers are cut open.</p>"
    for side, every in frames.items():
        html += f"<h3>Cube of {side:g} mm</h3>"
        html += f'<div class="many">{"".join(picture_figure(picture) for picture in every)}</div>'
    shapes = pictures.shapes(run.job.gripper, run.grasps)
    return html + figure(shapes, "Lines of anchors; thin lines: the cubes.", "shapes of the fingers", "chart")


def _forces(run: Gripping) -> str:
    if not run.grasps:
        return ""
    charts = [
        ("normal force of a finger [N]", {s: g.normal_N for s, g in run.grasps.items()}),
        ("force of a finger along z, down [N]", {s: g.down_N for s, g in run.grasps.items()}),
        ("bending angle [deg]", {s: g.angle_deg for s, g in run.grasps.items()}),
    ]
    html = "".join(
        figure(pictures.over_time(run.grasps, values, words), "", words, "chart") for words, values in charts
    )
    head = [("cube [mm]", ""), ("phase", ""), ("kPa", "n"), ("angle [deg]", "n"), ("normal [N]", "n")]
    head += [("down [N]", "n"), ("sticking [%]", "n"), ("slip [mm]", "n"), ("gap error [mm]", "n")]
    rows = []
    for side, g in run.grasps.items():
        for name in MEANING:
            k = g.end(name)
            cells = [f"{side:g}", f"{name}, end", f"{g.pressure_kPa[k]:g}", f"{g.angle_deg[k]:.1f}"]
            cells += [f"{g.normal_N[k]:.3f}", f"{g.down_N[k]:.3f}"]
            touching = g.area_mm2[k] > 0
            cells += [f"{100 * g.sticking[k]:.0f}" if touching else "", f"{g.slid_mm[k]:.2f}"]
            rows.append(([*map(signed, cells), f"{g.deepest_mm[k]:.2f}"], False))
    words = (
        "Values of one whole finger. Slip: largest accumulated slip of any contact point. Gap error: "
        "largest penetration of the finger into the cube, which the penalty method admits."
    )
    return f'<div class="pair">{html}</div>' + table(words, head, rows)


def _lift(run: Gripping) -> str:
    if not run.grasps:
        return ""
    words = (
        "A closing finger also elongates and pushes the cube onto its support. The gripper must rise by "
        "some millimetres until friction has reversed and carries the weight; then the cube leaves its "
        "support."
    )
    head = [("cube [mm]", ""), ("mass [g]", "n"), ("weight [N]", "n"), ("held", ""), ("rise [mm]", "n")]
    head += [("friction capacity [N]", "n"), ("capacity / weight", "n"), ("2 mu N / weight", "n")]
    rows = []
    for side, g in run.grasps.items():
        f = g.lift
        rise = f"{f.sag_mm:.2f}" if f.held else ""
        cells = [f"{side:g}", f"{g.cube.mass_g:.1f}", f"{f.weight_N:.3f}", "yes" if f.held else "no", rise]
        rows.append(([*cells, f"{f.capacity_N:.3f}", f"{f.margin:.1f}", f"{f.margin_by_rule:.1f}"], False))
    chart = figure(
        pictures.pulling(run.grasps),
        "Dots: friction equals the weight.",
        "force against displacement",
        "chart",
    )
    return f"<p>{escape(words)}</p>{chart}" + table("", head, rows)


def _light(run: Gripping) -> str:
    if not run.signals:
        return ""
    values = {side: 100.0 * signal.delta for side, signal in run.signals.items()}
    chart = pictures.over_time(run.grasps, values, "light lost, ΔV/Vf [%]")
    at_hold, error = {}, {}
    for side, signal in run.signals.items():
        k = run.grasps[side].end("iii")
        at_hold[side] = 100.0 * float(signal.delta[k])
        error[side] = 100.0 * float(signal.errors[k] * signal.transmitted[k]) / signal.at_rest
    each = "; ".join(signed(f"{s:g} mm: {v:.1f} ± {error[s]:.1f} %") for s, v in sorted(at_hold.items()))
    words = f"At the plateau: {each}."
    if len(at_hold) > 1:
        small, large = min(at_hold), max(at_hold)
        more = abs(at_hold[small]) - abs(at_hold[large])
        compared = "as much as" if abs(more) < 2.0 * np.hypot(error[small], error[large]) else "more than"
        if compared == "more than" and more < 0:
            compared = "less than"
        words += (
            f" Within the error of the ray tracing, the cube of {small:g} mm changes the light {compared} "
            f"that of {large:g} mm; the paper measured a larger signal for the smaller "
            f"cube{'.' if compared == 'more than' else '; this model does not reproduce that.'}"
        )
    about = (
        "Computed by ray tracing through the deformed waveguide of the chosen path. The loss is positive "
        "and relative to the light at rest. Both fingers have the same model, so their signals are equal. "
        "The optical constants of the resin are assumed: no published values were found."
    )
    return f"<p>{escape(words)}</p><p>{escape(about)}</p>" + figure(
        chart, "", "light over the phases", "chart"
    )


def _assumed(run: Gripping) -> str:
    gripper, grip = run.job.gripper, run.job.grip
    head = [("parameter", ""), ("value", "n"), ("unit", ""), ("why", "text")]
    rows = []
    for section in SECTIONS:
        values = getattr(gripper, section.section)
        for d in describe(section):
            why = d.source.removeprefix("assumed: ")
            rows.append(([f"{section.section}.{d.name}", f"{getattr(values, d.name):g}", d.unit, why], False))
    reason = {
        "friction": "published coefficients of dry elastomers on hard plastics are mostly 0.5 to 1 and above",
        "beyond_mm": (
            "distance of the cube's centre beyond the tips, so that their edges touch it near its centre"
        ),
        "pressure_MPa": "contact stiffness: reference pressure",
        "depth_mm": "penetration depth at that pressure",
        "stick_mm": "elastic slip before sliding",
        "halvings": "subdivision of the faces for contact points",
        "step_s": "largest time step",
    }
    for name, value in attrs.asdict(grip).items():
        rows.append(([f"grip.{name}", f"{value:g}", "", reason[name]], False))
    words = (
        "The paper does not give the size of its gripper, the pressures of its grasp other than 0, −20 and "
        "40 kPa, or the mass of its cubes. The plate is clamped, the weight of the fingers is neglected, "
        "and both fingers are equal. "
    )
    parts = "keep apart" if run.job.self_contact else "may pass through each other"
    words += f"The fingers are simulated as printed, strut by strut; their own walls and struts {parts}."
    return f"<p>{escape(words)}</p>" + table("", head, rows)
