"""The verdict on a folder of measured data: cause, confidence, gain, and next measurement."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import attrs
import numpy as np

from ..measured import Experiment
from .drive import denoised_drives
from .effect import Effect, Parameter
from .fit import Fit, Fitter
from .fitted_zeros import FittedZeros, fitted_zeros
from .gain import Gain, gain
from .next_experiment import Proposal, propose_experiment
from .noise import Source, estimate, span
from .outliers import NAME as OUTLIER
from .outliers import without_outliers
from .owned import coincident_effects
from .plausibility import require_plausible
from .record import Record, record
from .residuals import BY_TURN, strict_table, structure
from .resolution import without_unpredicted_readings, without_wrong_readings
from .scatter import NEAR, with_bursts, within_accuracy, within_scatter
from .search import coinciding, further_owners, one_more, select_owned, select_pooled
from .selection import (
    FALSE_ALARM_RATE,
    TOGETHER,
    Cause,
    Selection,
    at_a_bound,
    interval,
    mainly,
    ranked,
    reselected,
    select,
    share_taken,
    too_far,
    with_promising_rivals,
)
from .sensitivity import (
    ABSORBED,
    SEEN,
    WANDERING,
    Sensitivity,
    at_bounds,
    best_seen,
    sensitivities,
    signatures,
)
from .simulator import Composite
from .thinning import thinned

Array = np.ndarray[Any, Any]

KINDS = ("none", "named", "ambiguous", "unidentifiable", "unexplained")
# Effects that may belong to one specimen, or differ among them, if no common one explains the data.
OPEN = ("unexplained", "unidentifiable")
# A nuisance this many spreads from its prior value is no longer only a nuisance.
UNLIKELY = 3.0
# This many effects stand in for one that differs among owners: three leaks as one, with valves shut late.
STRAINED = 5.0
# Noise around the causes larger or smaller than around the base model by this factor replaces it.
RENEWED = 1.5
# What is off by as much in a whole record, or wanders in it, as slow noise does.
ZEROS = frozenset(
    (
        "pressure_offset",
        "pressure_drift",
        "angle_offset",
        "angle_drift",
        "force_drift",
        "led_drift",
        "ambient_light",
    )
)
# Times that causes are selected anew under noise that is quieter around those found before.
QUIETER = 2
# Number of times that isolated outliers are set aside.
ROUNDS = 3


@attrs.frozen(eq=False)
class Verdict:
    """Verdict of the data on the model: the causes named, their rivals, the gain, the next experiment.

    kind: one of `KINDS` (none, named, ambiguous, unidentifiable, unexplained). experiments: all of them,
    their drives freed of gauge noise (`drive.denoised_drives`). sources: noise by group of series. intervals:
    95 % bounds by key, in the parameters' units. identifiability: effects that these data cannot show, with
    the reason. set_aside: readings left out, in words (`resolution.wrong_readings`). refused: why models that
    were tried have no prediction, by the titles of their effects. share_taken: of the base model's misfit by
    the chosen one; a verdict `named` or `ambiguous` may leave structure (`selection.mainly`). nearest: title
    of the best single explanation, named or not, and its share of the misfit. far: nuisances that are far
    from what was known of them, the farthest first. zeros: of a load cell, where they hide an error.
    `as_json` is the content of verdict.json.
    """

    kind: str
    selection: Selection
    seen: tuple[Sensitivity, ...]
    sources: dict[str, Source]
    record: Record
    gain: Gain
    proposal: Proposal | None
    identifiability: dict[str, str]
    intervals: dict[str, tuple[float, float]]
    experiments: tuple[Experiment, ...]
    set_aside: tuple[str, ...] = ()
    refused: Mapping[str, str] = MappingProxyType({})
    share_taken: float = 0.0
    nearest: tuple[str, float] | None = None
    far: tuple[Parameter, ...] = ()
    zeros: FittedZeros | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Effects named, the most needed first; none unless the verdict is `named` or `ambiguous`."""
        return (
            tuple(c.effect.name for c in self.selection.causes) if self.kind in ("named", "ambiguous") else ()
        )

    @property
    def ambiguity(self) -> frozenset[str]:
        """Names of the effects named and their rivals; empty unless the verdict is `named` or `ambiguous`."""
        if self.kind not in ("named", "ambiguous"):
            return frozenset()
        rivals = {r for c in self.selection.causes for title in c.rivals for r in title.split(TOGETHER)}
        return frozenset(self.names) | rivals

    def _share(self, cause: Cause) -> float:
        """Share of the base model's misfit that returns where one of several causes is taken away."""
        gained = self.selection.base.chi2 - self.selection.chosen.chi2
        return self.share_taken * min(cause.loss / gained, 1.0) if gained > 0 else 0.0

    def _value(self, key: str) -> dict[str, float]:
        low, high = self.intervals[key]
        return {"value": self.selection.chosen.values[key], "low95": low, "high95": high}

    def as_json(self) -> dict[str, Any]:
        """The content of verdict.json.

        partly_explained_by: effects of the chosen model where the verdict names none; they are not the cause.
        """
        causes = [
            {
                "effect": c.effect.name,
                "of": c.effect.whose or None,
                "among": _among(c.effect),
                "mechanism": c.effect.mechanism,
                "parameters": {
                    p.name: self._value(k) for k, p in zip(c.effect.keys, c.effect.parameters, strict=True)
                },
                "p_value": c.p_value,
                "share": self.share_taken if len(self.selection.causes) == 1 else self._share(c),
                "rivals": list(c.rivals),
            }
            for c in self.selection.causes
        ]
        left = self.selection.left
        next_ = self.proposal
        return {
            "verdict": self.kind,
            "causes": causes if self.names else [],
            "partly_explained_by": [] if self.names else causes,
            "remaining_structure": {
                "detected": bool(left),
                "where": list(left),
                "size": self.gain.fit.after,
                "unit": self.gain.fit.unit,
            },
            "gain": self.gain.as_json(),
            "residual_table": [
                {
                    "against": d.against,
                    "statistic": d.statistic,
                    "degrees_of_freedom": d.dof,
                    "p_value": d.p_value,
                    "where": d.where,
                }
                for d in self.selection.table_base
            ],
            "nearest": {"effect": self.nearest[0], "share": self.nearest[1]} if self.nearest else None,
            "next_experiment": {"what": next_.what, "separates": list(next_.separates)} if next_ else None,
            "identifiability": dict(self.identifiability),
        }


