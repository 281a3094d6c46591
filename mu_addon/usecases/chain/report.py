"""The report of a chain: its shape, the way of its tip, its joints with their errors, and the assumptions."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ...files import write_bytes, write_text
from ...report.html import cards, facts_table, figure, note, page, picture_figure, table
from ...report.plots import signed
from . import charts

if TYPE_CHECKING:
    from .run import Running

FILES = {
    "chain.toml": "inputs of this run; unit_N.toml and protocol.csv belong to it",
    "tip.csv": "pressures, place and rotation of the tip over time, with half widths of 95 % intervals",
    "joints.csv": "every joint at states left out of its fit",
    "target.csv": "pressures that bring the tip to the target, if there is one",
    "chain.pvd": "motion of the units, for ParaView",
    "chain_*.png": "the chain at its start, most bent and at its end",
    "summary.json": "all results of this run as numbers",
    "log.ndjson": "log of this run",
}
ASSUMED = (
    "Each unit is an elastic joint between rigid plates: end planes stay plane, and units act on each "
    "other by the motion of these planes alone. A joint's potential is a polynomial of degree four about "
    "the unit's free state at each pressure, learned from its finite element model without weight. "
    "The weight of a unit acts at its centre of mass, which moves with both plates. Units do not touch "
    "each other. Inertia and air flow are neglected, and the material has no memory. The intervals "
    "include the error of the joints against the finite element model at held-out states, not the errors "
    "of mesh, print and resin."
)


def write_report(run: Running, stopped: str = "") -> None:
    """Write the pictures and report.html; `stopped`: why an incomplete run stopped."""
    if not run.states:
        return
    with run.progress.stage("report"):
        # They take most of the time: a run that was asked to stop leaves them out.
        pictures = {} if run.context.hurried else charts.pictures(run)
        for name, picture in pictures.items():
            write_bytes(run.folder / f"{name}.png", picture.png)
        shown = "".join(picture_figure(picture) for picture in pictures.values())
        sections = [
            ("shape", "The chain", f'<div class="many">{shown}</div>'),
            ("tip", "The tip", _tip(run)),
            ("target", "The target", _target(run)),
            ("joints", "The joints", _joints(run)),
            ("assumed", "Assumptions", f"<p>{escape(ASSUMED)}</p>"),
            ("files", "Files of this run", facts_table("file", "content", FILES)),
            ("versions", "Versions", facts_table("program", "version", run.context.summary["versions"])),
        ]
        names = ", ".join(dict.fromkeys(one.unit.name for one in run.job.units))
        lead = f'<div class="lead"><div>{_headline(run)}</div></div>'
        subtitle = f"{len(run.job.units)} units: {names}"
        write_text(
            run.folder / "report.html",
            page("Units in series", subtitle, note(run.warnings, stopped), lead, sections),
        )


def _headline(run: Running) -> str:
    last = run.states[-1]
    x, y, z = last.tip_mm
    words = f"At the end the tip is at ({x:.1f}, {y:.1f}, {z:.1f}) mm, turned by {last.angle_deg:.1f}°."
    if run.reach is not None:
        words = f"The tip ends {run.reach.miss_mm:.2g} mm from the target. " + words
    mass = sum(found.joint.mass_g for found in run.learned)
    facts = [
        ("mass of the units", f"{mass:.0f} g"),
        ("mass at the tip", f"{run.job.tip_mass_g:g} g"),
        ("largest angle", f"{max(state.angle_deg for state in run.states):.1f}°"),
        ("error of the tip, 95 %", f"{np.linalg.norm(last.tip_error_mm):.1f} mm"),
    ]
    return f'<p class="answer">{escape(signed(words))}</p>{cards(facts)}'


def _tip(run: Running) -> str:
    angle = np.array([state.angle_deg for state in run.states])
    error = np.array([state.angle_error_deg for state in run.states])
    pressures = np.array([state.pressures_kPa for state in run.states])
    named = {f"unit {n + 1}": column for n, column in enumerate(pressures.T)}
    html = figure(
        charts.tip_way(run),
        "Grey: lines through the plates; bar: 95 % at the end.",
        "path of the tip",
        "chart",
    )
    html += figure(
        charts.over_time(run.time_s, {"tip against base": angle}, "angle [deg]", error),
        "Band: 95 % by the joints' errors.",
        "angle of the tip over time",
        "chart",
    )
    html += figure(charts.over_time(run.time_s, named, "pressure [kPa]"), "", "pressures over time", "chart")
    return f'<div class="pair">{html}</div>'


def _target(run: Running) -> str:
    if run.reach is None or run.job.target is None:
        return ""
    rows = [
        ([f"unit {n}", signed(f"{p:.2f}"), "yes" if end else "no"], False)
        for n, (p, end) in enumerate(zip(run.reach.pressures_kPa, run.reach.at_bound, strict=True), 1)
    ]
    at = ", ".join(f"{v:g}" for v in run.job.target.reach)
    words = (
        f"Target ({signed(at)}) mm in the base's frame, missed by {run.reach.miss_mm:.3g} mm after "
        f"{run.reach.iterations} steps. Of several solutions one with low pressures is taken; a "
        "pressure at its bound cannot change further."
    )
    return f"<p>{escape(words)}</p>" + table("", [("unit", ""), ("kPa", "n"), ("at its bound", "")], rows)


def _joints(run: Running) -> str:
    head = [("unit", ""), ("turn [deg]", "n"), ("mass [g]", "n"), ("kPa", ""), ("bending [N mm/rad]", "n")]
    head += [("twist [N mm/rad]", "n"), ("axial [N/mm]", "n"), ("error [deg]", "n"), ("error [mm]", "n")]
    rows = []
    for n, joint in enumerate(run.context.summary["joints"], 1):
        low, high = joint["pressure_kPa"]
        cells = [f"{n}: {joint['unit']}", f"{joint['turn_deg']:g}", f"{joint['mass_g']:.1f}"]
        cells += [signed(f"{low:g} to {high:g}"), f"{joint['bending_N_mm_per_rad']:.0f}"]
        cells += [f"{joint['twist_N_mm_per_rad']:.0f}", f"{joint['axial_N_per_mm']:.3f}"]
        cells += [f"{joint['error_deg']:.2f}", f"{joint['error_mm']:.2f}"]
        rows.append((cells, False))
    words = (
        "Stiffness without pressure of a unit about its free state. Error: root mean square, over the states "
        "left out of the fit, of the displacement caused by the error in the joint's load (joints.csv)."
    )
    return f"<p>{escape(words)}</p>" + table("", head, rows)
