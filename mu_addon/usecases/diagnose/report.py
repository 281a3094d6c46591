"""The report of a diagnosis: the verdict in a sentence, and its evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ...evidence.effect import Parameter, bare, readable
from ...evidence.fit import Fit
from ...evidence.found_causes import RIVAL_DELTA_CHI2
from ...evidence.record import KNOWN, repeats
from ...evidence.residuals import CONDITIONS, COVARIATES, FALSE_ALARM
from ...evidence.scatter import noise_limit
from ...evidence.sensitivity import best_seen
from ...files import write_text
from ...report.html import cards, facts_table, figure, note, page, table
from ...report.plots import CHOSEN, INK, signed
from ...run.context import RunContext
from ...run.parts import listed
from ...run.versions import package_versions
from . import charts as pictures
from .judged_data import Curve, JudgedData, curves
from .words import advice, alternatives, between, called, in_a_table, sentence, to_do

FILES = {
    "diagnose.toml": "inputs of this run",
    "unit.toml": "parameters of the unit",
    "verdict.json": "the verdict and its figures",
    "model.toml": "the extended model: `simulate`, `place` and `homogenize` take it with --model",
    "residuals.csv": "every measured value with the predictions of both models",
    "summary.json": "all results of this run as numbers",
    "log.ndjson": "log of this run",
}
# Panels of measured beside predicted; the rest is in residuals.csv.
MOST_PANELS = 30
# Remarks on the data that stand at the top; more would hide the verdict.
MOST_NOTES = 3


def write_report(found: JudgedData, out: Path, context: RunContext, stopped: str) -> None:
    """Write report.html; raises OutputError. stopped: why an incomplete run stopped."""
    with context.progress.stage("report"):
        versions = package_versions()
        context.summary["versions"] = versions
        write_text(out / "report.html", report(found, out, versions, stopped))


def report(found: JudgedData, out: Path, versions: dict[str, str], stopped: str = "") -> str:
    """The whole report as HTML text."""
    sections = [
        ("measured", "Measured and predicted", _measured(found)),
        ("causes", "The cause", _causes(found)),
        ("rivals", "Rival explanations", _rivals(found)),
        ("gain", "Error reduction", _gain(found)),
        ("left", "Dependence of the residual", _dependence(found)),
        ("seen", "Identifiability of each effect", _identifiability(found)),
        ("noise", "Noise", _noise(found)),
        ("data", "Data", _data(found)),
        ("files", "Files of this run", facts_table("file", "content", _files(out))),
        ("versions", "Versions", facts_table("program", "version", versions)),
    ]
    experiments = found.measured.experiments
    held = sum(e.role == "held_out" for e in experiments)
    kinds = listed([readable(k) for k in dict.fromkeys(e.kind for e in experiments)])
    count = len(experiments)
    subtitle = f"{count} experiment{'s' if count > 1 else ''} ({kinds}), {held or 'none'} of them held out"
    subtitle += f"; {found.body}" if found.body else ""
    name = found.measured.folder.resolve().name
    return page(
        f"Diagnosis of {name}",
        subtitle,
        _notes(found, stopped),
        _headline(found),
        sections,
    )


def _notes(found: JudgedData, stopped: str) -> str:
    remarks = [f"{r[:1].upper()}{r[1:]}." for r in found.remarks]
    if len(remarks) > MOST_NOTES:
        remarks = [f"There are {len(remarks)} remarks on the data; the section Data lists them."]
    return note(remarks, stopped)


def _headline(found: JudgedData) -> str:
    verdict = found.verdict
    headline, words = sentence(verdict)
    html = f'<p class="answer">Verdict: <strong>{escape(headline)}</strong>.</p>' + (
        f"<p><strong>What to do.</strong> {escape(do)}</p>" if (do := to_do(verdict)) else ""
    )
    if next_ := advice(verdict):
        html += f"<p><strong>Next measurement.</strong> {escape(next_)}</p>"
    html += f"<p>{escape(signed(words))}</p>{_sizes(found)}"
    judged = verdict.gain.held_out or verdict.gain.fit
    facts = [("verdict", verdict.kind)]
    if found.extends:
        which = "held out" if verdict.gain.held_out else "fitted"
        facts += [
            (f"error of the base model, {which}", f"{judged.before:.3g} {judged.unit}"),
            (
                "with the effect" + ("" if verdict.names else " (not named)"),
                f"{judged.after:.3g} {judged.unit}",
            ),
        ]
    else:
        facts.append(("error of the model", f"{judged.before:.3g} {judged.unit}"))
    if verdict.names:
        facts.append(
            ("false-positive probability", _p_value(max(c.p_value for c in verdict.selection.causes)))
        )
    facts.append(("effects tested", str(len(verdict.selection.singles))))
    return html + cards(facts)


def _sizes(found: JudgedData) -> str:
    """Values of the causes with their intervals, where they are too many for a sentence."""
    verdict = found.verdict
    if not (verdict.names and in_a_table(verdict)):
        return ""
    rows = []
    for c in verdict.selection.causes:
        for key, p in zip(c.effect.keys, c.effect.parameters, strict=True):
            value = _figures(verdict.selection.chosen.values[key])
            ends = signed(between(*verdict.intervals.get(key, (math.nan, math.nan))))
            rows.append(([readable(c.effect.title), bare(p), value, ends, p.unit], False))
    head = [("effect", ""), ("parameter", ""), ("value", "n"), ("95 %", "n"), ("unit", "")]
    return table("", head, rows)


def _extended_words(found: JudgedData) -> str:
    names = listed([readable(n) for n in found.verdict.selection.chosen.names]) if found.extends else ""
    return f"with {names}" + ("" if found.verdict.names else " (not named)")


def _measured(found: JudgedData) -> str:
    drawn, more = _chosen(curves(found))
    # A row an experiment, where each has as many panels.
    wide = ' style="max-width:52rem"' if len(drawn) > len({c.experiment.name for c in drawn}) else ""
    html = f'{_key(found)}<div class="triple"{wide}>'
    for curve in drawn:
        alt = (
            f"{curve.experiment.name}: {pictures.titled(curve.channel)}: measurement, prediction "
            "and residual."
        )
        html += figure(pictures.panel(curve, found.extends), "", alt)
    html += "</div>"
    if more:
        html += f"<p>{more} more channels are in residuals.csv.</p>"
    if any(c.spread is not None for c in drawn):
        html += "<p>Grey: standard deviation given with the data; it may shift a whole record up or down.</p>"
    return html


def _key(found: JudgedData) -> str:
    marks = [(INK, "●", "measured"), (pictures.BASE, "╌╌", "base model")]
    if found.extends:
        marks.append((CHOSEN, "━━", _extended_words(found)))
    entries = [f'<span style="color:{color}">{mark}</span> {escape(what)}' for color, mark, what in marks]
    return f"<p>{' &emsp; '.join(entries)}</p>"


def _chosen(every: Sequence[Curve]) -> tuple[list[Curve], int]:
    """Channels worth a chart: of each experiment the first, and the two markers that move most."""
    drawn: list[Curve] = []
    for name in dict.fromkeys(c.experiment.name for c in every):
        mine = [c for c in every if c.experiment.name == name]
        moving = sorted(mine[1:], key=lambda c: -float(np.ptp(c.before)))
        drawn += [mine[0], *moving[:2]]
    if len(drawn) > MOST_PANELS:
        first = {id(c) for c in drawn if c.channel == drawn[0].channel}
        drawn.sort(key=lambda c: id(c) not in first)
    drawn = drawn[:MOST_PANELS]
    return drawn, len(every) - len(drawn)


def _causes(found: JudgedData) -> str:
    verdict = found.verdict
    if not verdict.selection.causes:
        return ""
    rows = []
    for cause in verdict.selection.causes:
        for i, (key, p) in enumerate(zip(cause.effect.keys, cause.effect.parameters, strict=True)):
            low, high = verdict.intervals.get(key, (math.nan, math.nan))
            first = [readable(cause.effect.name), cause.effect.mechanism] if i == 0 else ["", ""]
            value = verdict.selection.chosen.values[key]
            rows.append(
                (
                    [
                        *first,
                        bare(p),
                        _figures(value),
                        signed(between(low, high)),
                        p.unit,
                        _at_bound(p, low, high),
                        "" if i else _p_value(cause.p_value),
                    ],
                    i == 0 and bool(verdict.names),
                )
            )
    head = [
        ("effect", ""),
        ("mechanism", "text"),
        ("parameter", ""),
        ("value", "n"),
        ("95 %", "n"),
        ("unit", ""),
        ("note", "line"),
        ("p-value", "n"),
    ]
    doubts = "".join(
        f"<p>In place of {escape(called(c.effect))} it may be {escape(alternatives(c.rivals))}.</p>"
        for c in verdict.selection.causes
        if c.rivals
    )
    words = (
        ""
        if verdict.names
        else "<p>These effects are the best fit and not a verdict: the remaining residual has "
        "structure, so their parameters may compensate for another cause.</p>"
    )
    rest = []
    for p in found.simulator.nuisances:
        if p.name in found.model.nuisances:
            value, (low, high) = verdict.selection.chosen.values[p.name], verdict.intervals[p.name]
            rest.append(([bare(p), _figures(value), signed(between(low, high)), p.unit], False))
    fitted = [("quantity", ""), ("value", "n"), ("95 %", "n"), ("unit", "")]
    return (
        words
        + table("", head, rows)
        + doubts
        + (table("Nuisance parameters, fitted in every case.", fitted, rest) if rest else "")
    )


def _at_bound(p: Parameter, low: float, high: float) -> str:
    near = 1e-3 * (p.high - p.low)
    sides = [
        side
        for side, value, bound in (("lower", low, p.low), ("upper", high, p.high))
        if abs(value - bound) < near and bound != p.null
    ]
    return f"up to its {' and '.join(sides)} bound" if sides else ""


def _rivals(found: JudgedData) -> str:
    selection = found.verdict.selection
    if not selection.singles:
        return ""
    rivals = {r for c in selection.causes for r in c.rivals}
    base = max(selection.base.chi2, 1e-12)
    names = [f.effects[0].title for f in selection.singles]
    left = [f.chi2 / base for f in selection.singles]
    chosen = _titles(selection.chosen)
    chart = pictures.rivals_chart(names, left, selection.chosen.chi2 / base, [*chosen, *sorted(rivals)])
    rows = []
    for f in selection.singles:
        e = f.effects[0]
        size = ", ".join(
            f"{bare(p)} {_figures(f.values[k])}{' ' + p.unit if p.unit else ''}"
            for k, p in zip(e.keys, e.parameters, strict=True)
        )
        rows.append(
            (
                [readable(e.title), size, f"{f.chi2:.4g}", _against(found, f, rivals)],
                e.title in chosen or e.title in rivals,
            )
        )
    picture = figure(
        chart,
        "Each effect alone, refitted together with the nuisance parameters. Orange: chosen or "
        "equivalent. Dashed: chosen model.",
        "Share of the misfit that remains with each effect.",
    )
    count = len(found.verdict.record)
    return (
        f"<p>The base model leaves χ² = {base:.4g} of {count} values; {len(names)} effects that these "
        "data can identify were tested. Two effects whose χ² differ by less than "
        f"{RIVAL_DELTA_CHI2:g} are not distinguishable.</p>"
        + f'<div class="chart">{picture}</div>'
        + table(
            "",
            [
                ("effect alone", ""),
                ("best fit", "text"),
                ("remaining χ²", "n"),
                ("reason against it", "text"),
            ],
            rows,
        )
    )


def _against(found: JudgedData, f: Fit, rivals: set[str]) -> str:
    selection = found.verdict.selection
    e, gained = f.effects[0], selection.base.chi2 - f.chi2
    at = [bare(p) for k, p in zip(e.keys, e.parameters, strict=True) if _ended(p, f.values[k])]
    bound = f"; {' and '.join(at)} at its bound" if at else ""
    if e.title in _titles(selection.chosen) and found.verdict.names:
        return "none: named" if found.verdict.kind == "named" else "none: best fit"
    if e.title in _titles(selection.chosen):
        return "part of the best fit"
    more = f.chi2 - selection.chosen.chi2
    alike = min(o.chi2 for o in selection.singles if o.effects[0].title == e.title)
    if e.title in rivals and f.chi2 < alike + RIVAL_DELTA_CHI2:
        return f"none: a rival that these data do not distinguish{bound}"
    if e.title in rivals:
        return f"by this law it leaves {more:.3g} more; by another one it is not distinguished{bound}"
    if gained < RIVAL_DELTA_CHI2:
        return f"no significant gain ({_figures(max(gained, 0.0))}){bound}"
    if not selection.chosen.effects:
        return f"gains {gained:.3g}, which slow noise of these records could as well{bound}"
    return f"leaves {more:.3g} more than the chosen model{bound}"


def _titles(fit: Fit) -> list[str]:
    return [e.title for e in fit.effects]


def _ended(p: Parameter, value: float) -> bool:
    """Return True if a fit stopped at a bound that is not the null, where an effect is just absent."""
    near = 1e-3 * (p.high - p.low)
    return any(abs(value - bound) < near and bound != p.null for bound in (p.low, p.high))


def _gain(found: JudgedData) -> str:
    gain = found.verdict.gain
    if not found.extends:
        return ""
    html = '<div class="pair">'
    for title, errors in (("Held out", gain.held_out), ("Fitted", gain.fit)):
        if errors is None:
            continue
        low, high = errors.low95, errors.high95
        drop = ""
        if math.isfinite(low):
            sure = "" if low > 0 else " The reduction is not significant."
            drop = (
                f"The error drops by {_figures(errors.before - errors.after)} {errors.unit} "
                f"(95 %: {_figures(low)} to {_figures(high)}).{sure}"
            )
        html += (
            f"<div><h3>{title} experiments</h3>"
            + figure(pictures.gain_chart(errors), escape(drop), f"Errors on experiments: {title.lower()}.")
            + "</div>"
        )
    html += "</div>"
    if gain.held_out is None:
        html += (
            '<p>No experiment was held out. Set role = "held_out" for one of them to measure the '
            "error reduction on unseen data.</p>"
        )
    gained = [name for name, (fit, _) in gain.by_quantity.items() if fit is gain.fit and name != KNOWN]
    which = f" of {readable(gained[0])}" if gained and len(gain.by_quantity) > 1 else ""
    return (
        html
        + _by_quantity(found)
        + f"<p>Root mean square errors{which}. A true cause reduces the error more than the same "
        "effect applied to permuted experiments, and more than a black-box model with as many "
        "parameters. The interval is from a block bootstrap, which accounts for correlated "
        "values.</p>"
    )


def _by_quantity(found: JudgedData) -> str:
    """Table of errors of every measured quantity, where there are several."""
    every = found.verdict.gain.by_quantity
    if len(every) < 2:
        return ""
    rows: list[tuple[list[Any], bool]] = []
    for name, (fit, held) in every.items():
        cells = [f"{_figures(e.before)} → {_figures(e.after)}" if e else "" for e in (fit, held)]
        rows.append(([readable(name), fit.unit, *cells], fit is found.verdict.gain.fit))
    head = [("quantity", ""), ("unit", "text"), ("fitted experiments", "n"), ("held out", "n")]
    return table("", head, rows)


def _dependence(found: JudgedData) -> str:
    selection = found.verdict.selection
    before, after = selection.table_base, selection.table
    if not before:
        return ""
    level = FALSE_ALARM / max(len(before), 1)
    later = {d.against: d for d in after}
    rows, structured = [], {}
    for d in before:
        now = later.get(d.against)
        cells: list[Any] = [readable(d.against), _p_value(d.p_value), "yes" if d.p_value < level else "no"]
        if found.extends:
            cells += [_p_value(now.p_value), "yes" if now.p_value < level else "no"] if now else ["–", "–"]
        where = now if now is not None and now.p_value < level else d
        cells.append(where.where if where.p_value < level else "")
        rows.append((cells, where.p_value < level))
        structured[d.against] = where.p_value < level
    head = [("residual against", ""), ("p-value", "n"), ("structure", "")]
    if found.extends:
        head += [("p-value after", "n"), ("structure", "")]
    head.append(("strongest", "text"))
    chart = figure(
        pictures.dependence_chart(before, after, level, found.extends),
        "Open: base model" + (f". Filled: {escape(_extended_words(found))}" if found.extends else "") + ".",
        "p-value of each dependence of the residual.",
    )
    shown = "".join(
        figure(pictures.residual_panel(d, found.extends), "", f"Residual against {readable(d.name)}.")
        for d in _dependents(found, structured)
    )
    panels = (
        "<p>Mean residual in bins of equal count, with the interquartile range.</p>"
        f'<div class="triple">{shown}</div>'
        if shown
        else ""
    )
    return (
        "<p>The residual of a correct model is noise and depends on nothing. The p-value is the "
        "probability that correlated noise of these instruments shows at least this dependence.</p>"
        f'<div class="chart">{chart}</div>{table("", head, rows)}{panels}'
    )


def _dependents(found: JudgedData, tested: Mapping[str, bool]) -> list[pictures.Dependent]:
    """Residuals of the first quantity against the tested ones: name, and True with structure."""
    record, simulator = found.verdict.record, found.simulator
    group = record.groups[0]
    members = [s for s in record.series if s.group == group]
    before = record.values - record.predict(simulator, found.before)
    after = record.values - record.predict(simulator, found.after)
    unit = "spreads" if group == KNOWN else members[0].channel.rpartition("_")[2]
    quantities: list[tuple[str, tuple[str, ...], Any]] = list(COVARIATES)
    for name, condition in CONDITIONS:
        places = {id(e): condition(e, i) for i, e in enumerate(record.experiments)}
        quantities.append((name, (), lambda e, places=places: places[id(e)]))
    drawn = []
    for name, needs, of in quantities:
        held = [s for s in members if all(c in record.experiments[s.experiment].columns for c in needs)]
        if not held or (needs if group == KNOWN else name not in tested):
            continue
        x = []
        for s in held:
            e = record.experiments[s.experiment]
            quantity = np.asarray(of(e), float) * np.ones(len(e))
            x.append(s.mean(quantity) if group != KNOWN else quantity[:1])
        values = np.concatenate(x)
        if not np.ptp(values) > 0:
            continue
        rows = np.concatenate([np.arange(s.at.start, s.at.stop) for s in held])
        drawn.append(
            pictures.Dependent(name, unit, values, before[rows], after[rows], tested.get(name, False))
        )
    drawn.sort(key=lambda d: not d.structure)
    return drawn[:9]


def _identifiability(found: JudgedData) -> str:
    rows = []
    verdict = found.verdict
    for name, s in sorted(best_seen(verdict.seen).items(), key=lambda item: not item[1].identifiable):
        p = s.effect.parameters[0]
        # Where a linear step within bounds is too small, only a fit at the bounds showed that it could be.
        limit = f"{bare(p)} {s.limit:.3g} {p.unit}".strip() if s.linear else "near its bound"
        reason = verdict.identifiability.get(name, "")
        rows.append(
            (
                [
                    readable(name),
                    "yes" if s.identifiable else "no",
                    limit if s.identifiable else "–",
                    f"{s.unabsorbed:.1%}" if s.unabsorbed > 0 else "–",
                    readable(reason.partition(";")[0]),
                    s.effect.reveals,
                ],
                False,
            )
        )
    head = [
        ("effect", ""),
        ("identifiable", ""),
        ("from", "n"),
        ("not absorbed", "n"),
        ("reason if not", "text"),
        ("best experiment for it", "text"),
    ]
    return (
        "<p>An effect can be absorbed by a fitted modulus or zero. “Not absorbed” is the share of its "
        "signature that these cannot reproduce; “from” is the smallest size that would have been "
        "detected.</p>" + table("", head, rows)
    )


def _noise(found: JudgedData) -> str:
    record, rows = found.verdict.record, []
    for group in record.groups:
        members = [s for s in record.series if s.group == group]
        values = sum(s.at.stop - s.at.start for s in members)
        unit = members[0].channel.rpartition("_")[2]
        if group == KNOWN:
            rows.append(
                (
                    [
                        "given with the data",
                        "",
                        "",
                        "",
                        "",
                        f"{len(members)} values, each for a whole record",
                    ],
                    False,
                )
            )
            continue
        source = found.verdict.sources[group]
        most, by = max(noise_limit(record, s) for s in members)
        clocked = any(not math.isnan(s.sample_s) for s in members)
        pairs = sum(repeats(record, a, b) for i, a in enumerate(members) for b in members[i + 1 :])
        origin = f"{len(members)} series, {values} values"
        origin += f", {pairs} pairs of repeats" if pairs else ""
        rows.append(
            (
                [
                    group.replace("_", " "),
                    f"{_figures(source.white)} {unit}",
                    f"{_figures(source.slow)} {unit}" if clocked and source.slow else "–",
                    f"{_figures(source.time_s)} s" if clocked and source.slow else "–",
                    f"{_figures(most)} {unit} ({by})",
                    origin + ("" if clocked else ", without time stamps"),
                ],
                False,
            )
        )
    head = [
        ("quantity", ""),
        ("white, per value", "n"),
        ("slow", "n"),
        ("correlation time", "n"),
        ("at most", "text"),
        ("estimated from", "text"),
    ]
    return (
        "<p>Estimated from the residual after a smooth component that any effect could produce was "
        "removed, so that a cause is not taken for noise. Slow noise is correlated in time; the "
        "p-values account for it.</p>" + table("", head, rows)
    )


def _data(found: JudgedData) -> str:
    rows = [
        (
            [
                e.name,
                readable(e.kind),
                e.role.replace("_", " "),
                e.file.name,
                f"{len(e)}",
                f"{e.scale:g}x",
                f"{e.orientation_deg:g}°",
                e.specimen or "–",
                e.sha256[:12],
            ],
            False,
        )
        for e in found.measured.experiments
    ]
    head = [
        ("experiment", ""),
        ("kind", "line"),
        ("role", "line"),
        ("file", "line"),
        ("rows", "n"),
        ("scale", "n"),
        ("gravity", "n"),
        ("specimen", ""),
        ("SHA-256", ""),
    ]
    remarks = "".join(f"<li>{escape(r[:1].upper() + r[1:])}</li>" for r in found.remarks)
    return table("", head, rows) + (f"<h3>Remarks</h3><ul>{remarks}</ul>" if remarks else "")


def _files(out: Path) -> dict[str, str]:
    return {n: what for n, what in FILES.items() if (out / n).exists() or n == "report.html"}


def _p_value(p: float) -> str:
    return f"{p:.2g}" if p >= 1e-3 else ("below 1e-12" if p < 1e-12 else f"{p:.0e}").replace("e-0", "e-")


def _figures(value: float) -> str:
    return signed(f"{value:.3g}") if math.isfinite(value) else "–"