def noise_of(
    measured: Record,
    simulator: Composite,
    values: Mapping[str, float] | None = None,
    effects: Sequence[Effect] = (),
) -> dict[str, Source]:
    """White and slow noise of a record, by group of series in its channel's unit (see `noise.estimate`).

    values: of nuisances and effects by key, in their units, around which the noise is estimated; those of the
    base model's fit where None. Changes by any effect of the library, and by those of `effects`, do not count
    as noise; nor does what exceeds a stated accuracy.
    """
    if values is None:
        rough = Fitter(measured, simulator, {g: _rough(measured, g) for g in measured.groups})
        values = rough.fit().values
    zeros = {p.name for p in simulator.nuisances if p.linear}
    curved = {k: v for k, v in values.items() if k not in zeros}
    columns = span(measured, signatures(measured, simulator, curved, effects))
    found = estimate(measured, measured.values - measured.predict(simulator, values), columns)
    return within_accuracy(measured, found)


def _rough(measured: Record, group: str) -> Source:
    """Rough sizes: white noise of a hundredth of the group's range."""
    values = np.concatenate([measured.values[s.at] for s in measured.series if s.group == group])
    return Source(max(float(np.ptp(values)), 1e-9) / 100.0, 1e-6, 1.0)


def _seen(fitter: Fitter, base: Fit) -> list[Sensitivity]:
    """Sensitivity to each effect of the library beside the base model's values."""
    curved = {p.name: base.values[p.name] for p in fitter.curved}
    return at_bounds(fitter, curved, sensitivities(fitter, curved))


