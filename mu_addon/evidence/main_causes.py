"""Causes that take most of a misfit although structure is left."""

from __future__ import annotations

import attrs

from .acceptance import JUMP, bounded_by, doubts, loss, share_by_experiment, sudden
from .curved_reading import curved_reading
from .effect import STEP
from .effects import MEMORY
from .fit import Fit, Fitter
from .found_causes import LAW, RIVAL_DELTA_CHI2, Cause, Selection
from .hypotheses import by_search, ranked
from .outliers import NAME as OUTLIER
from .plausibility import at_a_bound
from .residual_tests.table import strict_table, structure
from .rivals import causes_of, nearest, not_chosen, promising_rivals, with_rivals
from .scatter import ALONE
from .significance import by_count

# Tests against the drive as it is now.
OF_THE_DRIVE = frozenset(("pressure", "angle", "strain", "added_mass"))
# Share of a misfit that one effect must take to be named although structure is left, and the factor by which
# any other one's residual must exceed its own.
MAINLY, APART = 0.99, 10.0
# Share from which the best explanation is reported as such, and the factor for any other's residual.
GRADED, CLEAR = 0.9, 4.0


def mainly(fitter: Fitter, found: Selection) -> Selection | None:
    """Selection of the effects that take most of a misfit, though structure is left; None without.

    Their law may be another than the library's. Several: see `_mainly_several`. A single effect, of all, of
    one owner or among owners, must take `GRADED` of the misfit, have no value at a bound except its null, and
    fit better than a step change. An effect of all must also predict left-out experiments better and not
    depend on a single experiment. Its rivals leave less than `APART` times as much misfit, or `CLEAR` times
    if it takes less than `MAINLY`. An effect that takes `MAINLY` has no rivals that take less.
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
    if best.names[0] in MEMORY and set(structure(table)) & OF_THE_DRIVE:
        # What is a function of the drive itself has not been remembered.
        return None
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
    if bounded_by(fitter, base, best):
        return None
    gain, dof = base.chi2 - best.chi2 - by_search(best), len(best.keys) - len(base.keys)
    p = by_count(gain, dof, len(found.singles) + len(found.wider))
    cause = Cause(best.effects[0], p, base.chi2 - best.chi2, tuple(near))
    return attrs.evolve(found, chosen=best, causes=(cause,), table=table, doubted="", p_best=p)


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
    if not _plain(fitter, less) or not with_rivals(fitter, found).causes[-1].rivals:
        return None
    doubted = doubts(fitter, found.table_base, found.base, chosen)
    return attrs.evolve(less, table=tuple(strict_table(fitter, chosen)), doubted=doubted)


def _plain(fitter: Fitter, found: Selection) -> bool:
    """Return True if several causes leave less than 1 - `GRADED` of each cause's loss."""
    left = found.chosen.chi2 - len(fitter.record)
    return len(found.causes) > 1 and all(left <= (1.0 - GRADED) * c.loss for c in found.causes)


def _mainly_several(fitter: Fitter, found: Selection) -> bool:
    """Return True if several causes take most of a misfit (`_plain`), though structure is left.

    No other effect in its place leaves less than `CLEAR` times the residual. None has a value at a bound or
    rests on a single experiment.
    """
    base, chosen = found.base, found.chosen
    if found.doubted or at_a_bound(chosen) or not _plain(fitter, found):
        return False
    if MEMORY.intersection(chosen.names) and set(found.left) & OF_THE_DRIVE:
        return False
    if any(c.rivals for c in with_rivals(fitter, found).causes):
        return False
    left, taken = max(chosen.chi2 - len(fitter.record), 0.0), base.chi2 - chosen.chi2
    for c in found.causes:
        # So near a rival would have been reported (`causes_of`).
        near = max(RIVAL_DELTA_CHI2, LAW**2 * (taken - c.loss))
        if CLEAR * left > near:
            rivals = promising_rivals(fitter, chosen, c.effect, not_chosen(found))
            if any(f.chi2 - chosen.chi2 < CLEAR * left for f in rivals):
                return False
        last = fitter.fit([*(e for e in chosen.effects if e is not c.effect), c.effect], chosen.values)
        shares = share_by_experiment(fitter, last)
        if len(shares) > 1 and max(shares.values()) > ALONE:
            return False
    return True


def share_taken(fitter: Fitter, base: Fit, fit: Fit) -> float:
    """Share of the base model's misfit that another model takes: of chi squared beyond noise."""
    noise = float(len(fitter.record))
    return 1.0 - max(fit.chi2 - noise, 0.0) / max(base.chi2 - noise, 1.0)
