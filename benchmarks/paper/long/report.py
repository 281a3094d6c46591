"""The long studies' part of the page: how much of the table is the mesh, and what the paper leaves open."""

from __future__ import annotations

import numpy as np

from mu_addon.report.html import figure, table
from mu_addon.report.plots import label, signed

from ..table.agreement import agreement
from ..table.published import name_of
from ..table.report import GOALS, Section, angle_words
from . import charts
from .open_study import OpenPoint, best, distance, effects
from .open_values import MOTION_KPA, OPEN
from .run import LongFound
from .scatter import Scatter

# Share of the variance that a polynomial must predict before its shares are shown.
_PREDICTED = 0.5


def sections(found: LongFound) -> tuple[Section, Section]:
    """The sections that the long studies add to the table's page."""
    return (
        ("meshes", "Mesh dependence of the table", _meshes(found)),
        ("open", "Parameters that the paper does not print", _open(found)),
    )


def _by_column(found: LongFound, family: str, rule: str) -> dict[str, Scatter]:
    every = found.scatters()
    keys = [(family, rule, scale) for scale in found.table.paper.scales]
    return {name_of(scale): every[key] for key in keys if key in every for scale in key[2:]}


def _meshes(found: LongFound) -> str:
    """Tables and pictures of the random meshes, or nothing where there are none."""
    html = ""
    rows = []
    for (family, rule, scale), s in sorted(found.scatters().items()):
        chosen = s.chosen
        most = np.argsort(-chosen)[:3]
        names = [p.name for p in found.table.paper.paths]
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
            svg = charts.mesh_scatter(picked, found.table.paper.paths)
            words = f"Dots: one mesh each ({family}, intersect). Crosses: the paper."
            html += figure(svg, words, words)
            svg = charts.orders(picked, found.table.paper.paths)
            words = (
                f"Percentage of meshes in which two paths are in the paper's order ({family}, intersect); "
                "no number: 100 %."
            )
            html += figure(svg, words, words)
    return html


def _open(found: LongFound) -> str:
    paper = found.table.paper
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
    predicted = [e for e in found_effects if e.Q2 >= _PREDICTED]
    words = (
        "Share in percent of a result's variance due to a parameter, alone and in interaction (Sobol "
        "total index)."
    )
    if predicted:
        html += figure(charts.shares(predicted), words, words)
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


def _sets(found: LongFound, solved: list[OpenPoint]) -> str:
    paper = found.table.paper
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
                    *(angle_words(a) for a in p.angle_deg[middle]),
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
        "distance as docs/engineering/verification.md has it."
    )
    return table(words, head, rows)


def _reached(found: LongFound, p: OpenPoint) -> bool:
    """Whether all columns reach the goals at once, walls apart."""
    wanted = [GOALS[name_of(scale)] for scale in found.table.paper.scales]
    ranks = [rank for rank, _ in _agreed(found, p)]
    return not p.touches and all(rank >= goal for rank, goal in zip(ranks, wanted, strict=True))


def _agreed(found: LongFound, p: OpenPoint) -> list[tuple[float, float]]:
    compared = [
        agreement(J, found.table.paper.table_column(scale), found.table.paper.paths)
        for scale, J in zip(found.table.paper.scales, p.J_hat, strict=True)
    ]
    return [(a.spearman, a.magnitude) for a in compared]