def diagnose(
    experiments: Sequence[Experiment], simulator: Composite, progress: Callable[[str], None] = lambda _: None
) -> Verdict:
    """Judge a model by measured experiments: which effects explain the misfit, and how surely.

    experiments: from `measured.read_folder`; those with the role "held_out" are used for the gain alone.
    simulator: of their kinds. progress: called with the step in progress. Noise is estimated first and the
    residuals whitened; every effect of the library is then fitted as a rival, and one is named only where it
    is significant, predicts left-out experiments better and leaves no structure. Raises InputError where no
    experiment can be predicted, and where `require_plausible` does.
    """
    experiments, set_aside = without_wrong_readings(experiments, simulator)
    experiments, averaged = thinned(experiments, simulator)
    set_aside += averaged
    experiments, again = denoised_drives(experiments, simulator)
    progress("noise")
    fitted = [e for e in experiments if e.role == "fit"]
    simulator.groups |= {e.whose: names for e, names in coincident_effects(fitted).items()}
    measured, fitter, base = _base(experiments, again, simulator)
    experiments, more = without_unpredicted_readings(experiments, simulator, base.values)
    if more:
        set_aside = [*set_aside, *more]
        measured, fitter, base = _base(experiments, again, simulator)
    sources = fitter.sources
    require_plausible(fitter, base)
    progress("sensitivities")
    seen = _seen(fitter, base)
    chosen = select(fitter, seen, progress)
    for _ in range(QUIETER):
        if not chosen.causes:
            break
        renewed = noise_of(measured, simulator, chosen.chosen.values, _wandering(chosen))
        if not any(_total(sources[g]) > RENEWED * _total(renewed[g]) for g in sources):
            break
        # Around the base model a large cause differs from its slope: it had counted as noise, which hides a
        # second cause, or another first one.
        progress("selection under quieter noise")
        sources, fitter = renewed, Fitter(measured, simulator, renewed)
        base = fitter.fit()
        seen = _seen(fitter, base)
        chosen = select(fitter, seen, progress)
    if chosen.causes and _kind(fitter, chosen) == "unexplained":
        # Beside a large misfit isolated readings are not seen.
        experiments, more = without_unpredicted_readings(experiments, simulator, chosen.chosen.values)
        if more:
            set_aside = [*set_aside, *more]
            measured, fitter, base = _base(experiments, again, simulator)
            sources = fitter.sources
            seen = _seen(fitter, base)
            chosen = reselected(fitter, seen, chosen)
    if _kind(fitter, chosen) in OPEN:
        chosen, seen = select_owned(fitter, seen, chosen, progress)
    if _kind(fitter, chosen) in OPEN or (chosen.causes and _strained(fitter, chosen.chosen)):
        chosen = select_pooled(fitter, chosen, progress)
    chosen = further_owners(fitter, chosen, progress)
    if chosen.causes and not chosen.causes[0].effect.among:
        progress("noise around the causes")
        # The nonlinear rest of a large cause had counted as noise.
        owned = [e for e in chosen.chosen.effects if e.whose]
        renewed = noise_of(measured, simulator, chosen.chosen.values, _wandering(chosen))
        if any(_apart(sources[g], renewed[g]) for g in sources):
            sources, fitter = renewed, Fitter(measured, simulator, renewed)
            chosen = reselected(fitter, seen, chosen)
            if chosen.left:
                seen = _seen(fitter, base)
                chosen = one_more(fitter, seen, chosen, progress)
            if _kind(fitter, chosen) == "unexplained" and not owned:
                chosen, seen = select_owned(fitter, seen, chosen, progress)
    chosen = coinciding(fitter, chosen, progress)
    before = experiments, set_aside, fitter, base, seen, chosen
    for _ in range(ROUNDS):
        if OUTLIER not in chosen.left or (chosen.doubted and chosen.causes):
            break
        experiments, more = without_outliers(experiments, fitter, chosen.chosen, len(chosen.table))
        if not more:
            break
        set_aside = [*set_aside, *more]
        if chosen.causes:
            fitter = Fitter(_measured(experiments, again, simulator), simulator, sources)
            base = fitter.fit()
        else:
            measured, fitter, base = _base(experiments, again, simulator)
        seen = _seen(fitter, base)
        chosen = reselected(fitter, seen, chosen) if chosen.causes else select(fitter, seen, progress)
    if chosen.left or chosen.doubted:
        # There were more faults than these.
        experiments, set_aside, fitter, base, seen, chosen = before
    if chosen.causes and _kind(fitter, chosen) != "unexplained":
        louder = _loud_alone(fitter, seen, chosen, progress)
        if louder is not None:
            fitter, chosen, bursts = louder
            base = chosen.base
            set_aside = [*set_aside, *bursts]
    most = None
    if _kind(fitter, chosen) == "unexplained" and not _of_no_size(fitter, chosen):
        # Where a cause takes most of a misfit, fast errors of its law would pass for bursts.
        most = mainly(fitter, chosen)
    if _kind(fitter, chosen) == "unexplained" and most is None:
        left = fitter.record.values - fitter.predict(chosen.chosen.values)
        measured, bursts = with_bursts(fitter.record, left)
        if bursts:
            progress("noise in bursts")
            other = Fitter(measured, simulator, noise_of(measured, simulator, chosen.chosen.values))
            # What is structure beside all causes and beside none is no burst.
            both = (other.fit(effects, chosen.chosen.values) for effects in (chosen.chosen.effects, ()))
            if not all(structure(strict_table(other, f)) for f in both):
                anew = select(other, seen, progress)
                if _kind(other, anew) != "unexplained":
                    fitter, base, chosen = other, anew.base, anew
                    set_aside = [*set_aside, *bursts]
    measured, sources = fitter.record, fitter.sources
    kind = _kind(fitter, chosen)
    if kind not in ("none", "unidentifiable") and (words := _of_no_size(fitter, chosen)):
        chosen = attrs.evolve(chosen, chosen=chosen.base, causes=(), doubted="", excused=words)
        set_aside = [*set_aside, words]
        kind = _kind(fitter, chosen)
    if kind == "none" and not chosen.excused and (words := too_far(fitter, chosen.base)):
        chosen = attrs.evolve(chosen, doubted=words)
        kind = _kind(fitter, chosen)
    if kind == "unexplained" and (most := most or mainly(fitter, chosen)) is not None:
        chosen = most
        kind = "ambiguous" if any(c.rivals for c in chosen.causes) else "named"
    progress("gain")
    gained = gain(fitter, chosen.base, chosen.chosen, [e for e in experiments if e.role == "held_out"])
    set_aside += [
        f"{name} was held out but cannot be predicted, and is not in the gain: {why}"
        for name, why in gained.refused.items()
    ]
    proposal = propose_experiment(fitter, chosen, seen)
    if kind == "unexplained" and len(chosen.causes) > 1:
        chosen = with_promising_rivals(fitter, chosen, progress)
    known = chosen.chosen if chosen.causes else chosen.base
    # For an effect that is no cause the curvature suffices.
    sure = kind != "unexplained"
    bounds = {k: interval(fitter, known, k) if sure else _by_curvature(known, k) for k in known.keys}
    identifiability = _identifiability(seen, chosen)
    return Verdict(
        kind,
        chosen,
        tuple(seen),
        sources,
        measured,
        gained,
        proposal,
        identifiability,
        bounds,
        tuple(experiments),
        tuple(set_aside),
        dict(simulator.refused),
        share_taken(fitter, chosen.base, chosen.chosen),
        _nearest(fitter, chosen),
        tuple(unlikely(fitter.curved, chosen.base)),
        fitted_zeros(fitter, chosen.base),
    )


