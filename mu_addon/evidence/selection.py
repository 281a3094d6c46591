"""Selection of the effects that explain the data: rivals refitted, steps corrected for the library's size."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations
from typing import Any

import attrs
import numpy as np

from ..errors import MuError
from .curved_reading import curved_reading
from .effect import SLIP, STEP, Effect, Parameter
from .fit import PRIOR, Fit, Fitter, logarithmic
from .outliers import NAME as OUTLIER
from .record import KNOWN
from .residuals import Dependence, dependence_table, strict_table, structure, taken_by_scales
from .scatter import STATED, excess
from .sensitivity import ABSORBED, Sensitivity

Array = np.ndarray[Any, Any]

# False-positive probability of naming any effect of the library.
FALSE_ALARM_RATE = 5e-4
# Rivals within this delta chi squared (99 % for two parameters) cannot be told apart.
RIVAL_DELTA_CHI2 = 9.2
MOST_EFFECTS = 3
# Number of models that the next effect is added to: the best may be wrong while two effects pass for one.
SEEDS = 4
DRAWS = 20000
# Faults of one camera, which has one at most: two of them imitate many pairs of physical effects.
CAMERA = frozenset(("camera_scale", "camera_tilt", "camera_perspective", "lens_distortion"))
# Name of the test for a jump at one moment.
JUMP = "jump"
# Between the titles of two effects that are one rival together.
TOGETHER = " with "
# Error of the model's own mesh: present in every set of data, seen or not.
NUMERICS = "mesh_error"
# An effect rests on one experiment alone if this share of the information on it comes from there.
ALONE = 0.9
# Chi squared that an effect must take from a fit's residual, to first order, to be fitted beside it: a small
# part of what `FALSE_ALARM_RATE` asks for.
PROMISING = 4.0
# Share of the gain that it needs, to do as well as another model, which an effect must promise to be fitted.
HALF_WAY = 0.5
# Share of an effect's amplitude by which another valid law of its mechanism may differ from the library's: an
# effect with a smaller gain beside it is not named.
LAW = 0.05
# Ratio of the gain by scales of single tests to a first effect's, above which no second is tried.
ELSEWHERE = 4.0
# Number of a cause's rivals that are fitted by all laws of their mechanisms, and the share of the cause's
# gain that they need by their first law.
NEAREST, WORTH_LAWS = 3, 0.2
# Share of a misfit that one effect must take to be named although structure is left, and the factor by which
# any other one's residual must exceed its own.
MAINLY, APART = 0.99, 10.0
# Share from which the best explanation is reported as such, and the factor for any other's residual.
GRADED, CLEAR = 0.9, 4.0


@attrs.frozen(eq=False)
class Cause:
    """One effect of the chosen model.

    p_value: probability that noise alone lets any effect of the library gain as much. loss: rise of chi
    squared when the effect is taken away and the rest fitted anew. rivals: titles of effects whose fit in its
    place is not distinguishable, best first.
    """

    effect: Effect
    p_value: float
    loss: float
    rivals: tuple[str, ...]


@attrs.frozen(eq=False)
class Selection:
    """The base model, the chosen one, its causes, and the residuals of both.

    singles: the fit of every single effect, best first. p_best: p-value (a probability) of the best single
    effect. doubted: why a model was not accepted, else empty. table: `strict_table` of the chosen model's
    residual. table_base: `dependence_table` of the base model; by the strict tests where nothing is wrong.
    wider: fits of effects of one owner, or that differ among owners. excused: why structure that is left does
    not count, in words.
    """

    base: Fit
    chosen: Fit
    causes: tuple[Cause, ...]
    singles: tuple[Fit, ...]
    table_base: tuple[Dependence, ...]
    table: tuple[Dependence, ...]
    p_best: float
    doubted: str = ""
    wider: tuple[Fit, ...] = ()
    excused: str = ""

    @property
    def left(self) -> tuple[str, ...]:
        """Names of quantities that the residual of the chosen model still depends on (`structure`)."""
        return () if self.excused else structure(self.table)


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
        if not pool or _of_the_law(chosen, pool[0], taken):
            break
        p = false_alarm_probability(fitter, chosen, seen, gain_of(fitter, chosen, pool[0]))
        p_best = p if level == 0 else p_best
        # The best single effect may be neither of two that act together.
        if level and (p < FALSE_ALARM_RATE or structure(strict_table(fitter, chosen))):
            pool = hypotheses(fitter, _other_seeds(levels[-1]), effects, progress, known=pool)
            p = false_alarm_probability(fitter, chosen, seen, gain_of(fitter, chosen, pool[0]))
        if level == 0 and p >= FALSE_ALARM_RATE:
            pair = _hidden_pair(fitter, effects, seen, base, pool, progress)
            if pair is not None:
                p_best, chosen = pair
                ps, levels = [p_best, p_best], [pool, [chosen]]
            break
        if p >= FALSE_ALARM_RATE or _of_the_law(chosen, pool[0], taken):
            break
        if loss(fitter, chosen, pool[0]) <= 0.0:
            # It cannot be compared with earlier ones; its part is left as structure.
            doubted = "" if level else f"{pool[0].names[-1]} fits, but its leave-one-out prediction fails"
            break
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
    if len(causes) == 1 and CAMERA.intersection(chosen.names):
        pairs = pairs_for(fitter, seen, base, chosen, progress)
        causes = (attrs.evolve(causes[0], rivals=(*causes[0].rivals, *pairs)),)
    if chosen is base and accepted:
        table_base = table
        doubted = too_far(fitter, base)
    return Selection(base, chosen, causes, singles, table_base, table, p_best, doubted)


def too_far(fitter: Fitter, fit: Fit) -> str:
    """Excess of a fit's error over any noise that the readings show, in words; empty without one."""
    found = excess(fitter.record, fitter.record.values - fitter.predict(fit.values))
    if found is None:
        return ""
    return (
        f"the error of {found.where} is {found.error:.3g}, {found.times:.2g} times the largest noise that "
        + (f"its {STATED} allows" if found.by == STATED else "its readings allow")
    )


