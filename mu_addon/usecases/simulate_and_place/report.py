"""The report of a study as one HTML file without scripts or requests.

It states the answer (which path), then its grounds, and ends with the assumptions.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path as File

import numpy as np

from ...files import write_text
from ...report import heatmaps, plots
from ...report.html import cards, facts_table, figure, note, number, page, picture_figure, table
from ...report.plots import label, signed
from ...report.results import PaintedStates, RankingResult, ReportData, nearest_to_break
from ...run.progress import spell
from .charts import front_chart, response_chart


def write_html(path: File, results: ReportData) -> None:
    """Write `results` to `path` as a self-contained HTML file; raises OutputError."""
    write_text(path, report_html(results))


def report_html(results: ReportData) -> str:
    """The whole report as HTML text."""
    return page(results.title, results.unit, _notes(results), _headline(results), _sections(results))


def _sections(r: ReportData) -> list[tuple[str, str, str]]:
    return [
        ("ranking", "Ranking of the paths", _ranking(r)),
        ("search", "Search of the whole lattice", _search(r)),
        ("light", "Light signal of the sensor", _light(r)),
        ("motion", "Motion of the unit", _motion(r)),
        ("contact", "Contact with obstacles", _contact(r)),
        ("where", "Deviation of each path over length and time", _heatmaps(r)),
        ("marginals", "Mean deviation along the unit and over time", _marginals(r)),
        ("mesh", "Solid, mesh and solver", _mesh(r)),
        ("assumed", "Assumptions", _assumed(r)),
        ("parameters", "All parameters", _parameters(r)),
        ("time", "Computing time of each stage", _time(r)),
        ("files", "Files of this run", facts_table("file", "content", r.files)),
        ("versions", "Versions", facts_table("program", "version", r.versions)),
    ]


def _notes(r: ReportData) -> str:
    html = ""
    if r.status != "complete":
        html += (
            '<div class="note" role="alert"><p><strong>This run is partial.</strong> '
            f"{escape(r.reason or 'It stopped before the end.')}</p><p>The results shown were finished "
            "before it stopped; missing results are not zero.</p></div>"
        )
    return html + note(r.warnings)


def _headline(r: ReportData) -> str:
    found = r.ranking
    html = ""
    if found is not None:
        best = _index(r, found.chosen)
        path = r.solved_paths[best]
        without = f" ({r.left_out})" if r.left_out else ""
        html += (
            f'<p class="answer">Put the sensor along <strong>{_name(path.name)}</strong>, anchors '
            f"{path.anchors}: of {len(r.paths)} candidates it has the smallest mean deviation, "
            f"{found.j_hat[best]:.3f}&nbsp;mm{without}.</p><p>{_caveat(found)}</p>{_key_figures(r, found)}"
        )
    pictures = "".join(picture_figure(picture) for picture in r.pictures[:1])
    if r.view is None:
        return html + pictures
    chosen = found.chosen if found is not None else ""
    sensor = f" and the sensor along {_name(chosen)}" if chosen else ""
    section = figure(
        plots.unit_with_paths(r.view, r.paths, chosen, _means(r)),
        "Left: the unit cut open along the plane in which it bends, inlet below, with anchors P1 to "
        f"P{len(r.view.anchors)}{sensor}. Right: every candidate path at its true height"
        + (", with its mean deviation in mm." if found is not None else "."),
        "Section of the unit, and the candidate paths"
        + (f"; the chosen path {chosen} runs through anchors {path.anchors}." if chosen else "."),
    )
    return f'{html}<div class="lead">{section}{pictures}</div>'


def _caveat(found: RankingResult) -> str:
    """Qualification of the answer: ties within the mesh's uncertainty."""
    if not found.tied:
        return ""
    names = _listed([_name(name) for name in found.tied])
    within = f" ({found.uncertainty_mm:.3f} mm)" if found.uncertainty_mm is not None else ""
    return (
        f"Within the mesh uncertainty it is tied with {names}; they differ by less than the "
        f"uncertainty{within}."
    )


def _key_figures(r: ReportData, found: RankingResult) -> str:
    order = np.argsort(np.asarray(found.rank), kind="stable")
    facts = [("mean deviation Ĵ", f"{found.j_hat[order[0]]:.3f} mm")]
    if len(order) > 1:
        second = order[1]
        facts.append(("runner-up", f"{_name(r.solved_paths[second].name)}, {found.j_hat[second]:.3f} mm"))
    if found.at_least_mm:
        least = min(found.at_least_mm.values())
        facts.append((f"{len(found.at_least_mm)} others", f"at least {least:.3f} mm"))
    elif len(order) > 1:
        worst = order[-1]
        facts.append(("worst", f"{_name(r.paths[worst].name)}, {found.j_hat[worst]:.3f} mm"))
    if len(r.angle_deg):
        low, high = int(np.argmin(r.pressure_kPa)), int(np.argmax(r.pressure_kPa))
        for i in (low, high):
            facts.append((f"bends at {r.pressure_kPa[i]:g} kPa", f"{r.angle_deg[i]:.1f}°"))
    return cards(facts)


