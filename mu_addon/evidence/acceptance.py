"""Acceptance of an effect: significant, better on left-out data, and no simpler cause explains more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays import Array
from .curved_reading import curved_reading
from .effect import SLIP, STEP
from .fit import PRIOR, Fit, Fitter
from .found_causes import FALSE_ALARM_RATE, LAW, RIVAL_DELTA_CHI2, Selection
from .plausibility import at_a_bound, held_back, unabsorbed, value_at_a_bound
from .record import KNOWN
from .residual_tests.dependence import Dependence
from .scatter import STATED, excess

# An effect of which nuisances leave less than this stands in for them.
ABSORBED = 0.02
# Of a nuisance that a bound holds back, in words.
BOUND = "is at its bound"
# Name of the test for a jump at one moment.
JUMP = "jump"
# An effect rests on one experiment alone if this share of the information on it comes from there.
ALONE = 0.9


def accepted(fitter: Fitter, found: Selection, less: Fit, more: Fit, p: float) -> bool:
    """Return True if the last effect of a model may be named, compared with a model without it.

    p: probability that noise alone gains as much, over all effects and owners tried. No value may lie at a
    bound, left-out data must be predicted better, and neither a step change nor a curved gauge may explain
    more. A common effect may not rest on one experiment (a share above `ALONE`).
    """
    last = more.effects[-1]
    # An effect of the last experiment alone looks like a failure before it.
    margin = RIVAL_DELTA_CHI2 if last.whose and last.name != STEP else 0.0
    common = not (last.whose or last.among)
    return (
        p < FALSE_ALARM_RATE
        and not at_a_bound(more)
        and not (common and max(share_by_experiment(fitter, more).values()) > ALONE)
        and loss(fitter, less, more) > 0.0
        and not doubts(fitter, found.table_base, found.base, more, margin)
    )


def of_the_law(less: Fit, more: Fit, taken: float) -> bool:
    """Return True if an effect gains as little beside others as an error of their laws would."""
    return less.chi2 - more.chi2 < LAW**2 * taken


def doubts(
    fitter: Fitter, table_base: Sequence[Dependence], base: Fit, chosen: Fit, margin: float = 0.0
) -> str:
    """Reason to doubt a fit's effects although they fit, as text; empty without one.

    margin: see `sudden`.
    """
    return (
        sudden(table_base, base, chosen, margin)
        or _too_large(chosen)
        or bounded_by(fitter, base, chosen)
        or curved_reading(fitter, base, chosen)
    )


def bounded_by(fitter: Fitter, base: Fit, chosen: Fit) -> str:
    """Nuisance at a bound that makes part of the misfit itself, as text; empty without one.

    That of the chosen model, or of the base model if a chosen effect stands in for what lies beyond its
    bound: one that a free nuisance would absorb.
    """
    fit = chosen
    p = held_back(fitter, fit)
    if p is None and any(share < ABSORBED for share in unabsorbed(chosen)):
        fit = base
        p = held_back(fitter, fit)
    if p is None:
        return ""
    value = f"{fit.values[p.name]:.3g} {p.unit}".rstrip()
    return f"{p.name.removesuffix(f'_{p.unit}')} {BOUND}, {value}, which makes part of the error itself"


def _too_large(chosen: Fit) -> str:
    """Effect whose size would exceed its bound, as text; empty if there is none."""
    for e in chosen.effects:
        if value_at_a_bound(e.parameters[0], chosen.values[e.keys[0]]):
            return f"{e.name} would have to be larger than its bound allows"
    return ""


def sudden(table: Sequence[Dependence], base: Fit, chosen: Fit, margin: float = 0.0) -> str:
    """Sudden change that explains more than the chosen effects, as text; empty if there is none.

    By Akaike's criterion; its moment counts as one parameter besides its sizes. margin: of chi squared, by
    which the effects must be better.
    """
    if chosen is base:
        return ""
    named = base.chi2 - chosen.chi2 - 2.0 * (len(chosen.keys) - len(base.keys))
    for d in table:
        # A marker's slip is a jump; one that it leaves is structure of what remains.
        if d.against == JUMP and SLIP in chosen.names:
            continue
        gain = {"break": d.statistic, JUMP: d.statistic**2}.get(d.against, 0.0)
        if gain - 2.0 * (d.dof + 1) > named - margin:
            return f"a step change explains more than {' and '.join(chosen.names)}: {d.where}"
    return ""


def too_far(fitter: Fitter, fit: Fit) -> str:
    """Excess of a fit's error over any noise that the readings show, as text; empty without one."""
    found = excess(fitter.record, fitter.record.values - fitter.predict(fit.values))
    if found is None:
        return ""
    return (
        f"the error of {found.where} is {found.error:.3g}, {found.times:.2g} times the largest noise that "
        + (f"its {STATED} allows" if found.by == STATED else "its readings allow")
    )


def loss(fitter: Fitter, less: Fit, more: Fit) -> float:
    """Rise in chi squared of experiments left out one by one, of a model over one with one more effect.

    An experiment with most of the information on the effects is left out in parts. Prior knowledge counts as
    an experiment. For an effect that differs among owners every second quarter of the records is left out,
    since only an owner's records determine its value.
    """
    if more.effects[-1].among:
        lost, folds = 0.0, _quarters(fitter)
    else:
        lost, folds = fitter.deviance(less)[PRIOR] - fitter.deviance(more)[PRIOR], _folds(fitter, more)
    for rows in folds:
        before, after = (fitter.left_out(rows, model) for model in (less, more))
        lost += before - after if before != after else 0.0
    return lost


def _quarters(fitter: Fitter) -> list[Array]:
    """Rows of every second quarter of the series, and those between."""
    quarter = np.zeros(len(fitter.record), int)
    for s in fitter.record.series:
        many = s.at.stop - s.at.start
        quarter[s.at] = np.minimum(4 * np.arange(many) // max(many, 1), 3)
    return [quarter % 2 == side for side in (0, 1)]


def _folds(fitter: Fitter, fit: Fit) -> list[Array]:
    record = fitter.record
    folds = []
    for i, share in share_by_experiment(fitter, fit).items():
        rows = record.rows(i)
        timed = "time_s" in record.experiments[i].columns
        if share < 0.6 or rows.sum() < (40 if timed else 12):
            folds.append(rows)
            continue
        if not timed:
            # Readings without a clock are independent: every second one predicts those between.
            folds += [rows & (np.cumsum(rows) % 2 == k) for k in (0, 1)]
            continue
        clock = np.zeros(len(record))
        for s in record.series:
            if s.experiment == i:
                # A record that counts as one number has no time.
                clock[s.at] = s.time_s if s.group != KNOWN else s.time_s.mean()
        edges = np.quantile(clock[rows], [0.25, 0.5, 0.75])
        part = np.digitize(clock, edges)
        # Alternate quarters, so that either half has seen both early and late.
        folds += [rows & (part % 2 == k) for k in (0, 1)]
    return folds


def share_by_experiment(fitter: Fitter, fit: Fit) -> dict[int, float]:
    """Share of each experiment in the information on the last effect's size."""
    record = fitter.record
    every, own = np.vstack([fit.jacobian, fit.prior]), len(fit.effects[-1].keys)
    last = every[:, -own]
    q = np.linalg.qr(every[:, :-own])[0]
    information = ((last - q @ (q.T @ last)) ** 2)[: len(record)]
    rows = {i: record.rows(i) for i in range(len(record.experiments))}
    return {
        i: float(information[r].sum() / max(information.sum(), 1e-300)) for i, r in rows.items() if r.any()
    }
