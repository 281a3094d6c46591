"""Hypotheses: models with one effect more, the most promising fitted, the best first."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from .effect import Effect
from .effects import CAMERA
from .fit import Fit, Fitter
from .found_causes import RIVAL_DELTA_CHI2
from .plausibility import at_a_bound
from .residual_tests.table import strict_table, structure
from .sensitivity import ABSORBED

# Number of models that the next effect is added to: the best may be wrong while two effects pass for one.
SEEDS = 4
# Chi squared that an effect must take from a fit's residual, to first order, to be fitted beside it: a small
# part of what `FALSE_ALARM_RATE` asks for.
PROMISING = 4.0
# Share of the gain that it needs, to do as well as another model, which an effect must promise to be fitted.
HALF_WAY = 0.5


def hypotheses(
    fitter: Fitter,
    seeds: Sequence[Fit],
    effects: Sequence[Effect],
    progress: Callable[[str], None] = lambda _: None,
    most: int | None = None,
    known: Sequence[Fit] = (),
) -> list[Fit]:
    """Each seed with one of some effects more, each set of effects once, best first.

    Effects that promise more than `PROMISING` beside a seed are fitted, the most promising first. A model has
    one effect of a mechanism and one of a camera's faults. most: number of fits of a seed, None for all.
    known: fits of others, best first, with which they are ranked; an effect that promises less than
    `HALF_WAY` of the gain to the first of them is not fitted.
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


def other_seeds(pool: Sequence[Fit]) -> list[Fit]:
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


def beside(fitter: Fitter, others: Sequence[Effect], effect: Effect, values: Mapping[str, float]) -> Fit:
    """The best fit of an effect added to others, from each of its starts and the others' values by key."""
    return fitter.best([*others, effect], [{**values, **start} for start in effect.starts()])


def ranked(fits: Iterable[Fit]) -> list[Fit]:
    """Fits by `cost`, best first, without those of models that have no prediction."""
    return sorted((f for f in fits if math.isfinite(f.chi2)), key=cost)


def plausible_first(pool: Sequence[Fit]) -> list[Fit]:
    """A pool, best first, led by a fit without a value at a bound if one does as well as the best.

    Of effects that act alike one that is implausible is a rival, and no cause.
    """
    near = (f for f in pool if cost(f) - cost(pool[0]) < RIVAL_DELTA_CHI2 and not at_a_bound(f))
    first = next(near, None)
    return list(pool) if first is None else [first, *(f for f in pool if f is not first)]


def cost(fit: Fit) -> float:
    """Akaike's criterion plus `by_search`: of equally good fits the one with fewer parameters is first."""
    return fit.chi2 + 2.0 * len(fit.keys) + by_search(fit)


def by_search(fit: Fit) -> float:
    """Chi squared that noise gives a model's effects by the search among alternatives for their starts.

    The best of m chi squareds exceeds g with at most m times the probability of one (Bonferroni). In the tail
    this falls as exp(-g/2), so m alternatives are worth 2 ln m.
    """
    return sum(2.0 * math.log(e.tried) for e in fit.effects)


def refined(
    fitter: Fitter, fit: Fit, progress: Callable[[str], None] = lambda _: None, laws: Sequence[Effect] = ()
) -> Fit:
    """A fit with a law of more freedom for one of its effects where that fits better; else itself.

    Better by `RIVAL_DELTA_CHI2`: the mechanism is the same, and the data choose its law again with every
    added effect. laws: others that are tried as well.
    """
    for law in (*laws, *fitter.simulator.refinements):
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
    """A pool of fits, best first, with laws of more freedom where they fit better (`refined`), ranked again.

    The first is refined. If it leaves structure or lies at a bound, or for `every`, the next `SEEDS`
    mechanisms with such laws are refined as well: the right mechanism may gain little by its first law.
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
