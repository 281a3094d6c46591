"""The report of a reproduction: the table beside the paper's, and the differences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from mu_addon.files import write_text
from mu_addon.report.html import cards, facts_table, figure, note, page, table
from mu_addon.report.plots import label, signed
from mu_addon.run.versions import package_versions

from ..inclusion_rules import RULES
from . import charts, gripper
from .agreement import HELD, UNDECIDED, Agreement, agreement
from .found import Found
from .published import GRIPPER
from .table_columns import BENDING_KPA
from .values import RULE

Array = np.ndarray[Any, Any]
# Name, title and HTML text.
Section = tuple[str, str, str]

_WORDS = {
    "volume_fraction": "each element is stiffened by the volume fraction of it inside the sensor",
    "intersect": "the rule of the paper: every element that the sensor intersects is stiffened entirely",
}
# The rule that decides comes first.
_ORDER = sorted(RULES, key=lambda rule: rule != RULE)
# Goals of the reproduction: rank correlation by column.
GOALS = {"0.75x": 0.9, "1.0x": 0.9, "1.5x": 0.8, GRIPPER: 0.9}


def write_report(found: Found, path: Path, further: Sequence[Section] = ()) -> None:
    """Write report.html; raises OutputError. further: as `report` has it."""
    write_text(path, report(found, further))


def report(found: Found, further: Sequence[Section] = ()) -> str:
    """The page as HTML text; further: sections of other studies, before that on sampling."""
    return page(
        "Reproduction of the paper",
        "Exley, Nardin, Trunin, Cafiso, Beccai, Monolithic Units, arXiv:2511.13120: Table I, bending, and "
        f"the share of mesh and assumptions in the differences. Values: {found.settings.values_name}.",
        note(_remarks(found)),
        cards(_facts(found)),
        [
            ("table", "Table I", _table(found)),
            ("deviation", "Deviation along the length and over time", _deviations(found)),
            ("statements", "Statements of the paper", _statements(found)),
            ("bending", "Bending", _bending(found)),
            *further,
            ("sampling", "Sampling of the protocol", _sampling(found)),
            ("versions", "Versions", facts_table("package", "version", package_versions())),
        ],
    )


def _facts(found: Found) -> list[tuple[str, str]]:
    facts = []
    printed = {name: a for name, a in found.agreements(RULE).items() if name in found.paper.J_hat}
    for name, a in printed.items():
        facts.append((f"{name}, rank correlation", f"{a.spearman:.2f} (goal {GOALS[name]:g})"))
    same = [a.same_choice for a in printed.values()]
    facts.append(("the paper's path chosen, or tied", f"{sum(same)} of {len(same)}"))
    middle = next(c for c in found.columns if c.scale == 1.0)
    ends = [angle_words(a) for a in middle.fine.angle_deg[[0, -1]]]
    facts.append(("angle at 1.0x, -20 and 50 kPa", f"{ends[0]}, {ends[1]} (paper -65, 50)"))
    return facts


def angle_words(value: float) -> str:
    """An angle in degrees, or that it was not reached."""
    return f"{value:.0f}°" if np.isfinite(value) else "not reached"


def _remarks(found: Found) -> list[str]:
    remarks = []
    for c in found.columns:
        crossing = c.fine.crossing_kPa[np.isfinite(c.fine.crossing_kPa)]
        if len(crossing):
            where = " and ".join(f"{p:.3g}" for p in crossing)
            remarks.append(
                f"{c.name}: from {where} kPa on, walls intersect. Self-contact is not modelled, so states "
                "beyond this pressure are invalid."
            )
        if c.fine.stopped:
            remarks.append(f"{c.name}: the range of bending was not reached: {c.fine.stopped}.")
    remarks += [f"{name}: {o.remark}" for name, o in found.others.items() if o.remark]
    if GRIPPER in found.others:
        refine = min(found.settings.mesh.refine, gripper.REFINE)
        remarks.append(
            f"The gripper's columns are of one finger on a mesh of refine {refine:g}, closing freely and on "
            "each of the paper's cubes, without friction. Their mesh uncertainty is not known."
        )
    else:
        remarks.append("The gripper's column is not part of this run.")
    if found.settings.held_cells:
        remarks.append(
            f"The three units are clamped up to {found.settings.held_cells:g} cells above the base; the "
            "gripper's fingers are not."
        )
    if found.settings.mesh.order == 1:
        remarks.append("Linear elements lock in thin walls: these results are for a quick look only.")
    return remarks


def _table(found: Found) -> str:
    paper, html = found.paper, ""
    for rule in _ORDER:
        ours, spread = found.table(rule), found.uncertainty_mm(rule)
        agreed = found.agreements(rule)
        head = [("path", "")]
        for _ in ours:
            head += [("here", "n"), ("paper", "n")]
        rows = []
        for i, path in enumerate(paper.paths):
            cells = [f"{label(path.name)}  {path.anchors}"]
            for name in ours:
                mark = " *" if path.name == agreed[name].chosen else ""
                their_mark = " *" if path.name == agreed[name].theirs else ""
                cells += [f"{ours[name][i]:.3f}{mark}", f"{paper.like(name)[i]:.3f}{their_mark}"]
            rows.append((cells, False))
        rows += [(cells, False) for cells in _feet(agreed, spread)]
        groups = [("", 1), *((name, 2) for name in ours)]
        words = f"{rule.replace('_', ' ')}: {_WORDS[rule]}. J_hat in mm, * smallest of its column."
        html += table(words, head, rows, groups)
        alt = (
            "J_hat of every path, here and in the paper, one panel per column; the table above holds the "
            "numbers."
        )
        printed = {name: J for name, J in ours.items() if name in paper.J_hat}
        html += figure(charts.against_paper(printed, paper, paper.paths), "", alt)
    return html


def _feet(agreed: Mapping[str, Agreement], spread: Mapping[str, float]) -> list[list[str]]:
    """The last rows of a table: how its columns agree with the paper's."""
    feet = {
        "rank correlation": [f"{a.spearman:.2f}" for a in agreed.values()],
        "ratio to paper": [f"{a.magnitude:.2f}" for a in agreed.values()],
        "mesh uncertainty": [_doubt(spread[name]) for name in agreed],
        "tied with the best": [" ".join(map(label, a.tied)) or "-" for a in agreed.values()],
    }
    return [[title, *(cell for value in values for cell in (value, ""))] for title, values in feet.items()]