def _ranking(r: ReportData) -> str:
    found = r.ranking
    if found is None:
        return _estimates(r)
    over = "the compared part of the pressure cycle" if r.is_partly_compared else "the whole pressure cycle"
    if r.left_out:
        over = "the pressure cycle, with rest in place of suction, so that it is less than in a full ranking"
    tied = f" Hatched: tied with {_name(found.chosen)}." if found.tied else ""
    whiskers = (
        f" Whiskers: ± {found.uncertainty_mm:.3f} mm mesh uncertainty."
        if found.uncertainty_mm is not None
        else ""
    )
    words = (
        "<p>Ĵ is the mean distance between the unit with the sensor and the unit without it, over the line "
        f"of anchors and {over}. Smaller is better.</p>"
    )
    if found.at_least_mm:
        words += (
            "<p>A path marked ≥ was solved no further once its deviation certainly exceeded that of the best "
            "paths: Ĵ is a mean of distances, so that the part already solved bounds it from below.</p>"
        )
    light = " Pale: lower bound." if found.at_least_mm else ""
    bars = figure(
        plots.ranking(found, r.solved_paths),
        f"Mean deviation of every path, best first.{tied}{whiskers}{light}",
        f"Bar chart of the mean deviation; {found.chosen} is best.",
    )
    head = [("path", ""), ("anchors", "line"), ("rank", "n"), ("Ĵ [mm]", "n"), ("J cont [mm]", "n")]
    rows = []
    least = min(found.at_least_mm.values(), default=np.inf)
    solved = [path.name for path in r.solved_paths]
    for path in r.paths:
        if path.name in found.at_least_mm:
            figures = "", f"≥ {found.at_least_mm[path.name]:.4f}", ""
        else:
            i = solved.index(path.name)
            rank = str(found.rank[i]) if found.j_hat[i] <= least else ""
            figures = rank, f"{found.j_hat[i]:.4f}", f"{found.j_cont[i]:.4f}"
        rows.append(([label(path.name), path.anchors, *figures], path.name == found.chosen))
    every = table("Every path. J cont: root mean square instead of mean.", head, rows)
    return f'{words}<div class="pair">{bars}<div>{every}</div></div>'


def _estimates(r: ReportData) -> str:
    """Estimated deviations, of a run that solved no path."""
    if not r.estimated_mm:
        return ""
    anchors = {path.name: path.anchors for path in r.paths}
    rows = [([label(n), anchors[n], f"{j:.2f}"], False) for n, j in r.estimated_mm.items()]
    words = (
        "<p>No path was solved yet. Estimated by the linear response of the unit under pressure; exact ones "
        "differ by some 5 to 30 %, and paths close to each other may change places.</p>"
    )
    head = [("path", ""), ("anchors", "line"), ("estimated Ĵ [mm]", "n")]
    return words + table("Estimated mean deviation, least first.", head, rows)


def _search(r: ReportData) -> str:
    if r.search is None:
        return ""
    s = r.search
    best = s.solved[0]
    certain = f"less than {max(s.risk, 1e-3):.1%}" if s.risk < 0.5 else f"up to {s.risk:.0%}"
    html = (
        f"<p>Of {s.paths} paths through nodes of the lattice, bent paths included, "
        f"<strong>{escape(best.name)}</strong> has the smallest deviation: {best.j_hat:.3f}&nbsp;mm. "
        f"All were ranked by a reduced model; the {len(s.solved)} below were solved "
        f"by the full model. The probability that another path is better is {certain}, if the reduced model "
        "is as accurate for the others as for these. Paths marked “best for their length” are "
        "Pareto-optimal in deviation and length.</p>"
    )
    if r.search_picture is not None:
        html += f'<div class="triple">{picture_figure(r.search_picture)}</div>'
    head = [
        ("path", ""), ("length [mm]", "n"), ("Ĵ [mm]", "n"), ("predicted [mm]", "n"),
        ("best for its length", ""), ("nodes (x y z) [mm]", ""),
    ]  # fmt: skip
    rows = [
        (
            [
                p.name,
                f"{p.length_mm:.1f}",
                f"{p.j_hat:.4f}",
                f"{p.predicted_mm:.4f}",
                "yes" if p.on_front else "",
                "; ".join(" ".join(f"{c:g}" for c in np.round(point, 2)) for point in p.points),
            ],
            i == 0,
        )
        for i, p in enumerate(s.solved)
    ]
    return html + table("Paths solved by the full model", head, rows)


