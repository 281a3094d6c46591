"""Effects added to a selection that explains too little: a common one, one of an owner, one that differs."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs

from .effect import BATCH, FORCE_SCALE, STEP, Effect
from .fit import Fit, Fitter
from .owned import MACHINE, owned_effects, owners
from .pooled import fits_among, pooled_effects, sizes_of
from .residuals import strict_table
from .selection import (
    ALONE,
    FALSE_ALARM_RATE,
    LAW,
    MOST_EFFECTS,
    RIVAL_DELTA_CHI2,
    Cause,
    Selection,
    at_a_bound,
    beside,
    by_count,
    causes_of,
    cost,
    doubts,
    false_alarm_probability,
    gain_of,
    hypotheses,
    loss,
    promising_rivals,
    share_by_experiment,
)
from .sensitivity import Sensitivity, sensitivities

# Most effects of owners that are fitted, the most promising first.
MOST_FITS = 12


def accepted(fitter: Fitter, found: Selection, less: Fit, more: Fit, p: float) -> bool:
    """Return True if the last effect of a model may be named beside a model without it.

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


def one_more(
    fitter: Fitter,
    seen: Sequence[Sensitivity],
    found: Selection,
    progress: Callable[[str], None] = lambda _: None,
) -> Selection:
    """Add to a selection that left structure the common effect that takes all of it; unchanged without such.

    For noise that was estimated anew around the causes: an effect smaller than the noise assumed before may
    now be significant.
    """
    if found.doubted or not found.left or len(found.chosen.effects) >= MOST_EFFECTS:
        return found
    return _grown(fitter, found, seen, _usable(seen), [found.chosen], progress)


def select_owned(
    fitter: Fitter,
    seen: Sequence[Sensitivity],
    found: Selection,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Selection, list[Sensitivity]]:
    """Add to an insufficient selection the effect of one specimen or experiment that explains the data.

    Unchanged where there is none. The choice of the specimen adds to chance, too: the false-positive rate is
    that of the whole library for every owner. Also returned: sensitivities of all.
    """
    owned = owned_effects(fitter.simulator.effects, fitter.record.experiments)
    if not owned:
        return found, list(seen)
    curved = {p.name: found.base.values[p.name] for p in fitter.curved}
    every = [*seen, *sensitivities(fitter, curved, owned)]
    effects = tuple(e for e in _usable(every) if e.whose)
    seeds = list(dict.fromkeys([found.base, found.chosen]))
    grown = _grown(fitter, found, every, effects, seeds, progress, MOST_FITS)
    return grown, list(seen) if grown.chosen is found.chosen else every


def _usable(seen: Sequence[Sensitivity]) -> tuple[Effect, ...]:
    return tuple({s.effect.keys: s.effect for s in seen if s.worth_a_fit}.values())


def _grown(
    fitter: Fitter,
    found: Selection,
    seen: Sequence[Sensitivity],
    effects: Sequence[Effect],
    seeds: Sequence[Fit],
    progress: Callable[[str], None],
    most: int | None = None,
) -> Selection:
    """A selection with the best of some effects added to the first of the seeds where it explains the data.

    Unchanged but for `Selection.wider` where none does. most: of the effects that are fitted beside a seed.
    """
    singles, wider = found.singles, found.wider
    for seed in seeds:
        pool = hypotheses(fitter, [seed], effects, progress, most)
        if seed is found.base:
            wider, singles = tuple(pool), tuple(sorted([*singles, *pool], key=cost))
        if not pool or not _leads(found, pool, singles):
            continue
        best = pool[0]
        p = false_alarm_probability(fitter, seed, seen, gain_of(fitter, seed, best))
        if not accepted(fitter, found, seed, best, p):
            continue
        level = [f for f in [*pool, *_of_as_many(best, singles)] if len(f.effects) == 1]
        tried = effects if most is None else [f.effects[-1] for f in pool]
        ps = [*(c.p_value for c in found.causes), p]
        chosen = attrs.evolve(
            found,
            chosen=best,
            causes=causes_of(fitter, tried, found.base, best, ps, [level]),
            table=tuple(strict_table(fitter, best)),
            singles=singles,
            doubted="",
            p_best=p,
        )
        if chosen.left:
            # One more specimen may have the same effect; for several see `pooled`.
            chosen = further_owners(fitter, chosen, progress)
        if not chosen.left and len(chosen.chosen.effects) <= len(best.effects) + 1:
            return chosen
    return attrs.evolve(found, wider=wider) if wider else found


def _leads(found: Selection, pool: Sequence[Fit], singles: Sequence[Fit]) -> bool:
    """Return True if the first fit of a pool explains more than any common effect, and its owner is sure."""
    best = pool[0]
    alike = [f for f in [*pool[1:], *_of_as_many(best, singles)] if f.names == best.names]
    unsure = any(f.chi2 - best.chi2 < RIVAL_DELTA_CHI2 and _owner(f) != _owner(best) for f in alike)
    return not unsure and cost(best) < min(cost(found.chosen), *(cost(f) for f in found.singles))


