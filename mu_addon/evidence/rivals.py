"""Rivals of a cause: effects that explain the data as well in its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import combinations

import attrs
import numpy as np

from .effect import CURVED_CELL, FORCE_SCALE, Effect
from .effects import CAMERA, GRIPS
from .effects.declaration import MACHINE
from .fit import Fit, Fitter
from .found_causes import (
    BEYOND,
    LAW,
    RIVAL_DELTA_CHI2,
    TOGETHER,
    Cause,
    Selection,
    not_distinguished,
)
from .hypotheses import (
    HALF_WAY,
    SEEDS,
    beside,
    by_search,
    cost,
    plausible_first,
    promise,
    ranked,
    refined,
)
from .owned import owned_effects
from .plausibility import at_a_bound, widened
from .residual_tests.table import strict_table
from .sensitivity import ABSORBED, Sensitivity

# Number of a cause's rivals that are fitted by all laws of their mechanisms, and the share of the cause's
# gain that they need by their first law.
NEAREST, WORTH_LAWS = 3, 0.2


def causes_of(
    fitter: Fitter,
    effects: Sequence[Effect],
    base: Fit,
    chosen: Fit,
    ps: Sequence[float],
    levels: Sequence[Sequence[Fit]],
    accepted: bool = True,
) -> tuple[Cause, ...]:
    """The chosen effects, the most needed first, each with its rivals.

    Rivals are also effects in addition to the others whose residual is within their law's error (`LAW`).
    Those of several effects that are not accepted are not sought: that takes as long as the selection.
    """
    found = []
    for e in chosen.effects:
        others = [o for o in chosen.effects if o.keys != e.keys]
        tried = [f for f in levels[0] if f.names != chosen.names]
        if others:
            tried = [
                beside(fitter, others, a, chosen.values)
                for a in effects
                if accepted and a.name not in chosen.names
            ]
        less = fitter.best(others, [chosen.values])
        near = max(not_distinguished(chosen.chi2, len(fitter.record)), LAW**2 * (base.chi2 - less.chi2))
        tried = _with_their_laws(fitter, chosen, less, tried)
        # A rival's gain by its search is no fit.
        spent = chosen.chi2 + by_search(chosen)
        rivals = nearest(((f.effects[-1].title, f.chi2 + by_search(f) - spent) for f in tried), near)
        found.append(Cause(e, max(ps), less.chi2 - chosen.chi2, tuple(rivals)))
    return tuple(sorted(found, key=lambda c: -c.loss))


def promising_rivals(
    fitter: Fitter,
    chosen: Fit,
    cause: Effect,
    effects: Sequence[Effect],
    progress: Callable[[str], None] = lambda _: None,
) -> list[Fit]:
    """Fits of effects in the place of a cause, of those that promise at least half of its gain.

    Each is tried that is not in the chosen model; the best comes first.
    """
    others = [e for e in chosen.effects if e.keys != cause.keys]
    less, known = fitter.best(others, [chosen.values]), {e.keys for e in chosen.effects}
    enough = less.chi2 - chosen.chi2 - RIVAL_DELTA_CHI2
    found = []
    for e in effects:
        if e.keys not in known and promise(fitter, less, e) >= HALF_WAY * enough:
            progress(e.title)
            found.append(beside(fitter, others, e, chosen.values))
    return ranked(found)


def with_promising_rivals(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """A selection that is not accepted, its several causes with the rivals that `promising_rivals` finds."""
    causes = []
    for c in found.causes:
        near = max(RIVAL_DELTA_CHI2, LAW**2 * (found.base.chi2 - found.chosen.chi2 - c.loss))
        fits = promising_rivals(fitter, found.chosen, c.effect, not_chosen(found), progress)
        titles = nearest(((f.effects[-1].title, cost(f) - cost(found.chosen)) for f in fits), near)
        causes.append(attrs.evolve(c, rivals=tuple(dict.fromkeys((*c.rivals, *titles)))))
    return attrs.evolve(found, causes=tuple(causes))


def with_rivals(fitter: Fitter, found: Selection) -> Selection:
    """The selection with the rivals of its causes, which are not sought where it is not accepted."""
    effects, ps = [f.effects[0] for f in found.singles], [c.p_value for c in found.causes]
    causes = causes_of(fitter, effects, found.base, found.chosen, ps, [found.singles])
    return attrs.evolve(found, causes=causes)


def coinciding(
    fitter: Fitter, found: Selection, progress: Callable[[str], None] = lambda _: None
) -> Selection:
    """Add, as rivals of a selection's causes, effects that scale the same experiments' force equally well.

    If one specimen was tested along x, or all fast tests came last, a cause that acts along x, or by rate,
    may also be that specimen's entered height, or a change before those tests. Each is fitted in place of
    each cause, and is a rival within `RIVAL_DELTA_CHI2`.
    """
    chosen = found.chosen
    scales = [e for e in fitter.simulator.effects if e.name == FORCE_SCALE]
    # A stated standard deviation includes the spread of specimens.
    single = [e for e in fitter.record.experiments if "stress_sd_kPa" not in e.columns]
    owned = [e for e in owned_effects(scales, single) if set(e.kinds) & set(MACHINE)]
    if not owned or not found.causes or found.left or found.doubted:
        return found
    found = _as_one(fitter, found, owned, progress)
    chosen, causes = found.chosen, []
    for c in found.causes:
        scaled = owned if set(c.effect.kinds) & set(MACHINE) else []
        fits = promising_rivals(fitter, chosen, c.effect, scaled, progress)
        near = plausible_first([f for f in fits if cost(f) - cost(chosen) < margin(fitter, found)])
        if c.effect.among and near and cost(near[0]) < cost(chosen) and not at_a_bound(near[0]):
            # One size for some replaces a size of each.
            found, near = attrs.evolve(found, chosen=near[0]), near[1:]
            c = Cause(found.chosen.effects[-1], c.p_value, c.loss, (c.effect.title, *c.rivals))
        rivals = dict.fromkeys((*c.rivals, *(f.effects[-1].title for f in near)))
        causes.append(attrs.evolve(c, rivals=tuple(rivals)))
    return attrs.evolve(found, causes=tuple(causes))


def beyond_bounds(
    fitter: Fitter,
    found: Selection,
    seen: Sequence[Sensitivity],
    progress: Callable[[str], None] = lambda _: None,
) -> Selection:
    """The selection of causes without rivals, with those that a bound of their own alone excludes.

    A bound is prior knowledge, no reason why a name has no rival. An effect whose fit ends at one, or that is
    too small within it to be seen, is fitted in place of each cause with that bound farther away
    (`plausibility.widened`).
    """
    ended = [(f.effects[0], f.values) for f in (*found.singles, *found.wider) if len(f.effects) == 1]
    for s in seen:
        size, key = s.effect.parameters[0], s.effect.keys[0]
        if s.unabsorbed > ABSORBED and not s.worth_a_fit:
            ended += [(s.effect, {**s.shape, key: end}) for end in {size.low, size.high} - {size.null}]
    chosen, causes = found.chosen, []
    others = [(e, values) for e, values in ended if not e.among and e.name not in chosen.names]
    wider = [w for e, values in others if (w := widened(e, values))]
    for c in found.causes:
        fits = promising_rivals(fitter, chosen, c.effect, wider, progress)
        apart = ((f.effects[-1].title + BEYOND, cost(f) - cost(chosen)) for f in fits)
        causes.append(attrs.evolve(c, rivals=tuple(nearest(apart, margin(fitter, found)))))
    return attrs.evolve(found, causes=tuple(causes))


def _as_one(
    fitter: Fitter, found: Selection, scales: Sequence[Effect], progress: Callable[[str], None]
) -> Selection:
    """A selection of several causes as one where a scale of some tests alone explains as much; else itself.

    Two effects that share a scale between them have the same rivals, and are no two causes.
    """
    base, chosen = found.base, found.chosen
    if len(found.causes) < 2:
        return found
    enough = HALF_WAY * (base.chi2 - chosen.chi2)
    tried = [e for e in scales if promise(fitter, base, e) > enough]
    for e in tried:
        progress(e.title)
    alone = ranked(beside(fitter, (), e, base.values) for e in tried)
    near = plausible_first([f for f in alone if cost(f) - cost(chosen) < margin(fitter, found)])
    if not near or at_a_bound(near[0]):
        return found
    titles = [f.effects[0].title for f in near[1:]]
    shared = [set(c.rivals) for c in found.causes]
    titles += [t for t in found.causes[0].rivals if all(t in own for own in shared)]
    one = near[0]
    titles = [t for t in dict.fromkeys(titles) if t != one.effects[0].title]
    cause = Cause(one.effects[0], max(c.p_value for c in found.causes), base.chi2 - one.chi2, tuple(titles))
    return attrs.evolve(found, chosen=one, causes=(cause,), table=tuple(strict_table(fitter, one)))


def margin(fitter: Fitter, found: Selection) -> float:
    """Chi squared within which an effect is not distinguished from a cause.

    `RIVAL_DELTA_CHI2`, or `UNKNOWN` of what the causes leave beyond noise: what no law explains may as well
    be part of either.
    """
    return not_distinguished(found.chosen.chi2, len(fitter.record))


def pairs_for(
    fitter: Fitter,
    seen: Sequence[Sensitivity],
    base: Fit,
    chosen: Fit,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[str, ...]:
    """Pairs of effects that explain the data as well as an instrument's fault does, as "one with the other".

    A camera's fault scales each channel, and a load cell's curve is that of grips and specimen. Two physical
    effects can do that together although neither does it alone. The `SEEDS` pairs that take most to first
    order are fitted; beside a load cell's curve one of them is of the grips.
    """
    physical = [s for s in seen if s.worth_a_fit and s.effect.name not in (*CAMERA, *chosen.names)]
    of_grips = CURVED_CELL in chosen.names
    columns = {id(s): s.column[: len(base.residual)] for s in physical}
    promised = []
    for one, other in combinations(physical, 2):
        names = {one.effect.name, other.effect.name}
        if len(names) == 2 and (names & GRIPS or not of_grips):
            q = np.linalg.qr(np.stack([columns[id(one)], columns[id(other)]], axis=1))[0]
            promised.append((float(np.sum((q.T @ base.residual) ** 2)), one.effect, other.effect))
    promised.sort(key=lambda pair: -pair[0])
    found: dict[str, None] = {}
    for _, *pair in promised[:SEEDS]:
        progress(" and ".join(e.name for e in pair))
        starts = [{**base.values, **a, **b} for a in pair[0].starts() for b in pair[1].starts()]
        both = fitter.best(pair, starts)
        if cost(both) - cost(chosen) < not_distinguished(chosen.chi2, len(fitter.record)):
            found[TOGETHER.join(e.title for e in pair)] = None
    return tuple(found)


def nearest(each: Iterable[tuple[str, float]], within: float) -> dict[str, float]:
    """Rivals by title, the nearest first: effects with a fit at a distance below a limit."""
    least: dict[str, float] = {}
    for title, distance in each:
        if distance < within:
            least[title] = min(distance, least.get(title, distance))
    return dict(sorted(least.items(), key=lambda one: one[1]))


def not_chosen(found: Selection) -> list[Effect]:
    """Effects that were fitted alone, of mechanisms that the chosen model has not."""
    return [f.effects[0] for f in found.singles if f.effects[0].name not in found.chosen.names]


def _with_their_laws(fitter: Fitter, chosen: Fit, less: Fit, rivals: Sequence[Fit]) -> list[Fit]:
    """Rivals of one cause, the nearest of them with laws of more freedom where those fit better.

    The cause's law was chosen in the same way. A rival must first take `WORTH_LAWS` of the cause's gain.
    """
    found = ranked(rivals)
    reach = chosen.chi2 + (1.0 - WORTH_LAWS) * (less.chi2 - chosen.chi2)
    lawful = {law.name for law in fitter.simulator.refinements}
    names: dict[str, int] = {}
    for i, f in enumerate(found):
        name = f.effects[-1].name
        if name in lawful and name not in names and len(names) < NEAREST and f.chi2 < reach:
            names[name] = i
    for i in names.values():
        found[i] = refined(fitter, found[i])
    return found