def _loud_alone(
    fitter: Fitter, seen: Sequence[Sensitivity], found: Selection, progress: Callable[[str], None]
) -> tuple[Fitter, Selection, list[str]] | None:
    """Fitter, selection and remarks under noise in bursts if that explains the causes away; else None.

    Noise that grows with load is largest where laws of the material differ most.
    """
    left = fitter.record.values - fitter.predict(found.chosen.values)
    measured, bursts = with_bursts(fitter.record, left)
    if not bursts:
        return None
    progress("noise in bursts")
    noise = noise_of(measured, fitter.simulator, found.chosen.values, _wandering(found))
    other = Fitter(measured, fitter.simulator, noise)
    if all(c.p_value < FALSE_ALARM_RATE for c in reselected(other, seen, found).causes):
        return None
    return other, select(other, seen, progress), bursts


def _nearest(fitter: Fitter, found: Selection) -> tuple[str, float] | None:
    """Title and share of the misfit of the single explanation that takes most of it; None without any."""
    pool = [f for f in ranked([*found.singles, *found.wider]) if not at_a_bound(f)]
    return (pool[0].effects[0].title, share_taken(fitter, found.base, pool[0])) if pool else None


def _of_no_size(fitter: Fitter, found: Selection) -> str:
    """Reason why a misfit is none, in words: as small as the scatter, with no cause but a record's zero.

    Slow noise differs from record to record, as zeros do; none depends on how a unit is turned, which is read
    at rest.
    """
    left = fitter.record.values - fitter.predict(found.base.values)
    drifting = all((c.effect.whose or c.effect.among) and c.effect.name in ZEROS for c in found.causes)
    if not drifting or BY_TURN in structure(found.table) or not within_scatter(fitter.record, left):
        return ""
    depends = [c.effect.title for c in found.causes] or structure(found.table) or ["no quantity"]
    on = ", ".join(n.replace("_", " ") for n in depends)
    return (
        f"the residual depends on {on}, by less than {NEAR:g} times the scatter of the readings: slow or "
        "uneven noise of the instruments does that"
    )


