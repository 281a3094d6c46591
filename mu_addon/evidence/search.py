"""Search for the effects that explain a record: common ones, ones of an owner, ones that differ."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs

from .acceptance import accepted, doubts, loss, of_the_law, too_far
from .effect import BATCH, CURVED_CELL, OF, Effect
from .effects import CAMERA, DECLARED
from .fit import Fit, Fitter
from .found_causes import FALSE_ALARM_RATE, LAW, RIVAL_DELTA_CHI2, Cause, Selection
from .hypotheses import (
    SEEDS,
    beside,
    by_all_laws,
    by_search,
    cost,
    hypotheses,
    other_seeds,
    plausible_first,
    ranked,
    refined,
)
from .owned import owned_effects, owners
from .plausibility import at_a_bound
from .pooled import fits_among, pooled_effects, sizes_of
from .residual_tests.table import dependence_table, strict_table, structure, taken_by_scales
from .rivals import causes_of, pairs_for
from .sensitivity import Sensitivity, sensitivities
from .significance import by_count, by_gauges, false_alarm_probability, gain_of

MOST_EFFECTS = 3
# Ratio of the gain by scales of single tests to a first effect's, above which no second is tried.
ELSEWHERE = 4.0
# Changes of the scale of some tests, and what differs among specimens that would do as much.
OF_SOME = frozenset(name for name, e in DECLARED.items() if e.groups and e.modulus)
OF_SPECIMENS = frozenset(name for name, e in DECLARED.items() if e.differs and not e.groups)
# Faults that two physical effects together imitate.
IMITATED = CAMERA | {CURVED_CELL}
# Most effects of owners that are fitted, the most promising first.
MOST_FITS = 12


def select(
    fitter: Fitter, seen: Sequence[Sensitivity], progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """The effects that explain a record, added one at a time.

    Each must gain more chi squared than noise would at `FALSE_ALARM_RATE`, over the whole library, and must
    reduce the leave-one-experiment-out error. seen: sensitivities of the effects; those not worth a fit are
    not tried. progress: called with the names of the effects that are fitted. Without an explanation the base
    model stays, with the structure that is left.
    """
    base = fitter.fit()
    table_base = tuple(dependence_table(fitter, base))
    usable = {s.effect.keys: s.effect for s in seen if s.worth_a_fit}
    effects = tuple(usable.values())
    pool: list[Fit] = []
    for e in effects:
        progress(e.name)
        pool.append(beside(fitter, (), e, base.values))
    pool = ranked(pool)
    singles = tuple(pool)
    chosen, ps, doubted, p_best = base, [], "", 1.0
    taken = 0.0
    levels: list[list[Fit]] = []
    alone = False
    while (level := len(levels)) < min(MOST_EFFECTS, len(effects)):
        if level and ELSEWHERE * (base.chi2 - chosen.chi2) < taken_by_scales(fitter, base):
            # Tests differ in scale by far more than by a common effect: see `owned`, `pooled`.
            break
        if level:
            pool = hypotheses(fitter, levels[-1][:1], effects, progress)
        # Of an effect that would have to be larger than it can be, more than its law is wrong.
        least = 0.0 if at_a_bound(chosen) else taken
        if not pool or of_the_law(chosen, pool[0], least):
            break
        p = false_alarm_probability(chosen, seen, gain_of(fitter, chosen, pool[0]))
        p_best = p if level == 0 else p_best
        # The best single effect may be neither of two that act together.
        if level and (p < FALSE_ALARM_RATE or structure(strict_table(fitter, chosen))):
            pool = hypotheses(fitter, other_seeds(levels[-1]), effects, progress, known=pool)
            p = false_alarm_probability(chosen, seen, gain_of(fitter, chosen, pool[0]))
        if not level and (p >= FALSE_ALARM_RATE or loss(fitter, chosen, pool[0]) <= 0.0):
            # A first effect may need a second, that alternates from test to test, to predict any test.
            pair = _hidden_pair(fitter, effects, seen, base, pool, progress)
            if pair is not None:
                p_best, chosen = pair
                ps, levels = [p_best, p_best], [pool, [chosen]]
            elif p < FALSE_ALARM_RATE:
                doubted = f"{pool[0].names[-1]} fits, but its leave-one-out prediction fails"
            break
        if p >= FALSE_ALARM_RATE or of_the_law(chosen, pool[0], least):
            break
        if level and loss(fitter, chosen, pool[0]) <= 0.0:
            # It cannot be compared with earlier ones; its part is left as structure.
            other = _foretelling(fitter, effects, seen, chosen, pool, progress)
            if other is None:
                break
            p, pool = other[0], [other[1], *pool]
        if level == 1 and not alone:
            alone = True
            others = by_all_laws(fitter, levels[0], progress, every=True)
            if cost(others[0]) < min(cost(pool[0]), cost(chosen)):
                # One mechanism by another law replaces two.
                levels[0], chosen, singles = others, others[0], tuple(others)
                taken = base.chi2 - chosen.chi2
                continue
        pool = by_all_laws(fitter, pool, progress)
        chosen = pool[0]
        singles = singles if level else tuple(pool)
        taken = base.chi2 - chosen.chi2
        ps.append(p)
        levels.append(pool)
    if len(chosen.effects) > 2:
        chosen = _without_superfluous(fitter, seen, base, chosen)
    doubted = doubted or doubts(fitter, table_base, base, chosen)
    table = tuple(strict_table(fitter, chosen))
    accepted = not (doubted or structure(table))
    causes = causes_of(fitter, effects, base, chosen, ps, levels, accepted)
    if len(causes) == 1 and IMITATED.intersection(chosen.names):
        pairs = pairs_for(fitter, seen, base, chosen, progress)
        causes = (attrs.evolve(causes[0], rivals=(*causes[0].rivals, *pairs)),)
    if chosen is base and accepted:
        table_base = table
        doubted = too_far(fitter, base)
    return Selection(base, chosen, causes, singles, table_base, table, p_best, doubted)


def _foretelling(
    fitter: Fitter,
    effects: Sequence[Effect],
    seen: Sequence[Sensitivity],
    less: Fit,
    pool: Sequence[Fit],
    progress: Callable[[str], None],
) -> tuple[float, Fit] | None:
    """Other effects than a pool's best, that do better than it by other laws and predict what was left out.

    With the probability that noise gains as much; None without. A first effect's law was the best of it
    alone, and beside a second one another may be right.
    """
    best: dict[tuple[str, ...], Fit] = {}
    for f in pool:
        best.setdefault(f.names, f)
    for f in list(best.values())[1 : SEEDS + 1]:
        other = refined(fitter, f, progress, effects)
        if cost(other) < cost(pool[0]) and loss(fitter, less, other) > 0.0:
            p = false_alarm_probability(less, seen, gain_of(fitter, less, other))
            if p < FALSE_ALARM_RATE:
                return p, other
    return None


def _hidden_pair(
    fitter: Fitter,
    effects: Sequence[Effect],
    seen: Sequence[Sensitivity],
    base: Fit,
    singles: Sequence[Fit],
    progress: Callable[[str], None],
) -> tuple[float, Fit] | None:
    """Two effects visible together where neither alone does better than slow noise; None without.

    Sought where one alone gains by the noise with every cause set aside, and not by the noise of the residual
    as if without cause. The probability that noise gains as much is that of the best of all pairs.
    """
    raw = base.chi2 - singles[0].chi2 - by_gauges(fitter, base, singles[0])
    if false_alarm_probability(base, seen, raw) >= FALSE_ALARM_RATE:
        return None
    pool = hypotheses(fitter, singles[:SEEDS], effects, progress)
    if not pool:
        return None
    best = refined(fitter, pool[0], progress)
    more = len(best.keys) - len(base.keys)
    pairs = len(effects) * (len(effects) - 1) / 2
    p = by_count(gain_of(fitter, base, best), more, pairs)
    if p >= FALSE_ALARM_RATE or loss(fitter, base, best) <= 0.0:
        return None
    return p, best


def _without_superfluous(fitter: Fitter, seen: Sequence[Sensitivity], base: Fit, chosen: Fit) -> Fit:
    """A fit without the effect that later ones make needless.

    Its additional gain is no more than by noise or an error of their law.
    """
    found = []
    for e in chosen.effects:
        less = fitter.best([o for o in chosen.effects if o.keys != e.keys], [chosen.values])
        found.append((less.chi2, less, attrs.evolve(chosen, effects=(*less.effects, e))))
    _, less, last = min(found, key=lambda f: f[0])
    gain = gain_of(fitter, less, last)
    p = false_alarm_probability(less, seen, gain)
    return less if p >= FALSE_ALARM_RATE or of_the_law(less, last, base.chi2 - chosen.chi2) else chosen


def reselected(fitter: Fitter, seen: Sequence[Sensitivity], found: Selection) -> Selection:
    """Repeat a selection under the noise of another fitter; no effect is added.

    Each effect's p-value and rivals are computed again; an effect that is no longer significant is reported
    in `doubted`.
    """
    base = fitter.fit((), found.base.values)
    chosen = fitter.fit(found.chosen.effects, found.chosen.values)
    singles = tuple(sorted((fitter.fit(f.effects, f.values) for f in found.singles), key=cost))
    ps = [c.p_value for c in found.causes]
    doubted = found.doubted
    for e in chosen.effects:
        less = fitter.best([o for o in chosen.effects if o is not e], [chosen.values])
        own = attrs.evolve(chosen, effects=(*less.effects, e))
        gain = less.chi2 - chosen.chi2 - by_search(own) + by_search(less)
        p = false_alarm_probability(less, seen, gain - by_gauges(fitter, less, own))
        ps.append(p)
        if p >= FALSE_ALARM_RATE:
            doubted = (
                doubted or f"{e.name} gives no significant gain at the noise that remains with the causes"
            )
    table_base = tuple(dependence_table(fitter, base))
    doubted = doubted or doubts(fitter, table_base, base, chosen)
    effects = [f.effects[0] for f in singles]
    table = tuple(strict_table(fitter, chosen))
    causes = causes_of(fitter, effects, base, chosen, ps, [singles], not (doubted or structure(table)))
    again = Selection(base, chosen, causes, singles, table_base, table, found.p_best, doubted)
    if not of_some_tests(again):
        return again
    return _beside_the_step(again, [fitter.fit(f.effects, f.values) for f in found.wider if _of_specimens(f)])


def one_more(
    fitter: Fitter,
    seen: Sequence[Sensitivity],
    found: Selection,
    progress: Callable[[str], None] = lambda _: None,
) -> Selection:
    """Add to a selection that left structure the common effect that takes all of it; unchanged without such.

    For noise that was estimated again around the causes: an effect smaller than the noise assumed before may
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

    Unchanged without such an effect. The choice of the specimen also adds to chance: the false-positive rate
    is that of the whole library for every owner. Also returned: sensitivities of all.
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

    Unchanged except for `Selection.wider` if none does. most: number of effects that are fitted in addition
    to a seed.
    """
    singles, wider = found.singles, found.wider
    for seed in seeds:
        pool = plausible_first(hypotheses(fitter, [seed], effects, progress, most))
        if seed is found.base:
            wider, singles = tuple(pool), tuple(sorted([*singles, *pool], key=cost))
        if not pool or not _leads(found, pool, singles):
            continue
        best = pool[0]
        p = false_alarm_probability(seed, seen, gain_of(fitter, seed, best))
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

    Unchanged without such an effect. The false-positive probability is that of a spread at its bound of 0
    (half a chi squared of one degree), times the number of effects and groupings tried. No effect of one size
    for all may explain more: smooth structure may pass for slow noise. Rivals are other effects, or
    groupings, with as good a likelihood within their law's error (`LAW`).
    """
    fits = fits_among(fitter, found.base, progress)
    if not fits:
        return found
    found = attrs.evolve(found, wider=(*found.wider, *(f for _, f in fits)))
    gain, best = fits[0]
    if found.causes and gain < _gained(found) + RIVAL_DELTA_CHI2:
        return _beside_the_step(found, [f for _, f in fits])
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


