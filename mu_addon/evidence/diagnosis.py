"""A diagnosis: its steps in order, each from one state of the diagnosis to the next, and its verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np

from ..measured import Experiment
from .acceptance import too_far
from .detection_limits import at_bounds, with_true_limits
from .drive import denoised_drives
from .effect import Effect
from .effects import LEVEL
from .fit import Fit, Fitter, interval, interval_by_curvature
from .fitted_zeros import fitted_zeros
from .found_causes import FALSE_ALARM_RATE, Selection
from .gain_on_unseen import gain
from .main_causes import mainly, share_taken
from .next_experiment import propose_experiment
from .noise import Source, estimate, span
from .outliers import NAME as OUTLIER
from .outliers import without_outliers
from .owned import coincident_effects
from .plausibility import require_plausible
from .readings import without_unpredicted_readings, without_wrong_readings
from .record import Record, record
from .residual_tests.table import strict_table, structure
from .residual_tests.without_clock import ALTERNATION, BY_TURN
from .rivals import beyond_bounds, coinciding, with_promising_rivals
from .scatter import (
    NEAR,
    with_bursts,
    within_accuracy,
    within_scatter,
    within_scatter_without_clock,
)
from .search import further_owners, of_some_tests, one_more, reselected, select, select_owned, select_pooled
from .sensitivity import (
    ABSORBED,
    WANDERING,
    Sensitivity,
    sensitivities,
    signatures,
)
from .simulator import Composite
from .thinning import thinned
from .verdict import Verdict, identifiability, nearest, unlikely, verdict_kind

Progress = Callable[[str], None]

# Effects that may belong to one specimen, or differ among them, if no common one explains the data.
OPEN = ("unexplained", "unidentifiable")
# This many effects stand in for one that differs among owners: three leaks as one, with valves shut late.
STRAINED = 5.0
# Noise around the causes larger or smaller than around the base model by this factor replaces it.
RENEWED = 1.5
# Times that causes are selected anew under noise that is quieter around those found before.
QUIETER = 2
# Number of times that isolated outliers are set aside.
ROUNDS = 3


@attrs.frozen(eq=False)
class Diagnosis:
    """State of a diagnosis: the data in use, their noise (in the fitter), and their explanation.

    again: see `drive.denoised_drives`. set_aside: texts on readings left out, and other remarks. seen:
    sensitivities of the effects. graded: the causes are named although structure is left
    (`main_causes.mainly`).
    """

    experiments: tuple[Experiment, ...]
    again: Sequence[Experiment] | None
    set_aside: tuple[str, ...]
    fitter: Fitter
    seen: Sequence[Sensitivity]
    chosen: Selection
    graded: bool = False

    @property
    def kind(self) -> str:
        """One of `verdict.KINDS`."""
        return verdict_kind(self.chosen, self.fitter.curved, self.graded)

    def without(self, experiments: Sequence[Experiment], words: Sequence[str]) -> Diagnosis:
        """With experiments from which readings were removed, and these as text."""
        return attrs.evolve(self, experiments=tuple(experiments), set_aside=(*self.set_aside, *words))

    def under(self, fitter: Fitter, progress: Progress, found: Selection | None = None) -> Diagnosis:
        """With another fitter: effects are selected again, or those of a selection are judged again."""
        seen = _seen(fitter, fitter.fit())
        chosen = reselected(fitter, seen, found) if found else select(fitter, seen, progress)
        return attrs.evolve(self, fitter=fitter, seen=seen, chosen=chosen)


def begun(experiments: Sequence[Experiment], simulator: Composite, progress: Progress) -> Diagnosis:
    """Readings and drives cleaned, their noise estimated, and the common effects selected.

    Raises InputError where no experiment can be predicted, and where `require_plausible` does.
    """
    experiments, words = without_wrong_readings(experiments, simulator)
    experiments, averaged = thinned(experiments, simulator)
    experiments, again = denoised_drives(experiments, simulator)
    progress("noise")
    fitted = [e for e in experiments if e.role == "fit"]
    simulator.groups |= {e.whose: names for e, names in coincident_effects(fitted).items()}
    fitter = _fitter(experiments, again, simulator)
    base = fitter.fit()
    experiments, alone = without_unpredicted_readings(experiments, simulator, base.values)
    if alone:
        fitter = _fitter(experiments, again, simulator)
        base = fitter.fit()
    require_plausible(fitter, base)
    progress("sensitivities")
    seen = _seen(fitter, base)
    set_aside = (*words, *averaged, *alone)
    return Diagnosis(tuple(experiments), again, set_aside, fitter, seen, select(fitter, seen, progress))


def under_quieter_noise(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Select again while the noise around the causes is much smaller.

    Around the base model a large cause differs from its slope: it had counted as noise, which hides a second
    cause, or another first one.
    """
    for _ in range(QUIETER):
        if not now.chosen.causes:
            break
        renewed, before = _noise_around(now), now.fitter.sources
        if not _louder(before, renewed):
            break
        progress("selection under quieter noise")
        now = now.under(Fitter(now.fitter.record, now.fitter.simulator, renewed), progress)
    return now