def _of_as_many(best: Fit, fits: Sequence[Fit]) -> list[Fit]:
    return [f for f in fits if len(f.effects) == len(best.effects) and f is not best]


def _owner(fit: Fit) -> str:
    return fit.effects[-1].whose


def select_pooled(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """Add to an insufficient selection the effect whose differences among owners explain the data.

    Unchanged where there is none. The false-positive probability is that of a spread at its bound of 0 (half
    a chi squared of one degree), times the number of effects and groupings tried. No effect of one size for
    all may explain more: smooth structure may pass for slow noise. Rivals are other effects, or groupings,
    with as good a likelihood within their law's error (`LAW`).
    """
    fits = fits_among(fitter, found.base, progress)
    if not fits:
        return found
    found = attrs.evolve(found, wider=(*found.wider, *(f for _, f in fits)))
    gain, best = fits[0]
    own = sizes_of(best.effects[0])
    tried = len(pooled_effects(fitter.simulator.effects, fitter.record.experiments))
    p = by_count(gain, 1 + len(best.effects[0].keys) - len(own), 0.5 * tried)
    common = any(single.chi2 < best.chi2 for single in found.singles)
    if common or not accepted(fitter, found, found.base, best, p):
        return found
    margin = max(RIVAL_DELTA_CHI2, LAW**2 * gain)
    near = [f.effects[0] for g, f in fits[1:] if gain - g < margin]
    # Any difference among specimens is also one among their experiments, and another law is the same cause.
    rivals = dict.fromkeys(e.title for e in near if e.name != best.names[0] or len(sizes_of(e)) < len(own))
    cause = Cause(best.effects[0], p, found.base.chi2 - best.chi2, tuple(rivals))
    table = tuple(strict_table(fitter, best))
    pooled = attrs.evolve(found, chosen=best, causes=(cause,), table=table, doubted="", p_best=p)
    return found if pooled.left else pooled


def further_owners(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """Add to a selection whose last effect belongs to one owner the same effect of every other who has it.

    Beside a large leak of one specimen a small one of another passes for slow noise and leaves no structure.
    An owner is added where it is `accepted` and no structure is left. Unchanged where no effect belongs to
    one specimen.
    """
    chosen = found.chosen
    if not chosen.effects or found.doubted:
        return found
    first = chosen.effects[-1]
    kind, _, _ = first.whose.partition(" ")
    if kind != "specimen" or first.name == BATCH:
        return found
    own = [e for e in fitter.record.experiments if e.kind in first.kinds]
    others = [w for w in owners(first.name, own) if w.startswith(kind) and w != first.whose]
    causes, tried = list(found.causes), len(others)
    while others:
        progress(first.name)
        pool = [
            beside(fitter, chosen.effects, attrs.evolve(first, whose=whose), chosen.values)
            for whose in others
        ]
        best = min(pool, key=cost)
        p = by_count(gain_of(fitter, chosen, best), len(first.keys), tried)
        if not accepted(fitter, found, chosen, best, p):
            break
        causes.append(Cause(best.effects[-1], p, chosen.chi2 - best.chi2, ()))
        more = attrs.evolve(found, chosen=best, causes=tuple(causes), table=tuple(strict_table(fitter, best)))
        if more.left and not found.left:
            break
        found = found if more.left else more
        chosen = best
        others.remove(_owner(best))
    return found


def coinciding(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """Add, as rivals of a selection's causes, effects that scale the same experiments' force equally well.

    If one specimen was tested along x, or all fast tests came last, a cause that acts along x, or by rate,
    may also be that specimen's height as typed, or a change before those tests. Each is fitted in place of
    each cause, and is a rival within `RIVAL_DELTA_CHI2`.
    """
    chosen = found.chosen
    scales = [e for e in fitter.simulator.effects if e.name == FORCE_SCALE]
    # A stated standard deviation includes the spread of specimens.
    single = [e for e in fitter.record.experiments if "stress_sd_kPa" not in e.columns]
    owned = [e for e in owned_effects(scales, single) if set(e.kinds) & set(MACHINE)]
    if not owned or not found.causes or found.left or found.doubted:
        return found
    causes = []
    for c in found.causes:
        scaled = owned if set(c.effect.kinds) & set(MACHINE) else []
        fits = promising_rivals(fitter, chosen, c.effect, scaled, progress)
        near = [f for f in fits if cost(f) - cost(chosen) < RIVAL_DELTA_CHI2]
        if c.effect.among and near and cost(near[0]) < cost(chosen):
            # One size for some replaces a size of each.
            found, near = attrs.evolve(found, chosen=near[0]), near[1:]
            c = Cause(found.chosen.effects[-1], c.p_value, c.loss, (c.effect.title, *c.rivals))
        rivals = dict.fromkeys((*c.rivals, *(f.effects[-1].title for f in near)))
        causes.append(attrs.evolve(c, rivals=tuple(rivals)))
    return attrs.evolve(found, causes=tuple(causes))
