"""The report of an optimisation: the outcome, the front, the units, the changes and their reasons."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...files import write_text
from ...report.html import cards, facts_table, figure, note, number, page, table
from ...run.progress import Progress
from ...run.versions import package_versions
from . import charts
from .words import sensitivities, shown

if TYPE_CHECKING:
    from .run import Optimised, Proposal


def write_report(found: Optimised, path: Path, progress: Progress, stopped: str) -> None:
    """Write report.html; raises OutputError. stopped: why an incomplete run stopped."""
    with progress.stage("report"):
        write_text(path, report(found, stopped))


def report(found: Optimised, stopped: str = "") -> str:
    """The report as one page of HTML."""
    robust = sum(p.checked.is_robust for p in found.proposals)
    lead = f"<p>{escape(found.words)}</p>" + cards(
        [
            ("units computed", str(len(found.search.observed))),
            ("Model A's", str(found.model_a)),
            ("proposed", str(len(found.proposals))),
            ("robust", str(robust)),
        ]
    )
    d = found.design
    return page(
        f"Optimisation of {d.unit.name}",
        f"{len(d.targets)} targets, {len(d.freedoms)} freedoms",
        note([f"Of the extended model: {words}." for words in found.left_out], stopped),
        lead,
        [
            ("front", "Front", _front(found)),
            ("units", "Proposed units", _units(found)),
            ("targets", "Targets and errors", _targets(found)),
            ("why", "Changes and reasons", _why(found)),
            ("sensitivity", "Effect of a tenth of each freedom", _sensitivity(found)),
            ("inputs", "Inputs", _inputs(found)),
            ("versions", "Versions", facts_table("package", "version", package_versions())),
        ],
    )


def _front(found: Optimised) -> str:
    if not any(o.sound for o in found.search.observed):
        return ""
    targets = [t for t in found.design.targets if t.quantity is not None]
    shown = charts.compared(found)
    html = ""
    if shown is not None:
        alt = f"{targets[shown[1]].name} against {targets[shown[0]].name} of all units computed."
        words = "All units computed; squares are proposed. Dashed lines are the targets."
        html += figure(charts.front(found, *shown), words, alt)
    words = "Largest misfit of any target, in its tolerances: below 1 all are met."
    html += figure(charts.course(found), words, "Misfit by the number of units computed.")
    return f'<div class="pair">{html}</div>'


def _units(found: Optimised) -> str:
    if not found.proposals:
        return ""
    units = [found.design.unit, *(p.unit for p in found.proposals)]
    body = found.design.body
    widest, tallest = charts.sizes(units, body)
    names = ["start", *(f"{p.place}: {_state(p)}" for p in found.proposals)]
    html = "".join(
        figure(charts.thumbnail(unit, widest, tallest, body), escape(name), f"Half section of unit {name}.")
        for unit, name in zip(units, names, strict=True)
    )
    rows = [
        (
            [
                f.name,
                shown(found.design.start[n]),
                *(shown(p.observed.design[n]) for p in found.proposals),
            ],
            False,
        )
        for n, f in enumerate(found.design.freedoms)
    ]
    head = [("freedom", ""), ("start", "n"), *((str(p.place), "n") for p in found.proposals)]
    return f'<div class="triple">{html}</div>' + table("Each is saved as proposed-N.toml.", head, rows)


def _state(p: Proposal) -> str:
    if p.checked.why:
        return "fails on a finer mesh"
    words = "robust" if p.checked.is_robust else "not robust"
    return f"{words}, print check: {p.checked.print_worst}" if p.checked.print_worst else words


def _targets(found: Optimised) -> str:
    html, d = "", found.design
    for p in found.proposals:
        rows = []
        for i, t in enumerate(found.design.targets):
            c = p.checked
            if t.quantity is None:
                verdict = _verdict(c.met[i], c.robust[i])
                rows.append(([t.name, t.words, c.print_worst, "", "", "", "", verdict], False))
                continue
            cells = [f"{v:.3g}" for v in (c.by_mesh[i], c.by_print[i], c.by_resin[i])]
            values = [number(float(f"{v:.5g}")) for v in (p.values[i], c.values[i])]
            verdict = _verdict(c.met[i], c.robust[i]) if t.goal is None else "objective"
            name = f"{t.name} [{t.unit}]" if t.unit else t.name
            rows.append(([name, t.words, *values, *cells, verdict], False))
        head = [
            ("target", ""), ("asked", ""), ("found", "n"), ("on a finer mesh", "n"), ("± mesh", "n"),
            ("± print", "n"), ("± resin", "n"), ("verdict", ""),
        ]  # fmt: skip
        caption = f"Unit {p.place}" + (f": {p.checked.why}" if p.checked.why else "")
        html += table(caption, head, rows)
        if p.checked.print_findings:
            html += note(p.checked.print_findings)
    words = (
        "Standard errors: the mesh's is the difference to a mesh of refinement "
        f"{d.check_refine:g}; a print's surfaces are off by {d.print_tolerance_mm:g} mm, the resin's modulus "
        f"by {d.modulus_tolerance:.0%}. Robust: met for all values within two standard errors of the three "
        "together."
    )
    return f"<p>{escape(words)}</p>{html}" if html else ""


def _verdict(met: bool, robust: bool) -> str:
    return "robust" if robust else "met" if met else "missed"


def _why(found: Optimised) -> str:
    html = ""
    for p in found.proposals:
        changed = "".join(f"<li>{escape(words)}</li>" for words in p.changes) or "<li>nothing</li>"
        moved = "".join(f"<li>{escape(words)}</li>" for words in p.reasons)
        html += f"<h3>Unit {p.place}</h3><ul>{changed}</ul>"
        html += (
            f"<p>Influences on each target, by its slopes at this unit:</p><ul>{moved}</ul>" if moved else ""
        )
    return html


def _sensitivity(found: Optimised) -> str:
    continuous = [f for f in found.design.freedoms if not f.discrete]
    if not found.proposals or not continuous:
        return ""
    p = found.proposals[0]
    judged = [t for t in found.design.targets if t.quantity is not None]
    rows = [
        ([t.name, *("-" if np.isnan(v) else f"{v:+.3g}" for v in row)], False)
        for t, row in zip(judged, sensitivities(found.design.freedoms, p.observed), strict=True)
    ]
    head = [("target", ""), *((f.name, "n") for f in continuous)]
    return table("At unit 1, in each target's unit; by adjoint gradients.", head, rows)


def _inputs(found: Optimised) -> str:
    d = found.design
    asked = [([t.name, t.words], False) for t in d.targets]
    free = [
        (
            [f.name, ", ".join(map(str, f.values)) if f.discrete else f"{f.low:g} to {f.high:g} {f.unit}"],
            False,
        )
        for f in d.freedoms
    ]
    facts = {
        "body": "the lattice's box" if d.body is None else d.body.name,
        "refinement of the search's mesh": d.settings.refine,
        "refinement of the check's mesh": d.check_refine,
        "walls and struts kept apart": d.self_contact,
        "most units": d.search.evaluations,
        "seed": d.search.seed,
        "resin": d.resin,
        "printer": d.printer,
        "extended model": found.has_model,
    }
    return (
        table("", [("target", ""), ("asked", "")], asked)
        + table("", [("freedom", ""), ("range", "")], free)
        + facts_table("setting", "", facts)
    )