def pairs_for(
    fitter: Fitter,
    seen: Sequence[Sensitivity],
    base: Fit,
    chosen: Fit,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[str, ...]:
    """Pairs of effects that explain the data as well as a camera's fault alone does, as "one with the other".

    A camera's fault changes what each channel shows in proportion, which two physical effects can do together
    where neither does anything alone. The `SEEDS` pairs that take most to first order are fitted.
    """
    physical = [s for s in seen if s.worth_a_fit and s.effect.name not in CAMERA]
    columns = {id(s): s.column[: len(base.residual)] for s in physical}
    promised = []
    for one, other in combinations(physical, 2):
        if one.effect.name != other.effect.name:
            q = np.linalg.qr(np.stack([columns[id(one)], columns[id(other)]], axis=1))[0]
            promised.append((float(np.sum((q.T @ base.residual) ** 2)), one.effect, other.effect))
    promised.sort(key=lambda pair: -pair[0])
    found: dict[str, None] = {}
    for _, *pair in promised[:SEEDS]:
        progress(" and ".join(e.name for e in pair))
        starts = [{**base.values, **a, **b} for a in pair[0].starts() for b in pair[1].starts()]
        both = fitter.best(pair, starts)
        if both.chi2 + by_search(both) - chosen.chi2 - by_search(chosen) < RIVAL_DELTA_CHI2:
            found[TOGETHER.join(e.title for e in pair)] = None
    return tuple(found)


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
    raw = base.chi2 - singles[0].chi2 - _by_gauges(fitter, base, singles[0])
    if false_alarm_probability(fitter, base, seen, raw) >= FALSE_ALARM_RATE:
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

    Its gain beside them is no more than noise or an error of their law would give.
    """
    found = []
    for e in chosen.effects:
        less = fitter.best([o for o in chosen.effects if o.keys != e.keys], [chosen.values])
        found.append((less.chi2, less, attrs.evolve(chosen, effects=(*less.effects, e))))
    _, less, last = min(found, key=lambda f: f[0])
    gain = gain_of(fitter, less, last)
    p = false_alarm_probability(fitter, less, seen, gain)
    return less if p >= FALSE_ALARM_RATE or _of_the_law(less, last, base.chi2 - chosen.chi2) else chosen


def _of_the_law(less: Fit, more: Fit, taken: float) -> bool:
    """Return True if an effect gains as little beside others as an error of their own law would."""
    return more.names[-1] != NUMERICS and less.chi2 - more.chi2 < LAW**2 * taken


def refined(fitter: Fitter, fit: Fit, progress: Callable[[str], None] = lambda _: None) -> Fit:
    """A fit with a law of more freedom for one of its effects where that fits better; else itself.

    Better by `RIVAL_DELTA_CHI2`: the mechanism is the same, and its law is chosen by the data, anew with
    every effect added.
    """
    for law in fitter.simulator.refinements:
        for i, e in enumerate(fit.effects):
            if e.name != law.name or e.whose or e.keys == law.keys or set(e.kinds) != set(law.kinds):
                continue
            progress(e.name)
            others = [*fit.effects[:i], law, *fit.effects[i + 1 :]]
            other = fitter.best(others, [{**fit.values, **s} for s in law.starts()])
            if fit.chi2 - other.chi2 > RIVAL_DELTA_CHI2:
                fit = other
    return fit


def by_all_laws(
    fitter: Fitter,
    pool: Sequence[Fit],
    progress: Callable[[str], None] = lambda _: None,
    every: bool = False,
) -> list[Fit]:
    """A pool of fits, best first, with laws of more freedom where they fit better (`refined`), ranked anew.

    Refined are the first and, where structure is left with it or it lies at a bound, or for `every`, the next
    `SEEDS` mechanisms that have such laws: the right mechanism may gain little by its first law.
    """
    found = [refined(fitter, pool[0], progress), *pool[1:]]
    if not every and not at_a_bound(found[0]) and not structure(strict_table(fitter, found[0])):
        return found
    lawful = {law.name for law in fitter.simulator.refinements}
    tried = {pool[0].names}
    for i, f in enumerate(pool):
        if len(tried) > SEEDS:
            break
        if f.names not in tried and lawful.intersection(f.names):
            tried.add(f.names)
            found[i] = refined(fitter, f, progress)
    return ranked(found)


def reselected(fitter: Fitter, seen: Sequence[Sensitivity], found: Selection) -> Selection:
    """Repeat a selection under the noise of another fitter; no effect is added.

    Each effect's p-value is computed again, and rivals anew; an effect no longer significant is reported in
    `doubted`.
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
        p = false_alarm_probability(fitter, less, seen, gain - _by_gauges(fitter, less, own))
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
    return Selection(base, chosen, causes, singles, table_base, table, found.p_best, doubted)


def share_taken(fitter: Fitter, base: Fit, fit: Fit) -> float:
    """Share of the base model's misfit that another model takes: of chi squared beyond noise."""
    noise = float(len(fitter.record))
    return 1.0 - max(fit.chi2 - noise, 0.0) / max(base.chi2 - noise, 1.0)


def mainly(fitter: Fitter, found: Selection) -> Selection | None:
    """Selection of the effects that take most of a misfit, though structure is left; None without.

    Their law may be another than the library's. Several: see `_mainly_several`. A single one, of all, of one
    owner or among owners, must take `GRADED` of the misfit, have no value at a bound but its null, and do
    better than a step change; one of all must predict left-out experiments better and rest on no single
    experiment. Others that leave less than `APART` times as much, or `CLEAR` times where it takes less than
    `MAINLY`, are its rivals; one that takes `MAINLY` has none that take less.
    """
    if _mainly_several(fitter, found):
        return found
    less = _without_the_least(fitter, found)
    if less is not None and _mainly_several(fitter, less):
        return less
    pool = [f for f in ranked([*found.singles, *found.wider]) if not at_a_bound(f)]
    if not pool:
        return None
    best, base = pool[0], found.base
    left = max(1.0 - share_taken(fitter, base, best), 1e-6)
    sure = left <= 1.0 - MAINLY
    if left > 1.0 - GRADED or base.chi2 < 2.0 * len(fitter.record):
        # Shares are meaningless for a misfit below the noise.
        return None
    others = (
        (f.effects[0].title, 1.0 - share_taken(fitter, base, f))
        for f in [*found.singles, *found.wider]
        if f.effects[0].title != best.effects[0].title and (f.effects[0].whose or f.names != best.names)
    )
    near = nearest(others, (APART if sure else CLEAR) * left)
    of_all = any(best is f for f in found.singles)
    if of_all and near and (not sure or any(own > 1.0 - MAINLY for own in near.values())):
        return None
    table = tuple(strict_table(fitter, best))
    if of_all and near and set(structure(table)) - {OUTLIER}:
        # Effects that leave the same moment or the same waves are alike in what they are not.
        return None
    step = best.names[0] == STEP
    if not (of_all or sure or step or any(n.startswith(STEP) for n in near)) and JUMP in structure(table):
        # What changed in its owner at one moment is none of these.
        return None
    if of_all:
        shares = share_by_experiment(fitter, best)
        if (len(shares) > 1 and max(shares.values()) > ALONE) or loss(fitter, base, best) <= 0.0:
            return None
    if (not step and sudden(found.table_base, base, best)) or curved_reading(fitter, base, best):
        return None
    gain, dof = base.chi2 - best.chi2 - by_search(best), len(best.keys) - len(base.keys)
    p = by_count(gain, dof, len(found.singles) + len(found.wider))
    cause = Cause(best.effects[0], p, base.chi2 - best.chi2, tuple(near))
    return attrs.evolve(found, chosen=best, causes=(cause,), table=table, doubted="", p_best=p)


def by_count(gain: float, dof: int, tried: float) -> float:
    """Probability that noise alone lets the best of so many fits gain as much, by Bonferroni's bound.

    gain: in chi squared of `dof` degrees of freedom.
    """
    from scipy.stats import chi2

    return min(1.0, tried * float(chi2.sf(max(gain, 0.0), dof)))


def nearest(each: Iterable[tuple[str, float]], within: float) -> dict[str, float]:
    """Rivals by title, the nearest first: those of which a fit lies at a distance below a limit."""
    least: dict[str, float] = {}
    for title, distance in each:
        if distance < within:
            least[title] = min(distance, least.get(title, distance))
    return dict(sorted(least.items(), key=lambda one: one[1]))


def _with_rivals(fitter: Fitter, found: Selection) -> Selection:
    """The selection with the rivals of its causes, which are not sought where it is not accepted."""
    effects, ps = [f.effects[0] for f in found.singles], [c.p_value for c in found.causes]
    causes = causes_of(fitter, effects, found.base, found.chosen, ps, [found.singles])
    return attrs.evolve(found, causes=causes)


def _without_the_least(fitter: Fitter, found: Selection) -> Selection | None:
    """A selection of three causes or more without the least if that has rivals; else None.

    Such a cause compensates errors of the others' laws, and can push them to bounds that they do not need.
    None too where the residual without it is too large for `_mainly_several`.
    """
    if len(found.causes) < 3:
        return None
    least = found.causes[-1].effect
    chosen = fitter.best([e for e in found.chosen.effects if e.keys != least.keys], [found.chosen.values])
    ps = [c.p_value for c in found.causes[:-1]]
    causes = causes_of(fitter, (), found.base, chosen, ps, [found.singles], accepted=False)
    less = attrs.evolve(found, chosen=chosen, causes=causes)
    if not _plain(fitter, less) or not _with_rivals(fitter, found).causes[-1].rivals:
        return None
    doubted = doubts(fitter, found.table_base, found.base, chosen)
    return attrs.evolve(less, table=tuple(strict_table(fitter, chosen)), doubted=doubted)


def _plain(fitter: Fitter, found: Selection) -> bool:
    """Return True if several causes leave less than 1 - `GRADED` of each cause's loss."""
    left = found.chosen.chi2 - len(fitter.record)
    return len(found.causes) > 1 and all(left <= (1.0 - GRADED) * c.loss for c in found.causes)


def _mainly_several(fitter: Fitter, found: Selection) -> bool:
    """Return True if several causes take most of a misfit (`_plain`), though structure is left.

    No other effect in the place of one comes within `CLEAR` times the residual. None has a value at a bound
    or rests on a single experiment.
    """
    base, chosen = found.base, found.chosen
    if found.doubted or at_a_bound(chosen) or not _plain(fitter, found):
        return False
    if any(c.rivals for c in _with_rivals(fitter, found).causes):
        return False
    left, taken = max(chosen.chi2 - len(fitter.record), 0.0), base.chi2 - chosen.chi2
    for c in found.causes:
        # So near a rival would have been reported (`causes_of`).
        near = max(RIVAL_DELTA_CHI2, LAW**2 * (taken - c.loss))
        if CLEAR * left > near:
            rivals = promising_rivals(fitter, chosen, c.effect, _not_chosen(found))
            if any(f.chi2 - chosen.chi2 < CLEAR * left for f in rivals):
                return False
        last = fitter.fit([*(e for e in chosen.effects if e is not c.effect), c.effect], chosen.values)
        shares = share_by_experiment(fitter, last)
        if len(shares) > 1 and max(shares.values()) > ALONE:
            return False
    return True


def at_a_bound(fit: Fit) -> bool:
    """Return True if a fitted value of an effect lies at a bound that is not its null."""
    return any(
        _bounded(p, fit.values[key]) for e in fit.effects for key, p in zip(e.keys, e.parameters, strict=True)
    )


def _bounded(p: Parameter, value: float) -> bool:
    if not p.plausible[0] <= value <= p.plausible[1]:
        # An implausible value is no cause, though a fit may reach it.
        return True
    ends = [b for b in (p.low, p.high) if b != p.null]
    if logarithmic(p):
        # Over decades the range's own size is near the low end's neighbours, too.
        near = 1e-3 * math.log(p.high / p.low)
        return any(abs(math.log(value / b)) < near for b in ends)
    return any(abs(value - b) < 1e-3 * (p.high - p.low) for b in ends)


def doubts(
    fitter: Fitter, table_base: Sequence[Dependence], base: Fit, chosen: Fit, margin: float = 0.0
) -> str:
    """Reason to doubt a fit's effects although they fit, in words; empty without one.

    margin: see `sudden`.
    """
    return (
        sudden(table_base, base, chosen, margin) or _too_large(chosen) or curved_reading(fitter, base, chosen)
    )


def _too_large(chosen: Fit) -> str:
    """Effect whose size would exceed its bound, in words; empty if there is none."""
    for e in chosen.effects:
        if _bounded(e.parameters[0], chosen.values[e.keys[0]]):
            return f"{e.name} would have to be larger than its bound allows"
    return ""


def sudden(table: Sequence[Dependence], base: Fit, chosen: Fit, margin: float = 0.0) -> str:
    """Sudden change that explains more than the chosen effects, in words; empty if there is none.

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


def cost(fit: Fit) -> float:
    """Akaike's criterion plus `by_search`: of models that fit alike the one with fewer parameters leads."""
    return fit.chi2 + 2.0 * len(fit.keys) + by_search(fit)


def by_search(fit: Fit) -> float:
    """Chi squared that noise gives a model's effects by the search among alternatives for their starts.

    The best of m chi squareds exceeds g with at most m times the probability of one (Bonferroni), which in
    the tail falls as exp(-g/2): m alternatives are worth 2 ln m.
    """
    return sum(2.0 * math.log(e.tried) for e in fit.effects)


def ranked(fits: Iterable[Fit]) -> list[Fit]:
    """Fits by `cost`, best first, without those of models that have no prediction."""
    return sorted((f for f in fits if math.isfinite(f.chi2)), key=cost)


def beside(fitter: Fitter, others: Sequence[Effect], effect: Effect, values: Mapping[str, float]) -> Fit:
    """The best fit of an effect beside others, from each of its starts and the others' values by key."""
    return fitter.best([*others, effect], [{**values, **start} for start in effect.starts()])


def hypotheses(
    fitter: Fitter,
    seeds: Sequence[Fit],
    effects: Sequence[Effect],
    progress: Callable[[str], None] = lambda _: None,
    most: int | None = None,
    known: Sequence[Fit] = (),
) -> list[Fit]:
    """Each seed with one of some effects more, each set of effects once, best first.

    Fitted are effects that promise more than `PROMISING` beside a seed, the most promising first; of one
    mechanism and of a camera's faults a model has one. most: of the fits of a seed; all where it is None.
    known: fits of others, best first, with which they are ranked; an effect that promises less than
    `HALF_WAY` of the way to the first of them is not fitted.
    """
    found = {frozenset(e.keys for e in fit.effects): fit for fit in known}
    reach = known[0].chi2 if known else math.inf
    for seed in seeds:
        promised = []
        for e in effects:
            every = frozenset((*(o.keys for o in seed.effects), e.keys))
            twice = e.name in seed.names or (e.name in CAMERA and CAMERA.intersection(seed.names))
            enough = max(PROMISING, HALF_WAY * (seed.chi2 - reach))
            if not twice and every not in found and (gain := promise(fitter, seed, e)) > enough:
                promised.append((gain, every, e))
        for _, every, e in sorted(promised, key=lambda one: -one[0])[:most]:
            progress(" and ".join((*seed.names, e.name)))
            found[every] = beside(fitter, seed.effects, e, seed.values)
    return ranked(found.values())


def _other_seeds(pool: Sequence[Fit]) -> list[Fit]:
    """Seeds besides the first of a pool: the best of each other set of mechanisms, `SEEDS` with the first.

    Also as many without a camera's fault: these lead where each of two physical effects does little alone.
    """
    best: dict[frozenset[str], Fit] = {}
    for f in pool:
        best.setdefault(frozenset(f.names), f)
    others = list(best.values())[1:]
    physical = [f for f in best.values() if not CAMERA.intersection(f.names)]
    return [f for f in others if f in others[: SEEDS - 1] or f in physical[:SEEDS]]


def promise(fitter: Fitter, fit: Fit, effect: Effect) -> float:
    """Chi squared that an effect, at any of its starts or in the small, takes from a fit's residual.

    To first order. A fit takes many predictions, and is worth its time above `PROMISING`.
    """
    size = effect.parameters[0]
    plain = fitter.predict(fit.values)
    moved = [*effect.starts(), *({**s, effect.keys[0]: size.null + size.step} for s in effect.shapes())]
    tried = (fitter.possible({**fit.values, **m}) for m in moved)
    changes = [found - plain for found in tried if found is not None]
    if not changes:
        return 0.0
    u = np.stack(changes, axis=1)
    u = fitter.project(u)
    q = np.linalg.qr(fit.jacobian)[0]
    before = np.linalg.norm(u, axis=0)
    u -= q @ (q.T @ u)
    length = np.linalg.norm(u, axis=0)
    resolved = length > ABSORBED * np.maximum(before, 1e-300)
    along = (u.T @ fit.residual)[resolved] / length[resolved]
    return float(np.max(along**2, initial=0.0))


def false_alarm_probability(fitter: Fitter, fit: Fit, seen: Sequence[Sensitivity], gain: float) -> float:
    """Probability that noise alone lets some effect of the library gain as much on top of a fit.

    The parametric bootstrap of the linearised library: gains are squares of the noise along each effect's
    signature, one-sided where a bound makes it so; far in the tail, as many independent squares as fit the
    bootstrap's hundredth.
    """
    from scipy.stats import chi2

    columns, one_sided = [], []
    for s in seen:
        if s.worth_a_fit and s.effect.name not in fit.names:
            columns.append(s.column / np.linalg.norm(s.column))
            p = s.effect.parameters[0]
            one_sided.append(p.null in (p.low, p.high))
    if not columns:
        return 1.0
    u = np.stack(columns, axis=1)
    # Prior knowledge of nuisances is uncertain like the data, and may imitate effects too.
    q = np.vstack([fit.jacobian, fit.prior])
    u = np.vstack([u, np.zeros((len(q) - len(u), u.shape[1]))])
    q = np.linalg.qr(q)[0] if q.shape[1] else q
    u -= q @ (q.T @ u)
    length = np.linalg.norm(u, axis=0)
    u = u[:, length > ABSORBED] / length[length > ABSORBED]
    sides = np.array(one_sided)[length > ABSORBED]
    if not len(sides):
        return 1.0
    values, vectors = np.linalg.eigh(u.T @ u)
    half = vectors * np.sqrt(np.clip(values, 0.0, None))
    z = np.random.default_rng(0).normal(size=(DRAWS, len(half))) @ half.T
    most = np.max(np.where(sides, np.maximum(z, 0.0), np.abs(z)) ** 2, axis=1)
    more = int((most >= gain).sum())
    if more >= 50:
        return more / DRAWS
    tail = float(np.quantile(most, 0.99))
    alike = 0.01 / float(chi2.sf(tail, 1))
    return min(1.0, max(alike, 1.0) * float(chi2.sf(max(gain, 0.0), 1)))


def gain_of(fitter: Fitter, less: Fit, more: Fit) -> float:
    """Twice the log likelihood gained by an effect: the least under one noise and under each one's own.

    Without the second, slow noise estimated too small would pass for a cause; without the first, noise
    swollen by a cause would hide it. The gains by gauges' noise alone and by a search for its starts
    (`by_search`) are subtracted.
    """
    searched = by_search(more) - by_search(less)
    gain = less.chi2 - more.chi2 - searched
    if gain < RIVAL_DELTA_CHI2:
        return gain
    own = []
    for fit in (less, more):
        under, refitted = fitter.under_its_own_noise(fit)
        own.append(sum(under.deviance(refitted).values()))
    return min(gain, own[0] - own[1] - searched) - _by_gauges(fitter, less, more)


def _by_gauges(fitter: Fitter, less: Fit, more: Fit) -> float:
    """Gain of a model's last effect by smoothing the gauges' noise, which the right model cannot have.

    On data that the model without it predicts, driven by other readings of the same noise. It is doubled,
    since that is one draw, and of readings that were denoised before.
    """
    other = fitter.driven_again(less) if math.isfinite(less.chi2) else None
    if other is None:
        return 0.0
    without = other.best(less.effects, [less.values])
    if not math.isfinite(without.chi2):
        return math.inf
    starts = [more.values, *({**less.values, **s} for s in more.effects[-1].starts())]
    return 2.0 * max(without.chi2 - other.best(more.effects, starts).chi2, 0.0)


def loss(fitter: Fitter, less: Fit, more: Fit) -> float:
    """Rise in chi squared of experiments left out in turn, of a model over one with an effect more.

    An experiment with most of the information on the effects is left out in parts. Prior knowledge counts as
    an experiment. Of an effect that differs among owners every second quarter of the records is left out, as
    each owner's value is in its own records alone.
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

    Rivals are also effects beside the others whose residual is within their law's error (`LAW`). Those of
    several effects that are not accepted are not sought: that takes as long as the selection.
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
        near = max(RIVAL_DELTA_CHI2, LAW**2 * (base.chi2 - less.chi2))
        tried = _with_their_laws(fitter, chosen, less, tried)
        # A rival's gain by its search is no fit.
        spent = chosen.chi2 + by_search(chosen)
        rivals = nearest(((f.effects[-1].title, f.chi2 + by_search(f) - spent) for f in tried), near)
        if NUMERICS not in rivals:
            # Where the mesh alone replaces it, anything beside the mesh would.
            rivals |= _by_numerics(
                fitter, effects, chosen, [f for f in tried if f.effects[-1].title not in rivals]
            )
        found.append(Cause(e, max(ps), less.chi2 - chosen.chi2, tuple(nearest(rivals.items(), math.inf))))
    return tuple(sorted(found, key=lambda c: -c.loss))


def promising_rivals(
    fitter: Fitter,
    chosen: Fit,
    cause: Effect,
    effects: Sequence[Effect],
    progress: Callable[[str], None] = lambda _: None,
) -> list[Fit]:
    """Fits of those of some effects in the place of a cause that promise half of what it takes, or more.

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
        fits = promising_rivals(fitter, found.chosen, c.effect, _not_chosen(found), progress)
        titles = nearest(((f.effects[-1].title, cost(f) - cost(found.chosen)) for f in fits), near)
        causes.append(attrs.evolve(c, rivals=tuple(dict.fromkeys((*c.rivals, *titles)))))
    return attrs.evolve(found, causes=tuple(causes))


def _not_chosen(found: Selection) -> list[Effect]:
    """Effects that were fitted alone, of mechanisms that the chosen model has not."""
    return [f.effects[0] for f in found.singles if f.effects[0].name not in found.chosen.names]


def _with_their_laws(fitter: Fitter, chosen: Fit, less: Fit, rivals: Sequence[Fit]) -> list[Fit]:
    """Rivals of one cause, the nearest of them with laws of more freedom where those fit better.

    The cause's own law was chosen likewise. A rival must first take `WORTH_LAWS` of the cause's gain.
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


def _by_numerics(
    fitter: Fitter, effects: Sequence[Effect], chosen: Fit, tried: Sequence[Fit]
) -> dict[str, float]:
    """Rivals by title that differ from the chosen model only by the error of its mesh, with the difference.

    No mesh is exact, and its error differs with and without the effect. So an effect has as a rival any that
    explains the data as well once either has a free size of that error.
    """
    mesh = next((e for e in effects if e.name == NUMERICS), None)
    if mesh is None or NUMERICS in chosen.names or not tried:
        return {}

    def meshed(f: Fit) -> Fit:
        return beside(fitter, f.effects, mesh, f.values)

    reference, found = meshed(chosen), {}
    for f in tried:
        if f.names[-1] != NUMERICS and promise(fitter, f, mesh) > PROMISING:
            other = meshed(f)
            searched = by_search(other) - by_search(reference)
            if other.chi2 - reference.chi2 + searched < RIVAL_DELTA_CHI2:
                found[f.effects[-1].title] = other.chi2 - reference.chi2 + searched
    return found


def interval(fitter: Fitter, fit: Fit, key: str, rise: float = 3.84) -> tuple[float, float]:
    """Confidence interval (low, high) of a fitted value, in its parameter's unit, by profile likelihood.

    The ends are where chi squared, all else fitted anew, has risen by `rise` (3.84: 95 %), or the parameter's
    bounds if those come first or the value has no finite standard deviation.
    """
    p = next(
        (p for e in fit.effects for name, p in zip(e.keys, e.parameters, strict=True) if name == key),
        None,
    ) or next(p for p in fitter.curved if p.name == key)
    log = logarithmic(p)
    centre = math.log(fit.values[key]) if log else fit.values[key]
    scale = fit.sd(key) / (fit.values[key] if log else 1.0)
    if not (math.isfinite(scale) and scale > 0.0):
        return p.low, p.high
    found = []
    for sign, bound in ((-1.0, p.low), (1.0, p.high)):
        limit = math.log(bound) if log else bound
        inner, outer, value = 0.0, math.inf, math.sqrt(rise)
        for _ in range(7):
            at = centre + sign * value * scale
            if (limit - at) * sign <= 0.0:
                at, value = limit, abs(limit - centre) / scale
            fixed = {key: math.exp(at) if log else at}
            try:
                risen = fitter.fit(fit.effects, fit.values, fixed).chi2 - fit.chi2
            except MuError:
                # Without a prediction it cannot be the value.
                risen = math.inf
            if abs(risen - rise) < 0.2 or (risen < rise and at == limit):
                break
            inner, outer = (value, outer) if risen < rise else (inner, value)
            grown = value * min(math.sqrt(rise / max(risen, 0.1)), 3.0)
            value = grown if inner < grown < outer else 0.5 * (inner + min(outer, 4.0 * inner + value))
        else:
            at = centre + sign * value * scale
        found.append(bound if at == limit else math.exp(at) if log else at)
    return found[0], found[1]