def of_some_tests(found: Selection) -> bool:
    """Return True if a cause changes the scale of some tests, which their specimens may do as well."""
    return any(c.effect.whose and c.effect.name in OF_SOME for c in found.causes)


def _gained(found: Selection) -> float:
    """Gain of a selection's causes in -2 log L, as `fits_among` counts that of a spread."""
    return found.base.chi2 - found.chosen.chi2 - by_search(found.chosen)


def _beside_the_step(found: Selection, fits: Sequence[Fit]) -> Selection:
    """A selection whose change of some tests has as rivals what differs from specimen to specimen as well.

    Where no specimen was tested on both sides of a change, its specimens may be what changed: always a rival
    that leaves no more of the misfit.
    """
    found_too = [
        fit.effects[0].title
        for fit in fits
        if _of_specimens(fit) and fit.chi2 < found.chosen.chi2 + RIVAL_DELTA_CHI2
    ]
    causes = [
        attrs.evolve(c, rivals=tuple(dict.fromkeys((*c.rivals, *(t for t in found_too if _new(t, c))))))
        if c.effect.whose and c.effect.name in OF_SOME
        else c
        for c in found.causes
    ]
    return attrs.evolve(found, causes=tuple(causes))


def _of_specimens(fit: Fit) -> bool:
    return fit.effects[0].among == "specimen" and fit.names[0] in OF_SPECIMENS


def _new(title: str, cause: Cause) -> bool:
    """Return True if a difference among specimens is not that of one specimen, which is a rival already."""
    name = title.partition(" ")[0]
    return not any(t.startswith(f"{name}{OF}") for t in cause.rivals)


def further_owners(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """Add to a selection whose last effect is of one owner the same effect of every other owner who has it.

    Beside a large leak of one specimen a small one of another passes for slow noise and leaves no structure.
    An owner is added where it is `accepted` and no structure is left. Unchanged if no effect is of one
    specimen.
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