def _light(r: ReportData) -> str:
    if r.light is None:
        return ""
    s, o = r.light, r.light.optics
    chosen = r.ranking.chosen if r.ranking else ""
    index = s.names.index(chosen) if chosen in s.names else 0
    mine = s.responses[index]
    low, high = mine.monotonic_deg
    front = (
        "The line joins the Pareto-optimal paths: no path has both a smaller deviation and a larger signal."
        + ("" if all(s.solved) else " Rings: at least so large a deviation.")
    )
    caption = (
        "Chosen path in colour; dots: ray tracing through the bent waveguide, bars: two standard errors."
    )
    way = "rises" if mine.sensitivity_per_deg < 0 else "falls"
    html = (
        f"<p>Along <strong>{escape(label(s.names[index]))}</strong> the light at the detector changes by "
        f"{100 * abs(mine.sensitivity_per_deg):.2f} ± {100 * s.errors_per_deg[index]:.2f}&nbsp;% per degree "
        f"around rest, and {way} without a turn from {signed(f'{low:.0f}')} to {high:.0f} degrees. The "
        "light along each path follows a law fitted to traced rays; its error is "
        f"{100 * s.law.rms:.0f}&nbsp;%. Two effects oppose each other: in a bend, light follows the outer "
        "side, away from wells on the inner side; a stretched bar deforms at its wells and loses light "
        "there. The optical constants of the resin are assumed, because no published values were found: "
        f"index {o.index:g}, attenuation {o.attenuation_per_mm:g} per mm, wall slopes {o.roughness:g}.</p>"
        f'<div class="pair">{figure(front_chart(s, chosen), front, "deviation against sensitivity")}'
        f"{figure(response_chart(s, chosen), caption, 'light against angle')}</div>"
    )
    head = [
        ("path", ""), ("Ĵ [mm]", "n"), ("signal [%/deg]", "n"), ("±", "n"), ("monotonic from [deg]", "n"),
        ("to [deg]", "n"), ("light at rest [%]", "n"), ("Pareto-optimal", ""),
    ]  # fmt: skip
    rows = [
        (
            [
                label(name),
                f"{'' if s.solved[k] else '≥ '}{s.j_hat[k]:.4f}",
                signed(f"{100 * s.responses[k].sensitivity_per_deg:.2f}"),
                f"{100 * s.errors_per_deg[k]:.2f}",
                signed(f"{s.responses[k].monotonic_deg[0]:.1f}"),
                f"{s.responses[k].monotonic_deg[1]:.1f}",
                f"{100 * s.at_rest[k]:.1f}",
                {True: "yes", False: "", None: "open"}[s.front[k]],
            ],
            name == chosen,
        )
        for k, name in enumerate(s.names)
    ]
    html += table("Deviation and signal of every path", head, rows)
    if s.differential:
        names, slope = s.differential[0]
        html += (
            f"<p>As a differential pair, {escape(_listed([label(n) for n in names]))} differ by "
            f"{100 * abs(slope):.2f}&nbsp;% per degree more than alone; a common change of light, such as "
            "warming of the source, cancels.</p>"
        )
    best = {len(names): names for names, _ in reversed(s.sets)}
    for size, word in ((2, "pairs"), (3, "triples")):
        if size in best:
            html += (
                f"<p>Of all {word} {escape(_listed([label(n) for n in best[size]]))} together determine the "
                "distribution of bending along the unit best.</p>"
            )
    return html


def _motion(r: ReportData) -> str:
    html = ""
    if len(r.angle_deg):
        low, high = float(r.pressure_kPa.min()), float(r.pressure_kPa.max())
        why = "friction causes hysteresis" if r.contact or r.self_friction else "it depends on the history"
        html += figure(
            plots.angle_against_pressure(r.pressure_kPa, r.angle_deg),
            "Bending angle of the tip relative to the base, without a sensor; each dot is a converged state"
            + (f", in order of time: {why}." if r.in_time else "."),
            f"Bending angle against pressure from {low:g} to {high:g} kPa.",
        )
    if len(r.protocol_s):
        html += figure(
            plots.protocol(r.protocol_s, r.protocol_kPa),
            "Pressure protocol; dots: times at which the paths are compared.",
            "Pressure against time.",
        )
    html = f'<div class="pair">{html}</div>' if html else ""
    if html and r.effects:
        html = f"<p>With the effects identified from measured data: {escape('; '.join(r.effects))}.</p>{html}"
    if r.pictures[1:]:
        html += (
            '<div class="triple">' + "".join(picture_figure(picture) for picture in r.pictures[1:]) + "</div>"
        )
    return html + _stretch(r) + _self_contact(r)


