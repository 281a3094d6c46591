"""The report of a parameter study: inputs varied, main effects, Pareto front, failures."""

from __future__ import annotations

import itertools
from html import escape
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...files import write_text
from ...report.html import cards, facts_table, figure, note, number, page, table
from ...report.plots import CHOSEN, INK, QUIET, canvas
from ...run.progress import Progress
from ...run.versions import package_versions
from .main_effects import Effect, main_effect, pareto_front
from .results import Found

Array = np.ndarray[Any, Any]

# Figures whose effects are shown by default.
USUAL = ("angle_range_deg", "mass_g", "J_hat_mm", "J_hat_mm lattice")
# Fewer points say nothing about an effect.
FEWEST = 4
MOST_ROWS = 200


def write_report(found: Found, path: Path, progress: Progress, stopped: str) -> None:
    """Write report.html; raises OutputError. stopped: why an incomplete run stopped."""
    with progress.stage("report"):
        write_text(path, report(found, stopped))


def report(found: Found, stopped: str = "") -> str:
    """The report as one page of HTML."""
    done, failed = found.done, found.failed
    waiting = len(found.rows) - len(done) - len(failed)
    remarks = (
        [f"{len(failed)} of {len(found.rows)} points failed: they are rows of points.csv, too."]
        if failed
        else []
    )
    if waiting:
        remarks.append(f"{waiting} points have not been run.")
    seconds = [row["seconds"] for row in done]
    lead = cards(
        [
            ("points", str(len(found.rows))),
            ("done", str(len(done))),
            ("failed", str(len(failed))),
            ("time per point", f"{np.mean(seconds):.1f} s" if seconds else "-"),
            ("largest memory", f"{max(row['memory_MB'] for row in done)} MB" if done else "-"),
        ]
    )
    p = found.plan
    return page(
        f"Parameter study of {p.inputs.unit.name}",
        f"{len(found.inputs)} inputs, {p.method.replace('_', ' ')}, {' + '.join(p.stages)}",
        note(remarks, stopped),
        lead,
        [
            ("effects", "Main effects", _effects(found)),
            ("pareto", "Pareto front", _fronts(found)),
            ("inputs", "Inputs varied", _inputs(found)),
            ("points", "Points", _points(found)),
            ("failures", "Failures", _failures(found)),
            ("versions", "Versions", facts_table("package", "version", package_versions())),
        ],
    )


def outputs_of(found: Found) -> list[str]:
    """Figures to show: those that the sweep names, else the usual ones that vary."""
    named = [*found.plan.minimize, *found.plan.maximize]
    wanted = [name for name in (named or USUAL) if name in found.outputs]
    return [name for name in wanted if len(_numbers(found, name)[0]) >= 2]


def _numbers(found: Found, output: str) -> tuple[list[dict[str, Any]], Array]:
    """Rows of solved points with a number for a figure, and that figure (n,)."""
    rows = [r for r in found.done if isinstance(r.get(output), int | float)]
    return rows, np.array([float(r[output]) for r in rows])


def _effects(found: Found) -> str:
    outputs = [name for name in outputs_of(found) if len(_numbers(found, name)[0]) >= FEWEST]
    if not outputs:
        return ""
    html = (
        "<p>Each dot is a study. The line joins means of studies with similar values of one input; bars are "
        "their standard error. The other inputs are averaged out.</p>"
    )
    shares: dict[str, list[str]] = {name: [] for name in found.inputs}
    for output in outputs:
        rows, y = _numbers(found, output)
        charts = ""
        for name in found.inputs:
            effect = main_effect([row[name] for row in rows], y)
            shares[name].append("-" if np.isnan(effect.share) else f"{effect.share:.0%}")
            charts += figure(
                effect_chart(effect, [row[name] for row in rows], y, name, output),
                "",
                f"{output} against {name}: one dot per study, and the mean.",
            )
        html += f'<h3>{escape(output)}</h3><div class="triple">{charts}</div>'
    caption = "First-order share of each result's variance due to one input, corrected for chance."
    head = [("input", ""), *((output, "n") for output in outputs)]
    return html + table(caption, head, [([name, *row], False) for name, row in shares.items()])


def effect_chart(effect: Effect, values: list[Any], y: Array, name: str, output: str) -> str:
    """Every study's figure against one input, and the means by its values."""
    with canvas(2.9, 2.3) as (drawn, svg):
        axes = drawn.add_axes((0.25, 0.22, 0.72, 0.73))
        places = {label: i for i, label in enumerate(effect.labels)}
        x = np.array([places[str(v)] if places else float(v) for v in values])
        axes.plot(x, y, "o", color=QUIET, markersize=3.5, alpha=0.7)
        axes.errorbar(
            effect.places, effect.mean, yerr=np.nan_to_num(effect.error), color=CHOSEN, marker="s",
            markersize=4, linewidth=1.6, elinewidth=1, capsize=2, linestyle="none" if places else "-",
        )  # fmt: skip
        if places:
            axes.set_xticks(range(len(places)), list(places))
            axes.set_xlim(-0.5, len(places) - 0.5)
        else:
            axes.locator_params(axis="x", nbins=5)
        axes.set(xlabel=name, ylabel=output)
    return svg()