def _by_curvature(fit: Fit, key: str) -> tuple[float, float]:
    """The 95 % interval (low, high) of a fitted value by the curvature of chi squared, in its unit."""
    return fit.values[key] - 1.96 * fit.sd(key), fit.values[key] + 1.96 * fit.sd(key)


def _base(
    experiments: Sequence[Experiment], again: Sequence[Experiment] | None, simulator: Composite
) -> tuple[Record, Fitter, Fit]:
    """Record of the fitted experiments, a fitter with its noise, and the fit without effects."""
    measured = _measured(experiments, again, simulator)
    fitter = Fitter(measured, simulator, noise_of(measured, simulator))
    return measured, fitter, fitter.fit()


def _measured(
    experiments: Sequence[Experiment], again: Sequence[Experiment] | None, simulator: Composite
) -> Record:
    """Record of the fitted experiments, with drives by a second reading of their gauges."""
    found = record([e for e in experiments if e.role == "fit"], simulator)
    if not again:
        return found
    other = {e.name: e for e in again}
    return attrs.evolve(found, again=tuple(other[e.name] for e in found.experiments))


def _among(effect: Effect) -> dict[str, Any] | None:
    """Owners among which an effect differs, and its standard deviation with an interval."""
    if not effect.among:
        return None
    value, low, high = effect.spread
    unit = effect.parameters[0].unit
    return {"what": effect.among, "spread": {"value": value, "low95": low, "high95": high, "unit": unit}}


def _wandering(found: Selection) -> list[Effect]:
    """Chosen effects that the estimate of noise does not set aside itself."""
    return [e for e in found.chosen.effects if e.whose or e.name in WANDERING]


def _total(source: Source) -> float:
    return math.hypot(source.white, source.slow)


def _apart(one: Source, other: Source) -> bool:
    """Return True if two estimates of one noise differ more than such estimates do."""
    total = [_total(s) for s in (one, other)]
    return max(total) > RENEWED * min(total)


def _strained(fitter: Fitter, fit: Fit) -> bool:
    """Return True if a nuisance is much farther from its prior value than its spread allows."""
    return any(abs(fit.values[p.name] - p.null) > STRAINED * p.spread for p in fitter.known)


def _kind(fitter: Fitter, found: Selection) -> str:
    if found.left or found.doubted:
        return "unexplained"
    if found.causes:
        return "ambiguous" if any(c.rivals for c in found.causes) else "named"
    return "unidentifiable" if unlikely(fitter.curved, found.base) else "none"


def unlikely(nuisances: Sequence[Parameter], base: Fit) -> list[Parameter]:
    """Nuisances with values far from prior knowledge, the farthest first."""
    away = {p: abs(base.values[p.name] - p.null) / p.spread for p in nuisances if math.isfinite(p.spread)}
    return sorted((p for p in away if away[p] > UNLIKELY), key=lambda p: -away[p])


def _identifiability(seen: Sequence[Sensitivity], chosen: Selection) -> dict[str, str]:
    """Effects that these data cannot show, with the reason and a way to show them."""
    found = {}
    shown = {f.names[0] for f in chosen.singles if chosen.base.chi2 - f.chi2 >= SEEN**2}
    for name, s in best_seen(seen).items():
        if s.identifiable or name in shown:
            continue
        p = s.effect.parameters[0]
        if s.unabsorbed > ABSORBED and math.isfinite(s.limit):
            most = max((p.low, p.high), key=lambda bound: abs(bound - p.null))
            size, unit = p.name.replace("_", " "), f" {p.unit}" * bool(p.unit)
            found[name] = (
                f"its bound, {size} {most:g}{unit}, is too small to be detected here, where "
                f"{s.limit:.2g}{unit} would be; experiment that shows it: {s.effect.reveals}"
            )
        elif s.absorbed_by and s.unabsorbed > 0:
            by = " and ".join(n.replace("_", " ") for n in s.absorbed_by)
            found[name] = f"absorbed by {by}; experiment that shows it: {s.effect.reveals}"
        else:
            found[name] = f"no measured quantity depends on it; experiment that shows it: {s.effect.reveals}"
    return found