def _stretch(r: ReportData) -> str:
    """Stretch of wall and lattice: painted on the extreme states, and in numbers for all."""
    if not r.stretch:
        return ""
    html = "<h3>Stretch</h3>"
    if r.stretched is not None:
        html += _painted(r.stretched, 1.0, "largest principal stretch")
    if most := nearest_to_break(r.stretch):
        place = ", ".join(f"{x:.2f}" for x in most["place_mm"])
        words = (
            f"Nearest to tearing: the {most['part']} at {most['pressure_kPa']:g} kPa, near ({place}) mm, at "
            f"{most['percent']:.3g} % of the resin's elongation at break, {100 * r.elongation_at_break:g} %."
        )
        html += f"<p>{signed(words)}</p>"
    columns = ["largest stretch", "x [mm]", "y [mm]", "z [mm]", "1 % exceeds", "of elongation at break [%]"]
    head = [("pressure [kPa]", "n"), ("part", ""), *((name, "n") for name in columns)]
    rows = [([signed(row[0]), row[1], *map(signed, row[2:])], False) for row in r.stretch]
    return html + table(
        "Largest principal stretch of each part without a sensor, and where it is at rest; the stretch "
        "that 1 % of the part's volume, or of the joints, exceeds; its share of elongation at break. Largest "
        "values depend on the mesh where a strut meets a wall. Joints: by the loads on their struts' ends.",
        head,
        rows,
    )


def _painted(states: PaintedStates, low: float, name: str) -> str:
    bar = figure(heatmaps.field_bar(low, states.top, name), "", f"Colour scale of the {name}.", "bar")
    shown = "".join(picture_figure(picture) for picture in states.pictures)
    return f"{bar}<div class='pair'>{shown}</div>"


def _self_contact(r: ReportData) -> str:
    """Self-contact of walls and struts: painted on the extreme states, and in numbers for all."""
    if not r.self_contact:
        return ""
    html = "<h3>Self-contact</h3>"
    if not any(row[2] for row in r.self_contact):
        return html + "<p>No wall or strut touches another at these pressures.</p>"
    if r.touched is not None:
        html += _painted(r.touched, 0.0, "contact pressure [kPa]")
    columns = ["force [N]", "least gap [mm]", "largest contact pressure [kPa]", "x [mm]", "y [mm]", "z [mm]"]
    head = [("pressure [kPa]", "n"), *((name, "n") for name in columns)]
    rows = [([signed(row[0]), *row[1:4], *map(signed, row[4:])], False) for row in r.self_contact]
    if r.self_friction:
        mu, lost = r.self_friction["coefficient"], r.self_friction["lost_mJ"]
        html += (
            f"<p>They slide on each other with a coefficient of friction of {mu:g}, which dissipates "
            f"{lost:.3g} mJ over the protocol.</p>"
        )
    return html + table(
        "Contact force between walls and struts without a sensor, their least gap, and the position "
        "at rest of the largest pressure; at a single node it depends on the mesh.",
        head,
        rows,
    )


def _contact(r: ReportData) -> str:
    c = r.contact
    if c is None:
        return ""
    if not c.force_N.any():
        return f"<p>The unit does not touch {escape(_listed(c.names))}.</p>"
    rows, charts = [], ""
    for b, name in enumerate(c.names):
        k = int(c.force_N[b].argmax())
        rows.append(
            [
                name,
                f"{c.friction[b]:g}",
                f"{c.force_N[b, k]:.3g}",
                signed(f"{c.time_s[k]:g} s, {c.pressure_kPa[k]:g} kPa"),
                f"{c.deepest_mm[b].max():.2g}",
                f"{c.slid_mm[b].max():.2g}",
                f"{c.lost_mJ[b].max():.2g}",
            ]
        )
        if c.force_N[b].any():
            sizes = (np.linalg.norm(force[b], axis=1) for force in (c.normal_N, c.tangential_N))
            charts += figure(
                plots.contact_force(c.time_s, *sizes),
                f"Force of the unit on {escape(name)}.",
                f"Normal force and friction on {name} over time.",
            )
    columns = ["friction", "largest force [N]", "when", "gap error [mm]", "slip [mm]", "dissipated [mJ]"]
    head = [("obstacle", ""), *((name, "n") for name in columns)]
    return (
        "<p>The obstacles are rigid and fixed, with Coulomb friction. Gap error: largest penetration of the "
        "unit into an obstacle, which the penalty method admits.</p>"
        + table("Obstacles", head, [(row, False) for row in rows])
        + f'<div class="pair">{charts}</div>'
    )


