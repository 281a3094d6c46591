"""report.html of a reproduction: the table beside the paper's, and what stands between them."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ...files import write_text
from ...placement.inclusion import RULES
from ...report.charts import label, signed
from ...report.html import cards, facts_table, figure, note, page, table
from ..simulate_and_place.report_data import package_versions
from . import charts, gripper
from .agreement import CANNOT_TELL, HELD, Agreement, agreement
from .columns import BENDING_KPA
from .open_study import OpenPoint, best, distance, effects
from .open_values import MOTION_KPA, OPEN, RULE
from .published import GRIPPER, name_of
from .run import Found
from .scatter import Scatter

Array = np.ndarray[Any, Any]

_WORDS = {
    "volume_fraction": "each element is stiffened by the volume fraction of it inside the sensor",
    "intersect": "the rule of the paper: every element that the sensor intersects is stiffened entirely",
}
# The rule that decides comes first.
_ORDER = sorted(RULES, key=lambda rule: rule != RULE)
# Share of the variance that a polynomial must predict before its shares are shown.
_PREDICTED = 0.5
# Goals of the reproduction: rank correlation by column.
GOALS = {"0.75x": 0.9, "1.0x": 0.9, "1.5x": 0.8, GRIPPER: 0.9}


def write_report(found: Found, path: Path) -> None:
    """Write report.html; raises OutputError."""
    write_text(path, report(found))


def report(found: Found) -> str:
    """The page as HTML text."""
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
            ("meshes", "Mesh dependence of the table", _meshes(found)),
            ("open", "Parameters that the paper does not print", _open(found)),
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
    ends = [_angle(a) for a in middle.fine.angle_deg[[0, -1]]]
    facts.append(("angle at 1.0x, -20 and 50 kPa", f"{ends[0]}, {ends[1]} (paper -65, 50)"))
    return facts


def _angle(value: float) -> str:
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
            "gripper's fingers and the random meshes are not."
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
        unclear = sum(s.verdict == CANNOT_TELL for s in found.statements(rule))
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


def _by_column(found: Found, family: str, rule: str) -> dict[str, Scatter]:
    every = found.scatters()
    keys = [(family, rule, scale) for scale in found.paper.scales]
    return {name_of(scale): every[key] for key in keys if key in every for scale in key[2:]}


def _meshes(found: Found) -> str:
    """Tables and pictures of the random meshes, or nothing where there are none."""
    html = ""
    rows = []
    for (family, rule, scale), s in sorted(found.scatters().items()):
        chosen = s.chosen
        most = np.argsort(-chosen)[:3]
        names = [p.name for p in found.paper.paths]
        theirs = int(np.argmin(s.theirs))
        cells = [
            name_of(scale), family, rule.replace("_", " "), len(s.J_hat), f"{s.volume_ratio.mean():.1f}",
            f"{s.spearman.min():.2f} .. {np.median(s.spearman):.2f} .. {s.spearman.max():.2f}",
            f"{(s.spearman >= GOALS[name_of(scale)]).mean():.0%}",
            ", ".join(f"{label(names[i])} {chosen[i]:.0%}" for i in most if chosen[i] > 0),
            f"{label(names[theirs])} {chosen[theirs]:.0%}",
            f"{s.agree[1, 0]:.0%}",
            f"{s.J_hat.mean() / s.theirs.mean():.2f}",
        ]  # fmt: skip
        rows.append((cells, False))
    if not rows:
        return ""
    head = [
        ("scale", ""), ("elements", ""), ("rule", ""), ("meshes", "n"), ("volume", "n"),
        ("rank correlation", ""),
        ("goal reached", "n"), ("chosen", ""), ("paper's chosen", ""), ("α₁ α₂ as in the paper", "n"),
        ("size", "n"),
    ]  # fmt: skip
    html += (
        "<p>Random meshes of the kind the paper may have used: the whole body in linear tetrahedra of about "
        "5 mm by Gmsh, not aligned with the anchors. The seed varies all element sizes by up to 10 %, so "
        "that any of them could have been used. <i>grown</i>: elements grow with the unit; <i>same</i>: 5 "
        "mm at every scale; <i>coarse</i>: 9 mm at 1.0x. Volume: stiffened volume over the sensor's volume. "
        "Rank correlation: minimum, median and maximum over all meshes. Magnitude: mean J_hat over the "
        "paper's.</p>"
    )
    html += table(f"From: {found.origin['meshes']}.", head, rows)
    for family in ("grown", "same", "coarse"):
        picked = _by_column(found, family, "intersect")
        if picked:
            svg = charts.mesh_scatter(picked, found.paper.paths)
            words = f"Dots: one mesh each ({family}, intersect). Crosses: the paper."
            html += figure(svg, words, words)
            svg = charts.orders(picked, found.paper.paths)
            words = (
                f"Percentage of meshes in which two paths are in the paper's order ({family}, intersect); "
                "no number: 100 %."
            )
            html += figure(svg, words, words)
    return html


def _open(found: Found) -> str:
    paper = found.paper
    solved = [p for p in found.points if not p.name and not p.failed]
    if len(solved) < len(OPEN) + 2:
        return ""
    failed = sum(bool(p.failed) for p in found.points)
    touching = sum(p.touches for p in solved)
    html = (
        f"<p>{len(solved) + failed} sets of values within the ranges below, one set for all three units "
        f"each (refine 0.5, volume fraction): {failed} have a limit point within the range; in {touching} "
        "of the others walls intersect before the end of the range; self-contact is not modelled.</p>"
    )
    rows = [([o.name, f"{o.variable.low:g} to {o.variable.high:g}", o.why], False) for o in OPEN]
    html += table(f"From: {found.origin['points']}.", [("parameter", ""), ("range", ""), ("why", "")], rows)
    found_effects = effects(solved, paper)
    told = [e for e in found_effects if e.Q2 >= _PREDICTED]
    words = (
        "Share in percent of a result's variance due to a parameter, alone and in interaction (Sobol "
        "total index)."
    )
    if told:
        html += figure(charts.shares(told), words, words)
    head = [("figure", ""), ("least", "n"), ("most", "n"), ("variance predicted", "n")]
    rows = [
        ([signed(e.name), f"{e.low:.3g}", f"{e.high:.3g}", f"{e.Q2:.0%}" if e.Q2 > 0 else "none"], False)
        for e in found_effects
    ]
    html += table(
        "Over all sets; last column: variance of held-out sets predicted by the polynomial that the indices "
        "are computed from.",
        head,
        rows,
    )
    return html + _sets(found, solved)


def _sets(found: Found, solved: list[OpenPoint]) -> str:
    paper = found.paper
    named = [p for p in found.points if p.name and not p.failed]
    leading = best(solved, paper)[:5]
    head = [
        ("set", ""),
        *((name_of(s), "n") for s in paper.scales),
        *((f"{name_of(s)} size", "n") for s in paper.scales),
        ("chosen", ""),
        *((f"{p:g} kPa", "n") for p in MOTION_KPA),
        ("self-contact", ""),
        ("goals", ""),
        ("distance", "n"),
    ]
    rows = []
    for p in [*named, *leading]:
        agreed = _agreed(found, p)
        chosen = " ".join(label(paper.paths[int(J.argmin())].name) for J in p.J_hat)
        middle = paper.scales.index(1.0)
        touch = p.crossing_kPa[np.isfinite(p.crossing_kPa)]
        rows.append(
            (
                [
                    p.name or "of the design",
                    *(f"{rank:.2f}" for rank, _ in agreed),
                    *(f"{size:.2f}" for _, size in agreed),
                    chosen,
                    *(_angle(a) for a in p.angle_deg[middle]),
                    f"{touch[np.argmin(np.abs(touch))]:.3g} kPa" if len(touch) else "-",
                    "reached" if _reached(found, p) else "-",
                    f"{distance(p, paper):.3f}",
                ],
                _reached(found, p),
            )
        )
    words = (
        "Named sets, and the five sampled sets without self-contact that agree best. Rank correlation; "
        "magnitude, the mean J_hat over the paper's; path chosen at 0.75x, 1.0x and 1.5x; angles at 1.0x; "
        "distance as docs/reproduce.md has it."
    )
    return table(words, head, rows)


def _reached(found: Found, p: OpenPoint) -> bool:
    """Whether all columns reach the goals at once, walls apart."""
    wanted = [GOALS[name_of(scale)] for scale in found.paper.scales]
    ranks = [rank for rank, _ in _agreed(found, p)]
    return not p.touches and all(rank >= goal for rank, goal in zip(ranks, wanted, strict=True))


def _agreed(found: Found, p: OpenPoint) -> list[tuple[float, float]]:
    compared = [
        agreement(J, found.paper.column(scale), found.paper.paths)
        for scale, J in zip(found.paper.scales, p.J_hat, strict=True)
    ]
    return [(a.spearman, a.magnitude) for a in compared]


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