def _doubt(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "not known"


def _deviations(found: Found) -> str:
    html = f"<p>Rule: {escape(RULE.replace('_', ' '))}.</p>"
    for along in ("length", "time"):
        svg = charts.deviations(found.columns, RULE, found.paper.paths, along)
        words = "actuator's length" if along == "length" else "actuation"
        html += figure(
            svg, f"Average deviation along the {words}.", f"One panel per path, one line per scale: {along}."
        )
    return html


def _statements(found: Found) -> str:
    head = [("statement", ""), ("verdict", ""), ("numbers", "")]
    html = ""
    for rule in _ORDER:
        rows = [([s.text, s.verdict, s.numbers], False) for s in found.statements(rule)]
        held = sum(s.verdict == HELD for s in found.statements(rule))
        unclear = sum(s.verdict == UNDECIDED for s in found.statements(rule))
        words = (
            f"{rule.replace('_', ' ')}: {held} of {len(rows)} hold; {unclear} cannot be decided within "
            "the mesh uncertainty."
        )
        html += table(words, head, rows, css="stack")
    relative = {c.name: c.fine.J_hat(RULE).mean() / c.scale for c in found.columns}
    words = ", ".join(f"{name} {value:.3f}" for name, value in relative.items())
    html += (
        f"<p>Mean deviation over the scale, in mm at 1.0x ({escape(RULE.replace('_', ' '))}): {words}.</p>"
    )
    return html


def _bending(found: Found) -> str:
    paper = found.paper
    head = [("scale", ""), *((f"{p:g} kPa", "n") for p in BENDING_KPA), ("mesh", "n"), ("paper's range", "")]
    rows = []
    for c in found.columns:
        angles = [signed(f"{a:.1f}") if np.isfinite(a) else "-" for a in c.fine.angle_deg]
        low, high = paper.bending_deg[c.scale]
        rows.append(
            ([c.name, *angles, f"{c.angle_uncertainty_deg():.1f}", signed(f"{low:g} to {high:g}")], False)
        )
    caption = "Bending angle in degrees; mesh: largest difference to the coarser mesh."
    chart = figure(
        charts.bending(found.columns, paper),
        "Lines: here. Crosses: ends of the ranges that the paper prints as approximate, with 2.5 degrees.",
        "Angle against pressure of three scales, beside the paper's ends.",
    )
    return f'<div class="pair">{chart}</div>' + table(caption, head, rows)


def weightings(samples_kPa: Array) -> Mapping[str, Array]:
    """Weights (k,) of a protocol's instants under other samplings of the same motion."""
    ones = np.ones(len(samples_kPa))
    _, inverse, count = np.unique(samples_kPa, return_inverse=True, return_counts=True)
    return {
        "the grasp protocol, uniform in time": ones,
        "every pressure once": 1.0 / count[inverse],
        "vacuum alone": (samples_kPa < 0) * 1.0,
        "pressure alone": (samples_kPa > 0) * 1.0,
        "its two ends": ((samples_kPa == samples_kPa.min()) | (samples_kPa == samples_kPa.max())) * 1.0,
    }


def _sampling(found: Found) -> str:
    head = [("sampling", ""), *((c.name, "n") for c in found.columns), ("chosen", "")]
    rows = []
    for words, weight in weightings(found.samples_kPa).items():
        cells, chosen = [words], []
        for c in found.columns:
            over_time = np.array([d.over_time for d in c.fine.deviations(RULE)])
            a = agreement(over_time @ weight / weight.sum(), found.paper.J_hat[c.name], found.paper.paths)
            cells.append(f"{a.spearman:.2f}, {a.magnitude:.2f}")
            chosen.append(label(a.chosen))
        rows.append(([*cells, " ".join(chosen)], False))
    words = (
        "The paper prints neither times nor rates. Rank correlation, magnitude and chosen path by column, "
        "volume fraction."
    )
    return table(words, head, rows)