def _heatmaps(r: ReportData) -> str:
    found = r.ranking
    if found is None:
        return ""
    top = float(np.nanmax(found.delta))
    maps = "".join(
        figure(
            heatmaps.heatmap(found.delta[i], top, path.name == found.chosen),
            f"{_name(path.name)}: {found.j_hat[i]:.3f} mm",
            f"Deviation of {path.name} over length and time, at most {np.nanmax(found.delta[i]):.2f} mm.",
            "best" if path.name == found.chosen else "",
        )
        for i, path in enumerate(r.solved_paths)
    )
    bar = figure(heatmaps.color_bar(top), "", f"Colour scale from 0 to {top:.2f} mm.", "bar")
    return (
        "<p>One map per path. Horizontal: length [%], from inlet to tip. Vertical: time [%] of the pressure "
        "cycle. All maps share one colour scale, in the square root of Δ; the chosen path is framed."
        f"{' Empty rows are not compared.' if r.is_partly_compared else ''}</p>"
        f"{bar}<div class='many'>{maps}</div>"
    )


def _marginals(r: ReportData) -> str:
    found = r.ranking
    if found is None:
        return ""
    along_length, over_time = np.nanmean(found.delta, axis=1), found.delta.mean(axis=2)
    charts = figure(
        plots.marginal(along_length, r.solved_paths, found.chosen, "length"),
        "Deviation along the length, averaged over time.",
        "Mean deviation of every path against length.",
    ) + figure(
        plots.marginal(over_time, r.solved_paths, found.chosen, "time"),
        "Deviation over time, averaged over the length.",
        "Mean deviation of every path against time.",
    )
    return (
        "<p>Colour: number of anchors; dashes: first anchor; thick orange line: chosen path.</p>"
        f"<div class='pair'>{charts}</div>"
    )


def _mesh(r: ReportData) -> str:
    html = ""
    if r.gates:
        head = [("check", "text"), ("found", "n"), ("asked", "ask"), ("result", "")]
        rows = [
            ([gate.name, number(gate.value), gate.limit, "passed" if gate.passed else "FAILED"], False)
            for gate in r.gates
        ]
        html += table("Checks of the printable solid, after reading its file back.", head, rows, css="stack")
    if r.mesh:
        html += facts_table("mesh", "", r.mesh)
    if r.solver:
        html += facts_table("solver", "", r.solver)
    return html


def _assumed(r: ReportData) -> str:
    rows = [([p.path, number(p.value), p.unit, p.source], False) for p in r.parameters if p.assumed]
    if not rows:
        return ""
    head = [("parameter", ""), ("value", "n"), ("unit", ""), ("why", "text")]
    return "<p>The paper does not give these values. The results depend on them.</p>" + table(
        "", head, rows, css="stack"
    )


def _parameters(r: ReportData) -> str:
    if not r.parameters:
        return ""
    head = [("parameter", ""), ("value", "n"), ("unit", ""), ("source", "text")]
    rows = [
        ([p.path, number(p.value), p.unit, "assumed" if p.assumed else p.source], False) for p in r.parameters
    ]
    return table("", head, rows, css="stack")


def _time(r: ReportData) -> str:
    if not r.seconds:
        return ""
    whole = sum(r.seconds.values())
    return figure(
        plots.seconds(r.seconds),
        f"Seconds per stage; {spell(whole)} in all.",
        "Bar chart of seconds per stage.",
        "chart",
    )


def _name(path: str) -> str:
    return escape(label(path))


def _index(r: ReportData, name: str) -> int:
    return next(i for i, path in enumerate(r.solved_paths) if path.name == name)


def _means(r: ReportData) -> list[str]:
    """Mean deviation of every path in mm as text, or its lower bound; empty without a ranking."""
    if r.ranking is None:
        return []
    known = dict(zip((path.name for path in r.solved_paths), r.ranking.j_hat, strict=True))
    bounds = r.ranking.at_least_mm
    return [f"{known[p.name]:.3f}" if p.name in known else f"≥ {bounds[p.name]:.3f}" for p in r.paths]


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
