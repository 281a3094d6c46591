"""What a diagnosis shows, as parts: the verdict in a sentence, and its evidence."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..evidence.effect import Parameter, bare, readable
from ..evidence.fit import Fit
from ..evidence.found_causes import BEYOND, RIVAL_DELTA_CHI2
from ..evidence.record import KNOWN, repeats
from ..evidence.residual_tests.quantities import CONDITIONS, COVARIATES
from ..evidence.residual_tests.table import FALSE_ALARM
from ..evidence.scatter import noise_limit
from ..evidence.sensitivity import best_seen
from ..report.plots import signed
from ..run.parts import Beside, Chart, Fact, Part, Sentence, Table, listed
from . import charts as pictures
from .judged_data import Curve, JudgedData, curves
from .words import advice, alternatives, between, called, in_a_table, sentence, to_do

# Panels of measured beside predicted; the rest is in residuals.csv.
MOST_PANELS = 30
# Remarks on the data that stand at the top; more would hide the verdict.
MOST_NOTES = 3
PARAMETER = [("parameter", ""), ("value", "n"), ("95 %", "n"), ("unit", "")]


def answer(found: JudgedData) -> Iterator[Part]:
    """The verdict, what to do, the next measurement, and the figures that decide."""
    verdict = found.verdict
    headline, words = sentence(verdict)
    notes = [f"{r[:1].upper()}{r[1:]}." for r in found.remarks]
    if len(notes) > MOST_NOTES:
        notes = [f"There are {len(notes)} remarks on the data; the section Data lists them."]
    yield from (Sentence(text, note=True) for text in notes)
    yield Sentence(f"Verdict: {headline}.", answer=True, strong=headline)
    yield Sentence(f"verdict: {verdict.kind}: {headline}", terminal=True, page=False)
    if do := to_do(verdict):
        yield Sentence(f"What to do. {do}", strong="What to do.")
        yield Sentence(f"what to do: {do}", terminal=True, page=False)
    if next_ := advice(verdict):
        yield Sentence(f"Next measurement. {next_}", strong="Next measurement.")
    yield Sentence(words, terminal=True)
    if found.shape:
        yield Sentence(f"shape: {found.shape}", terminal=True, page=False)
    yield from _sizes(found)
    gain = verdict.gain
    if verdict.names:
        for errors, of in ((gain.fit, "fitted data"), (gain.held_out, "held-out data")):
            if errors:
                drop = f"{errors.before:.3g} -> {errors.after:.3g} {errors.unit}"
                yield Sentence(f"error on {of}: {drop}", terminal=True, page=False)
    if next_:
        yield Sentence(f"next: {next_}", terminal=True, page=False)
    judged = gain.held_out or gain.fit
    yield Fact("verdict", verdict.kind, verdict.kind, "verdict")
    before, after = (f"{value:.3g} {judged.unit}" for value in (judged.before, judged.after))
    if found.extends:
        which = "held out" if gain.held_out else "fitted"
        yield Fact(f"error of the base model, {which}", judged.before, before)
        yield Fact("with the effect" + ("" if verdict.names else " (not named)"), judged.after, after)
    else:
        yield Fact("error of the model", judged.before, before)
    if verdict.names:
        p = max(c.p_value for c in verdict.selection.causes)
        yield Fact("false-positive probability", p, _p_value(p))
    tested = len(verdict.selection.singles)
    yield Fact("effects tested", tested, str(tested))


def _interval(found: JudgedData, key: str) -> str:
    return signed(between(*found.verdict.intervals.get(key, (math.nan, math.nan))))


def _sizes(found: JudgedData) -> Iterator[Part]:
    """Values of the causes with their intervals, where they are too many for a sentence."""
    verdict = found.verdict
    if verdict.names and in_a_table(verdict):
        rows = [
            [readable(c.effect.title), bare(p), _figures(found.after[key]), _interval(found, key), p.unit]
            for c in verdict.selection.causes
            for key, p in zip(c.effect.keys, c.effect.parameters, strict=True)
        ]
        yield Table("", [("effect", ""), *PARAMETER], rows)


def _extended_words(found: JudgedData) -> str:
    names = listed([readable(n) for n in found.verdict.selection.chosen.names]) if found.extends else ""
    return f"with {names}" + ("" if found.verdict.names else " (not named)")


def measured(found: JudgedData) -> Iterator[Part]:
    """Measured and predicted, a panel a channel."""
    drawn, more = _chosen(curves(found))
    extended = f" Line: {_extended_words(found)}." if found.extends else ""
    yield Sentence(f"Dots: measured. Dashed: base model.{extended}")
    yield Beside(
        [
            Chart(
                partial(pictures.panel, curve, found.extends),
                "",
                f"{curve.experiment.name}: {pictures.titled(curve.channel)}: measurement, prediction "
                "and residual.",
            )
            for curve in drawn
        ],
        3,
    )
    if more:
        yield Sentence(f"{more} more channels are in residuals.csv.")
    if any(c.spread is not None for c in drawn):
        yield Sentence(
            "Grey: standard deviation given with the data; it may shift a whole record up or down."
        )


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


def causes(found: JudgedData) -> Iterator[Part]:
    """Parameters of the causes, what they may be taken for, and of the nuisances."""
    verdict = found.verdict
    named = verdict.selection.causes
    if not named:
        return
    if not verdict.names:
        yield Sentence(
            "These effects are the best fit and not a verdict: the remaining residual has structure, so "
            "their parameters may compensate for another cause."
        )
    rows: list[list[str]] = []
    best: list[int] = []
    for cause in named:
        first = [readable(cause.effect.name), cause.effect.mechanism]
        p_value = _p_value(cause.p_value)
        best += [len(rows)] if verdict.names else []
        for key, p in zip(cause.effect.keys, cause.effect.parameters, strict=True):
            ends = verdict.intervals.get(key, (math.nan, math.nan))
            sides = _ends(p, *ends)
            bound = f"up to its {' and '.join(sides)} bound" if sides else ""
            size = [bare(p), _figures(found.after[key]), _interval(found, key), p.unit]
            rows.append([*first, *size, bound, p_value])
            first, p_value = ["", ""], ""
    head = [("effect", ""), ("mechanism", "text"), *PARAMETER, ("note", "line"), ("p-value", "n")]
    yield Table("", head, rows, best)
    for c in named:
        if c.rivals:
            yield Sentence(f"In place of {called(c.effect)} it may be {alternatives(c.rivals)}.")
    rest = [
        [bare(p), _figures(found.after[p.name]), _interval(found, p.name), p.unit]
        for p in found.simulator.nuisances
        if p.name in found.model.nuisances
    ]
    if rest:
        yield Table("Nuisance parameters, fitted in every case.", [("quantity", ""), *PARAMETER[1:]], rest)


def _ends(p: Parameter, low: float, high: float) -> list[str]:
    """Bounds that an interval, or a value, ends at, where that is not the null: there an effect is absent."""
    near = 1e-3 * (p.high - p.low)
    ends = (("lower", low, p.low), ("upper", high, p.high))
    return [side for side, value, bound in ends if abs(value - bound) < near and bound != p.null]


def rivals(found: JudgedData) -> Iterator[Part]:
    """Every effect alone, and the reason against it."""
    selection = found.verdict.selection
    if not selection.singles:
        return
    rival = {r for c in selection.causes for r in c.rivals}
    base = max(selection.base.chi2, 1e-12)
    names = [f.effects[0].title for f in selection.singles]
    yield Sentence(
        f"The base model leaves χ² = {base:.4g} of {len(found.verdict.record)} values; {len(names)} effects "
        "that these data can identify were tested. Two effects whose χ² differ by less than "
        f"{RIVAL_DELTA_CHI2:g} are not distinguishable."
    )
    left = [f.chi2 / base for f in selection.singles]
    marked = [*_titles(selection.chosen), *sorted(rival)]
    yield Chart(
        partial(pictures.rivals_chart, names, left, selection.chosen.chi2 / base, marked),
        "Each effect alone, refitted together with the nuisance parameters. Orange: chosen or equivalent. "
        "Dashed: chosen model.",
        "Share of the misfit that remains with each effect.",
    )
    rows = []
    for f in selection.singles:
        e = f.effects[0]
        sizes = zip(e.keys, e.parameters, strict=True)
        size = ", ".join(f"{bare(p)} {_figures(f.values[k])} {p.unit}".rstrip() for k, p in sizes)
        rows.append([readable(e.title), size, f"{f.chi2:.4g}", _against(found, f, rival)])
    head = [("effect alone", ""), ("best fit", "text"), ("remaining χ²", "n"), ("reason against it", "text")]
    yield Table("", head, rows, [k for k, name in enumerate(names) if name in marked])


def _against(found: JudgedData, f: Fit, rivals: set[str]) -> str:
    selection = found.verdict.selection
    e, gained = f.effects[0], selection.base.chi2 - f.chi2
    sizes = [(p, f.values[k]) for k, p in zip(e.keys, e.parameters, strict=True)]
    at = [f"{bare(p)} at its bound" for p, size in sizes if _ends(p, size, size)]
    at += [
        f"{bare(p)} beyond what is plausible"
        for p, size in sizes
        if not p.plausible[0] <= size <= p.plausible[1]
    ]
    bound = "".join(f"; {words}" for words in at)
    if e.title in _titles(selection.chosen):
        if not found.verdict.names:
            return "part of the best fit"
        return "none: named" if found.verdict.kind == "named" else "none: best fit"
    more = f.chi2 - selection.chosen.chi2
    alike = min(o.chi2 for o in selection.singles if o.effects[0].title == e.title)
    if e.title in rivals and f.chi2 < alike + RIVAL_DELTA_CHI2:
        return f"none: a rival that these data do not distinguish{bound}"
    if e.title in rivals:
        return f"by this law it leaves {more:.3g} more; by another one it is not distinguished{bound}"
    if e.title + BEYOND in rivals:
        return f"none but its bound{bound}"
    if gained < RIVAL_DELTA_CHI2:
        return f"no significant gain ({_figures(max(gained, 0.0))}){bound}"
    if not selection.chosen.effects:
        return f"gains {gained:.3g}, which slow noise of these records could as well{bound}"
    return f"leaves {more:.3g} more than the chosen model{bound}"


def _titles(fit: Fit) -> list[str]:
    return [e.title for e in fit.effects]


def gain(found: JudgedData) -> Iterator[Part]:
    """Errors with and without the effect, on data held out and on those fitted."""
    every = found.verdict.gain
    if not found.extends:
        return
    sides: list[list[Part]] = []
    for title, errors in (("held out", every.held_out), ("fitted", every.fit)):
        if errors is None:
            continue
        drop = ""
        if math.isfinite(errors.low95):
            sure = "" if errors.low95 > 0 else " The reduction is not significant."
            drop = (
                f" The error drops by {_figures(errors.before - errors.after)} {errors.unit} "
                f"(95 %: {_figures(errors.low95)} to {_figures(errors.high95)}).{sure}"
            )
        chart = Chart(
            partial(pictures.gain_chart, errors),
            f"Experiments {title}.{drop}",
            f"Errors on experiments: {title}.",
        )
        sides.append([chart])
    yield Beside(sides)
    if every.held_out is None:
        yield Sentence(
            'No experiment was held out. Set role = "held_out" for one of them to measure the error '
            "reduction on unseen data."
        )
    if len(every.by_quantity) > 1:
        rows, best = [], []
        for k, (name, (fit, held)) in enumerate(every.by_quantity.items()):
            cells = [f"{_figures(e.before)} → {_figures(e.after)}" if e else "" for e in (fit, held)]
            rows.append([readable(name), fit.unit, *cells])
            best += [k] if fit is every.fit else []
        head = [("quantity", ""), ("unit", "text"), ("fitted experiments", "n"), ("held out", "n")]
        yield Table("", head, rows, best)
    gained = [name for name, (fit, _) in every.by_quantity.items() if fit is every.fit and name != KNOWN]
    which = f" of {readable(gained[0])}" if gained and len(every.by_quantity) > 1 else ""
    yield Sentence(
        f"Root mean square errors{which}. A true cause reduces the error more than the same effect applied "
        "to permuted experiments, and more than a black-box model with as many parameters. The interval is "
        "from a block bootstrap, which accounts for correlated values."
    )


def dependence(found: JudgedData) -> Iterator[Part]:
    """What the residual depends on, before and after."""
    before, after = found.verdict.selection.table_base, found.verdict.selection.table
    if not before:
        return
    level = FALSE_ALARM / max(len(before), 1)
    later = {d.against: d for d in after}
    rows, structured = [], {}
    for d in before:
        now = later.get(d.against)
        cells: list[Any] = [readable(d.against), _p_value(d.p_value), "yes" if d.p_value < level else "no"]
        if found.extends:
            cells += [_p_value(now.p_value), "yes" if now.p_value < level else "no"] if now else ["–", "–"]
        where = now if now is not None and now.p_value < level else d
        structured[d.against] = where.p_value < level
        rows.append([*cells, where.where if where.p_value < level else ""])
    yield Sentence(
        "The residual of a correct model is noise and depends on nothing. The p-value is the probability "
        "that correlated noise of these instruments shows at least this dependence."
    )
    filled = f". Filled: {_extended_words(found)}" if found.extends else ""
    yield Chart(
        partial(pictures.dependence_chart, before, after, level, found.extends),
        f"Open: base model{filled}.",
        "p-value of each dependence of the residual.",
    )
    head = [("residual against", ""), ("p-value", "n"), ("structure", "")]
    head += [("p-value after", "n"), ("structure", "")] if found.extends else []
    best = [k for k, d in enumerate(before) if structured[d.against]]
    yield Table("", [*head, ("strongest", "text")], rows, best)
    if drawn := _dependents(found, structured):
        yield Sentence("Mean residual in bins of equal count, with the interquartile range.")
        charts = [
            Chart(
                partial(pictures.residual_panel, d, found.extends),
                "",
                f"Residual against {readable(d.name)}.",
            )
            for d in drawn
        ]
        yield Beside(charts, 3)


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


def identifiability(found: JudgedData) -> Iterator[Part]:
    """From which size each effect would have been seen, or why not at any."""
    verdict, rows = found.verdict, []
    for name, s in sorted(best_seen(verdict.seen).items(), key=lambda item: not item[1].identifiable):
        p = s.effect.parameters[0]
        # Where a linear step within bounds is too small, only a fit at the bounds showed that it could be.
        limit = f"{bare(p)} {s.limit:.3g} {p.unit}".strip() if s.linear else "near its bound"
        rows.append(
            [
                readable(name),
                "yes" if s.identifiable else "no",
                limit if s.identifiable else "–",
                f"{s.unabsorbed:.1%}" if s.unabsorbed > 0 else "–",
                readable(verdict.identifiability.get(name, "").partition(";")[0]),
                s.effect.reveals,
            ]
        )
    yield Sentence(
        "An effect can be absorbed by a fitted modulus or zero. “Not absorbed” is the share of its signature "
        "that these cannot reproduce; “from” is the smallest size that would have been detected."
    )
    head = [("effect", ""), ("identifiable", ""), ("from", "n"), ("not absorbed", "n")]
    yield Table("", [*head, ("reason if not", "text"), ("best experiment for it", "text")], rows)


def noise(found: JudgedData) -> Iterator[Part]:
    """The noise of each quantity, and what it was estimated from."""
    record, rows = found.verdict.record, []
    for group in record.groups:
        members = [s for s in record.series if s.group == group]
        values = sum(s.at.stop - s.at.start for s in members)
        unit = members[0].channel.rpartition("_")[2]
        if group == KNOWN:
            rows.append(
                ["given with the data", "", "", "", "", f"{len(members)} values, each for a whole record"]
            )
            continue
        source = found.verdict.sources[group]
        most, by = max(noise_limit(record, s) for s in members)
        clocked = any(not math.isnan(s.sample_s) for s in members)
        pairs = sum(repeats(record, a, b) for i, a in enumerate(members) for b in members[i + 1 :])
        origin = f"{len(members)} series, {values} values"
        origin += f", {pairs} pairs of repeats" if pairs else ""
        slow = clocked and source.slow
        rows.append(
            [
                group.replace("_", " "),
                f"{_figures(source.white)} {unit}",
                f"{_figures(source.slow)} {unit}" if slow else "–",
                f"{_figures(source.time_s)} s" if slow else "–",
                f"{_figures(most)} {unit} ({by})",
                origin + ("" if clocked else ", without time stamps"),
            ]
        )
    yield Sentence(
        "Estimated from the residual after a smooth component that any effect could produce was removed, so "
        "that a cause is not taken for noise. Slow noise is correlated in time; the p-values account for it."
    )
    head = [("quantity", ""), ("white, per value", "n"), ("slow", "n"), ("correlation time", "n")]
    yield Table("", [*head, ("at most", "text"), ("estimated from", "text")], rows)


def data(found: JudgedData) -> Iterator[Part]:
    """The experiments, and the remarks on them."""
    rows = [
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
        ]
        for e in found.experiments
    ]
    head = [("experiment", ""), ("kind", "line"), ("role", "line"), ("file", "line"), ("rows", "n")]
    head += [("scale", "n"), ("gravity", "n"), ("specimen", ""), ("SHA-256", "")]
    yield Table("", head, rows)
    for remark in found.remarks:
        yield Sentence(f"{remark[:1].upper()}{remark[1:]}.")


def _p_value(p: float) -> str:
    return f"{p:.2g}" if p >= 1e-3 else ("below 1e-12" if p < 1e-12 else f"{p:.0e}").replace("e-0", "e-")


def _figures(value: float) -> str:
    return signed(f"{value:.3g}") if math.isfinite(value) else "–"