def _fronts(found: Found) -> str:
    goals = [(name, 1.0) for name in found.plan.minimize] + [(name, -1.0) for name in found.plan.maximize]
    goals = [(name, sign) for name, sign in goals if name in found.outputs]
    rows = [r for r in found.done if all(isinstance(r.get(name), int | float) for name, _ in goals)]
    if len(goals) < 2 or len(rows) < 2:
        return ""
    costs = np.array([[sign * float(row[name]) for name, sign in goals] for row in rows])
    charts = ""
    for i, j in itertools.combinations(range(len(goals)), 2):
        front = pareto_front(costs[:, [i, j]])
        alt = f"{goals[j][0]} against {goals[i][0]}; {len(front)} of {len(rows)} studies are Pareto-optimal."
        charts += figure(front_chart(rows, goals[i], goals[j], front), "", alt)
    best = pareto_front(costs)
    order = best[np.argsort(costs[best, 0], kind="stable")]
    head = [("point", ""), *((name, "n") for name in (*(g for g, _ in goals), *found.inputs))]
    listed = [
        (
            [rows[n]["point"], *(_shown(rows[n][name]) for name in (*(g for g, _ in goals), *found.inputs))],
            False,
        )
        for n in order
    ]
    aims = ", ".join(f"{'small' if sign > 0 else 'large'} {escape(name)}" for name, sign in goals)
    caption = f"The {len(best)} of {len(rows)} points that are Pareto-optimal."
    return f'<p>Objectives: {aims}.</p><div class="pair">{charts}</div>' + table(caption, head, listed)


def front_chart(
    rows: list[dict[str, Any]], first: tuple[str, float], second: tuple[str, float], front: Array
) -> str:
    """Studies by two figures; the Pareto-optimal ones are joined and numbered."""
    x, y = (np.array([float(row[name]) for row in rows]) for name, _ in (first, second))
    with canvas(4.0, 3.2) as (drawn, svg):
        axes = drawn.add_axes((0.16, 0.15, 0.80, 0.80))
        axes.plot(x, y, "o", color=QUIET, markersize=4, alpha=0.7)
        order = front[np.argsort(x[front], kind="stable")]
        # Between two points of a front nothing better is known than the corner that both leave.
        step: Literal["post", "pre"] = "post" if first[1] > 0 else "pre"
        axes.step(x[order], y[order], where=step, color=CHOSEN, linewidth=1.4)
        axes.plot(x[order], y[order], "s", color=CHOSEN, markersize=5.5)
        for n in order if len(order) <= 12 else order[:: max(1, len(order) // 12)]:
            axes.annotate(
                str(rows[n]["point"]), (x[n], y[n]), (4, 4), textcoords="offset points", fontsize=7, color=INK
            )
        words = [f"{name} ({'less' if sign > 0 else 'more'} is better)" for name, sign in (first, second)]
        axes.set(xlabel=words[0], ylabel=words[1])
    return svg()


def _inputs(found: Found) -> str:
    rows = []
    for v in found.plan.variables:
        if v.values:
            what = ", ".join(_shown(value) for value in v.values)
        else:
            what = f"{v.low:g} to {v.high:g}" + (", evenly in its logarithm" if v.log else "")
        rows.append(([v.name, what], False))
    p = found.plan
    facts = {
        "method": p.method,
        "seed": p.seed,
        "memory limit of a study [MB]": p.memory_MB,
        "time limit of a study [min]": p.minutes,
        "resin of the mass": p.resin,
    }
    return table("", [("input", ""), ("values", "")], rows) + facts_table("setting", "", facts)


def _points(found: Found) -> str:
    outputs = outputs_of(found)
    head = [
        ("point", ""),
        ("status", ""),
        *((name, "n") for name in (*found.inputs, *outputs)),
        ("seconds", "n"),
    ]
    rows = [
        (
            [
                row["point"],
                "FAILED" if row["status"] == "failed" else row["status"],
                *(_shown(row.get(name)) for name in (*found.inputs, *outputs)),
                _shown(row.get("seconds")),
            ],
            False,
        )
        for row in found.rows[:MOST_ROWS]
    ]
    more = len(found.rows) - len(rows)
    caption = "points.csv holds all results" + (f", and {more} more points." if more > 0 else ".")
    return table(caption, head, rows)


def _failures(found: Found) -> str:
    if not found.failed:
        return ""
    head = [("point", ""), ("what", ""), ("where", ""), ("what to do", "")]
    rows = [
        ([row["point"], *(str(row.get(name, "")) for name in ("what", "where", "what_to_do"))], False)
        for row in found.failed[:MOST_ROWS]
    ]
    return table("", head, rows)


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, list | tuple):
        return " ".join(map(str, value))
    return number(value)
