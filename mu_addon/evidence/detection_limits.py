"""Detection limits of effects, by simulated data: the misfit that the base model leaves of each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import attrs

from ..errors import MuError
from .fit import Fitter
from .sensitivity import ABSORBED, SEEN, Sensitivity, best_seen

# Share of the delta chi squared of `SEEN` that the base model must leave of data made with an effect of its
# limit, and the factor by which a limit of less is raised.
LEFT, RAISED = 0.8, 1.4


def at_bounds(fitter: Fitter, values: Mapping[str, float], found: Sequence[Sensitivity]) -> list[Sensitivity]:
    """The same sensitivities, with `at_bounds` computed for effects not visible to first order.

    The base model is fitted to the prediction at each bound of the size. `at_bounds` is the root of the chi
    squared (no unit) in excess of that without the effect. Bounds without a solution are skipped.
    """
    judged, plain = [], _missed(fitter, values, values)
    for s in found:
        if s.linear or s.unabsorbed <= ABSORBED:
            judged.append(s)
            continue
        p, most = s.effect.parameters[0], 0.0
        for bound in {p.low, p.high} - {p.null}:
            chi2 = _missed(fitter, values, {**values, **s.shape, s.effect.keys[0]: bound}) - plain
            if math.isfinite(chi2):
                most = max(most, math.sqrt(max(chi2, 0.0)))
        judged.append(attrs.evolve(s, at_bounds=most))
    return judged


def with_true_limits(
    fitter: Fitter, values: Mapping[str, float], found: Sequence[Sensitivity]
) -> list[Sensitivity]:
    """The same sensitivities, the limit of each effect's best shape at least where data made with it differ.

    The first-order limit assumes that nuisances absorb the same share at every size. They may absorb more of
    a large effect, as another modulus does of a thinner wall. The base model is fitted to the prediction with
    the effect at its limit, of either sign. The limit is raised until `LEFT` of its delta chi squared
    remains, or to infinity beyond the effect's bounds. values: of the nuisances, by name and in their units.
    """
    best = {id(s) for s in best_seen(found).values()}
    judged, plain = [], _missed(fitter, values, values)
    for s in found:
        p, limit, key = s.effect.parameters[0], s.limit, s.effect.keys[0]
        while id(s) in best and s.linear and math.isfinite(limit):
            sizes = [p.null + sign * limit for sign in (-1.0, 1.0)]
            within = [size for size in sizes if p.low <= size <= p.high]
            left = [_missed(fitter, values, {**values, **s.shape, key: size}) - plain for size in within]
            if not left:
                limit = math.inf
            elif min(left) >= LEFT * SEEN**2:
                break
            else:
                limit *= RAISED
        judged.append(attrs.evolve(s, limit=limit))
    return judged


def _missed(fitter: Fitter, values: Mapping[str, float], truth: Mapping[str, float]) -> float:
    """Chi squared of the base model's fit, started at values, to the prediction of others; inf without a fit.

    Without noise: for the values themselves it is their cost by prior knowledge.
    """
    try:
        imagined = attrs.evolve(fitter.record, values=fitter.predict(truth))
        return Fitter(imagined, fitter.simulator, fitter.sources, None, fitter.whitening).fit((), values).chi2
    except MuError:
        # Not every law has a solution there.
        return math.inf