def without_lone_readings(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Set aside isolated readings once causes are in the model: a large misfit hides them."""
    if now.chosen.causes and now.kind == "unexplained":
        simulator = now.fitter.simulator
        fewer, words = without_unpredicted_readings(now.experiments, simulator, now.chosen.chosen.values)
        if words:
            fitter = _fitter(fewer, now.again, simulator)
            now = now.without(fewer, words).under(fitter, progress, now.chosen)
    return now


def with_owners(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Add effects of one owner, or that differ among owners, to a selection that explains too little."""
    if now.kind in OPEN:
        chosen, seen = select_owned(now.fitter, now.seen, now.chosen, progress)
        now = attrs.evolve(now, chosen=chosen, seen=seen)
    values, known = now.chosen.chosen.values, now.fitter.known
    strained = any(abs(values[p.name] - p.null) > STRAINED * p.spread for p in known)
    if now.kind in OPEN or (now.chosen.causes and strained) or of_some_tests(now.chosen):
        now = attrs.evolve(now, chosen=select_pooled(now.fitter, now.chosen, progress))
    return attrs.evolve(now, chosen=further_owners(now.fitter, now.chosen, progress))


def under_renewed_noise(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Judge the causes under the noise around them: the nonlinear rest of a large one was noise before."""
    causes = now.chosen.causes
    if causes and not causes[0].effect.among:
        progress("noise around the causes")
        renewed, before = _noise_around(now), now.fitter.sources
        if _louder(before, renewed) or _louder(renewed, before):
            owned = any(c.effect.whose for c in causes)
            fitter = Fitter(now.fitter.record, now.fitter.simulator, renewed)
            now = attrs.evolve(now, fitter=fitter, chosen=reselected(fitter, now.seen, now.chosen))
            if now.chosen.left:
                seen = _seen(fitter, now.chosen.base)
                now = attrs.evolve(now, seen=seen, chosen=one_more(fitter, seen, now.chosen, progress))
            if now.kind == "unexplained" and not owned:
                chosen, seen = select_owned(fitter, now.seen, now.chosen, progress)
                now = attrs.evolve(now, chosen=chosen, seen=seen)
    return attrs.evolve(now, chosen=coinciding(now.fitter, now.chosen, progress))


def without_outlying_readings(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Set aside outliers if no other structure is left; unchanged if there are more faults."""
    later = now
    for _ in range(ROUNDS):
        found, simulator = later.chosen, later.fitter.simulator
        if OUTLIER not in found.left or (found.doubted and found.causes):
            break
        fewer, words = without_outliers(later.experiments, later.fitter, found.chosen, len(found.table))
        if not words:
            break
        sources = later.fitter.sources if found.causes else None
        fitter = _fitter(fewer, later.again, simulator, sources)
        later = later.without(fewer, words).under(fitter, progress, found if found.causes else None)
    return now if later.chosen.left or later.chosen.doubted else later


def under_bursts(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Judge causes, or a misfit, under noise that comes in bursts or grows with load; unchanged without.

    Such noise is largest where laws of the material differ most. Causes that are significant under it stay. A
    misfit stays if it has structure both with all causes and with none.
    """
    found, simulator, unexplained = now.chosen, now.fitter.simulator, now.kind == "unexplained"
    if now.graded or not (unexplained or found.causes):
        return now
    left = now.fitter.record.values - now.fitter.predict(found.chosen.values)
    measured, words = with_bursts(now.fitter.record, left)
    if not words:
        return now
    progress("noise in bursts")
    values = found.chosen.values
    noise = noise_of(measured, simulator, values, () if unexplained else _wandering(found))
    other = Fitter(measured, simulator, noise)
    if unexplained:
        both = (other.fit(effects, values) for effects in (found.chosen.effects, ()))
        stays = all(structure(strict_table(other, fit)) for fit in both)
    else:
        stays = all(c.p_value < FALSE_ALARM_RATE for c in reselected(other, now.seen, found).causes)
    if stays:
        return now
    later = attrs.evolve(now, fitter=other, chosen=select(other, now.seen, progress))
    if unexplained and later.kind == "unexplained":
        return now
    return attrs.evolve(later, set_aside=(*now.set_aside, *words))


def with_what_explains_most(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Name the cause of most of an unexplained misfit; fast errors of its law would look like bursts."""
    if now.kind == "unexplained" and not _of_no_size(now.fitter, now.chosen):
        most = mainly(now.fitter, now.chosen)
        now = attrs.evolve(now, chosen=most, graded=True) if most else now
    return now


def by_size(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Excuse a misfit as small as the scatter, and doubt one that no noise explains."""
    found = now.chosen
    ended = now.graded or now.kind in ("none", "unidentifiable")
    words = "" if ended else _of_no_size(now.fitter, found)
    if words:
        none = attrs.evolve(found, chosen=found.base, causes=(), doubted="", excused=words)
        now = attrs.evolve(now, chosen=none, set_aside=(*now.set_aside, words))
    found = now.chosen
    sure = now.kind != "unexplained" and not (now.graded or found.excused)
    if sure and (words := too_far(now.fitter, found.chosen)):
        doubted = attrs.evolve(now, chosen=attrs.evolve(found, doubted=words))
        now = with_what_explains_most(doubted, progress)
    return now


def without_bounds(now: Diagnosis, progress: Progress) -> Diagnosis:
    """Give causes without rivals those that only a bound of their own excludes."""
    if now.kind == "named":
        now = attrs.evolve(now, chosen=beyond_bounds(now.fitter, now.chosen, now.seen, progress))
    return now


STEPS = (
    under_quieter_noise,
    without_lone_readings,
    with_owners,
    under_renewed_noise,
    without_outlying_readings,
    with_what_explains_most,
    under_bursts,
    by_size,
    without_bounds,
)


def diagnose(
    experiments: Sequence[Experiment], simulator: Composite, progress: Callable[[str], None] = lambda _: None
) -> Verdict:
    """Judge a model by measured experiments: which effects explain the misfit, and how surely.

    experiments: from `measured.read_folder`; those with the role "held_out" are used for the gain alone.
    simulator: of their kinds. progress: called with the step in progress. Noise is estimated first and the
    residuals are whitened. Then every effect of the library is fitted as a rival. One is named only if it is
    significant, predicts left-out experiments better and leaves no structure. Raises InputError where no
    experiment can be predicted, and where `require_plausible` does.
    """
    now = begun(experiments, simulator, progress)
    for step in STEPS:
        now = step(now, progress)
    fitter, chosen, kind, set_aside = now.fitter, now.chosen, now.kind, list(now.set_aside)
    progress("gain")
    gained = gain(fitter, chosen.base, chosen.chosen, [e for e in now.experiments if e.role == "held_out"])
    set_aside += [
        f"{name} was held out but cannot be predicted, and is not in the gain: {why}"
        for name, why in gained.refused.items()
    ]
    proposal = propose_experiment(fitter, chosen, now.seen)
    seen = now.seen
    if kind == "none":
        # What would have been detected is told.
        progress("detection limits")
        seen = with_true_limits(fitter, {p.name: chosen.base.values[p.name] for p in fitter.curved}, seen)
    if kind == "unexplained" and len(chosen.causes) > 1:
        chosen = with_promising_rivals(fitter, chosen, progress)
    known = chosen.chosen if chosen.causes else chosen.base
    # For an effect that is no cause the curvature suffices.
    sure = kind != "unexplained"
    bounds = {k: interval(fitter, known, k) if sure else interval_by_curvature(known, k) for k in known.keys}
    return Verdict(
        kind,
        chosen,
        tuple(seen),
        fitter.sources,
        fitter.record,
        gained,
        proposal,
        identifiability(seen, chosen),
        bounds,
        now.experiments,
        tuple(set_aside),
        dict(simulator.refused),
        share_taken(fitter, chosen.base, chosen.chosen),
        nearest(fitter, chosen),
        tuple(unlikely(fitter.curved, chosen.base)),
        fitted_zeros(fitter, chosen.base),
    )


def _fitter(
    experiments: Sequence[Experiment],
    again: Sequence[Experiment] | None,
    simulator: Composite,
    sources: Mapping[str, Source] | None = None,
) -> Fitter:
    """Fitter to the experiments that are fitted, under noise estimated around the base model or given.

    again: the drives by a second reading of their gauges.
    """
    measured = record([e for e in experiments if e.role == "fit"], simulator)
    if again:
        other = {e.name: e for e in again}
        measured = attrs.evolve(measured, again=tuple(other[e.name] for e in measured.experiments))
    return Fitter(measured, simulator, sources or noise_of(measured, simulator))


def noise_of(
    measured: Record,
    simulator: Composite,
    values: Mapping[str, float] | None = None,
    effects: Sequence[Effect] = (),
) -> dict[str, Source]:
    """White and slow noise of a record, by group of series in its channel's unit (see `noise.estimate`).

    values: of nuisances and effects by key, in their units, around which the noise is estimated; those of the
    base model's fit where None. Changes by effects of the library and of `effects` do not count as noise, nor
    does a deviation beyond a stated accuracy.
    """
    if values is None:
        rough = Fitter(measured, simulator, {g: _rough(measured, g) for g in measured.groups})
        values = rough.fit().values
    zeros = {p.name for p in simulator.nuisances if p.linear}
    curved = {k: v for k, v in values.items() if k not in zeros}
    columns = span(measured, signatures(measured, simulator, curved, effects))
    found = estimate(measured, measured.values - measured.predict(simulator, values), columns)
    return within_scatter_without_clock(measured, within_accuracy(measured, found))


def _rough(measured: Record, group: str) -> Source:
    """Rough sizes: white noise of a hundredth of the group's range."""
    values = np.concatenate([measured.values[s.at] for s in measured.series if s.group == group])
    return Source(max(float(np.ptp(values)), 1e-9) / 100.0, 1e-6, 1.0)


def _seen(fitter: Fitter, base: Fit) -> list[Sensitivity]:
    """Sensitivity to each effect of the library at the base model's values.

    Also to laws with more freedom of an effect whose first law shows nothing: where a modulus takes up a
    frame that gives in proportion, it leaves one that settles.
    """
    curved = {p.name: base.values[p.name] for p in fitter.curved}
    seen = at_bounds(fitter, curved, sensitivities(fitter, curved))
    shown = {s.effect.name for s in seen if s.unabsorbed > ABSORBED}
    alone = [law for law in fitter.simulator.refinements if law.name not in shown]
    return [*seen, *at_bounds(fitter, curved, sensitivities(fitter, curved, alone))]


def _noise_around(now: Diagnosis) -> dict[str, Source]:
    found, fitter = now.chosen, now.fitter
    return noise_of(fitter.record, fitter.simulator, found.chosen.values, _wandering(found))


def _of_no_size(fitter: Fitter, found: Selection) -> str:
    """Reason to dismiss a misfit, as text: as small as the scatter, with no cause but a record's zero.

    Slow noise differs between records, as zeros do. It neither depends on a unit's orientation, which is read
    at rest, nor alternates.
    """
    left = fitter.record.values - fitter.predict(found.base.values)
    drifting = all((c.effect.whose or c.effect.among) and c.effect.name in LEVEL for c in found.causes)
    as_large = {ALTERNATION, BY_TURN} & {*structure(found.table)}
    if not drifting or as_large or not within_scatter(fitter.record, left):
        return ""
    depends = [c.effect.title for c in found.causes] or structure(found.table) or ["no quantity"]
    on = ", ".join(n.replace("_", " ") for n in depends)
    return (
        f"the residual depends on {on}, by less than {NEAR:g} times the scatter of the readings: slow or "
        "uneven noise of the instruments does that"
    )


def _wandering(found: Selection) -> list[Effect]:
    """Chosen effects that the estimate of noise does not set aside itself."""
    return [e for e in found.chosen.effects if e.whose or e.name in WANDERING]


def _louder(one: Mapping[str, Source], other: Mapping[str, Source]) -> bool:
    """Return True if noise of some group exceeds another estimate by more than such estimates differ."""
    return any(
        math.hypot(source.white, source.slow) > RENEWED * math.hypot(other[g].white, other[g].slow)
        for g, source in one.items()
    )
