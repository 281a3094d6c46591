"""Effects whose size differs between specimens, sessions or experiments, with one distribution."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..measured import Experiment
from .effect import OF, Effect, Parameter
from .effects import DECLARED
from .effects.declaration import ALL, BENCH
from .fit import Fit, Fitter
from .owned import of_specimens, scaled_by
from .spanned import basis

# Least number of owners for an estimate of the spread.
FEWEST = 3
# Names of drifts: separate for each experiment they would imitate another law of the same instrument.
DRIFTS = "_drift"
# Rounds of spread, values and slopes about them, and the change of the spread that ends them.
ROUNDS, SETTLED = 4, 0.02
# Number of shapes (times of a drift, inertia of a leak) that a fit starts from, the most promising ones.
SHAPES = 2
# Rise of -2 log L that a 95 % interval of one number allows.
RISE = 3.84


@attrs.frozen
class Spread:
    """Standard deviation of values between owners, in their parameter's unit, by restricted likelihood.

    For values of one sign it is their root mean square, as of the full normal distribution. low95, high95:
    profile interval. gain: of -2 log L over no spread; a further fall of chi squared is the cost of the
    values' freedom. values (j,): most likely value of each owner, shrunk toward their mean (of one sign:
    toward 0) according to its uncertainty.
    """

    value: float
    low95: float
    high95: float
    gain: float
    paid: float
    values: Array


def spread_of(slopes: Array, residual: Array, most: float, one_sign: bool = False) -> Spread:
    """Spread of j owners' values, estimated from a residual.

    slopes (n, j): of the whitened prediction by the value of each owner, orthogonal to all that is fitted
    anyway; residual (n,): whitened, with every value at 0. Values are normal about 0 with a standard
    deviation s: the residual's covariance is I + s^2 Z Z^T, and -2 log L = log det(I + s^2 G) - s^2 b^T (I +
    s^2 G)^-1 b with G = Z^T Z, b = Z^T r (Harville, J. Am. Stat. Assoc. 72 (1977) 320). most: largest
    standard deviation that is tried. one_sign: no value is below 0. The likelihood above is multiplied by the
    posterior probability of this over the prior one, 2^-j; the posterior probability is a product over
    owners, exact if they share no data.
    """
    from scipy.optimize import nnls
    from scipy.special import log_ndtr

    gram, along = slopes.T @ slopes, slopes.T @ residual
    weight, directions = np.linalg.eigh(gram)
    weight = np.maximum(weight, 0.0)
    c = directions.T @ along
    tried = np.concatenate([[0.0], np.geomspace(1e-5 * most, most, 2000)])
    grown = 1.0 + tried[:, None] ** 2 * weight
    variance = tried[:, None] ** 2 / grown
    deviance = (np.log(grown) - variance * c**2).sum(axis=1)
    if one_sign:
        # Each owner's posterior: mean over standard deviation, of every spread but 0.
        apart = (variance[1:] * c) @ directions.T / np.sqrt(variance[1:] @ (directions.T**2))
        deviance[1:] -= 2.0 * (math.log(2.0) + log_ndtr(apart)).sum(axis=1)
    best = int(np.argmin(deviance))
    within = tried[deviance <= deviance[best] + RISE]
    values = directions @ (variance[best] * c)
    if one_sign and tried[best] > 0.0:
        # Least squares of the data and of the values over s, none of these below 0.
        root = np.linalg.cholesky(gram + np.eye(len(gram)) / tried[best] ** 2)
        values = nnls(root.T, np.linalg.solve(root, along))[0]
    fallen = 0.0
    if tried[best] > 0.0:
        fallen = float(2.0 * values @ along - values @ gram @ values - (values @ values) / tried[best] ** 2)
    gain = float(-deviance[best])
    return Spread(float(tried[best]), float(within[0]), float(within[-1]), gain, fallen - gain, values)


def has_one_sign(p: Parameter) -> bool:
    """Return True if a size can lie on one side of its null only, as a leak's does."""
    return p.null in (p.low, p.high)


def pooled_effects(effects: Sequence[Effect], experiments: Sequence[Experiment]) -> tuple[Effect, ...]:
    """Effects whose size may differ between specimens, sessions or experiments, before any is known.

    Effects of instruments differ by session, where sessions are given, and by experiment; effects of
    printing, the modulus and leaks by specimen. The size, the first parameter, is one an owner; the shape,
    all others, is shared. Only sizes of either sign without a shape vary by experiment. Experiments also
    differ in their protocol, and separate leaks or drifts would imitate another law of the same unit.
    """
    found = []
    for effect in (*of_specimens(experiments), *effects):
        size, *shape = effect.parameters
        if DECLARED[effect.name].of == ALL:
            continue
        own = [e for e in experiments if e.kind in effect.kinds]
        for among, owners in _groups(effect.name, own).items():
            followed = shape or has_one_sign(size) or effect.name.endswith(DRIFTS)
            if len(owners) >= FEWEST and not (among == "experiment" and followed):
                each = (_own(size, f"{among} {owner}") for owner in owners)
                several = attrs.evolve(effect, parameters=(*each, *shape), among=among)
                field = "name" if among == "experiment" else among
                members = [[e.name for e in own if getattr(e, field) == owner] for owner in owners]
                found.append(scaled_by(several, members, own))
    return tuple(found)


def sizes_of(effect: Effect) -> tuple[tuple[str, Parameter], ...]:
    """Keys and parameters of the owners' sizes, of an effect of `pooled_effects`."""
    pairs = zip(effect.keys, effect.parameters, strict=True)
    return tuple((key, p) for key, p in pairs if OF in p.name)


def _groups(name: str, experiments: Sequence[Experiment]) -> dict[str, tuple[str, ...]]:
    """Names of owners by group: specimens, or sessions and experiments for instruments."""
    named = {"specimen": [e.specimen for e in experiments]}
    if DECLARED[name].of == BENCH:
        named = {"session": [e.session for e in experiments]}
        named["experiment"] = [e.name for e in experiments]
    # Where some of a group have no name, their owners are unknown.
    whole = {k: tuple(dict.fromkeys(v)) for k, v in named.items() if all(v)}
    if any(len(whole[k]) == len(experiments) for k in whole if k != "experiment"):
        # Each experiment is the only one of its owner.
        whole.pop("experiment", None)
    return whole


def _own(p: Parameter, owner: str) -> Parameter:
    """Size of one owner; its fit begins at the least start only, not at every owner's every start."""
    least = sorted(p.starts, key=lambda v: abs(v - p.null))[:1]
    return attrs.evolve(p, name=f"{p.name}{OF}{owner}", starts=tuple(least))


def fits_among(
    fitter: Fitter, base: Fit, progress: Callable[[str], None] = lambda _: None
) -> list[tuple[float, Fit]]:
    """Gain in -2 log L and fit of each effect that differs among owners, the largest gain first.

    Effects whose owners show no spread are left out.
    """
    found = []
    for effect in pooled_effects(fitter.simulator.effects, fitter.record.experiments):
        progress(effect.title)
        one = _fitted(fitter, base, effect)
        if one is not None:
            found.append(one)
    # Of those that do equally well but for rounding the first is taken: specimens differ always.
    return sorted(found, key=lambda one: -round(one[0], 6))


def _fitted(fitter: Fitter, base: Fit, effect: Effect) -> tuple[float, Fit] | None:
    """Gain in -2 log L and fit of an effect whose owners differ; None if the data show none."""
    shapes = [{**base.values, **shape} for shape in _shapes(effect)]
    begun = [(spread, values) for values in shapes if (spread := _spread(fitter, base, effect, values))]
    begun.sort(key=lambda one: -one[0].gain)
    found = [one for start in begun[:SHAPES] if (one := _settled(fitter, base, effect, *start))]
    return max(found, key=lambda one: one[0], default=None)


def _shapes(effect: Effect) -> list[dict[str, float]]:
    """Combinations of the starts of shared parameters, by key, with every size at its null."""
    sizes = {key: p.null for key, p in sizes_of(effect)}
    found: list[dict[str, float]] = []
    for start in effect.starts():
        if (shape := {**start, **sizes}) not in found:
            found.append(shape)
    return found


def _settled(
    fitter: Fitter, base: Fit, effect: Effect, spread: Spread, values: Mapping[str, float]
) -> tuple[float, Fit] | None:
    """Gain and fit with spread, values and shape estimated alternately, from a first spread."""
    sizes = sizes_of(effect)
    own = {key for key, _ in sizes}
    fit = base
    for round_ in range(ROUNDS):
        each = tuple(
            attrs.evolve(p, spread=spread.value) if key in own else p
            for key, p in zip(effect.keys, effect.parameters, strict=True)
        )
        effect = attrs.evolve(effect, parameters=each, spread=(spread.value, spread.low95, spread.high95))
        guess = {
            key: min(max(p.null + v, p.low), p.high)
            for (key, p), v in zip(sizes, spread.values.tolist(), strict=True)
        }
        fit = fitter.best([effect], [{**values, **guess}])
        if not math.isfinite(fit.chi2):
            return None
        values, before = fit.values, spread.value
        again = _spread(fitter, fit, effect, values) if round_ < ROUNDS - 1 else None
        if again is None:
            break
        spread = again
        if abs(spread.value - before) < SETTLED * spread.value:
            break
    # What it gained as fitted: the values may be at bounds, or the slopes have changed.
    return base.chi2 - fit.chi2 - spread.paid, fit


def _spread(fitter: Fitter, fit: Fit, effect: Effect, values: Mapping[str, float]) -> Spread | None:
    """Spread about values of an effect's sizes and shape; None where there is none.

    fit: without the effect, or with it at these values.
    """
    sizes = sizes_of(effect)
    at = fitter.possible(values)
    if at is None:
        return None
    slopes = np.empty((len(at), len(sizes)), order="F")
    for i, (key, p) in enumerate(sizes):
        step = p.step if p.low <= values[key] + p.step <= p.high else -p.step
        moved = fitter.possible({**values, key: values[key] + step})
        if moved is None:
            return None
        slopes[:, i] = (moved - at) / step
    own = {key for key, _ in sizes}
    q = basis(fit.jacobian[:, [i for i, key in enumerate(fit.keys) if key not in own]])
    white = fitter.project(slopes)
    white -= q @ (q.T @ white)
    # As it would be with all values at 0.
    residual = fit.residual + white @ np.array([values[key] - p.null for key, p in sizes])
    residual = residual - q @ (q.T @ residual)
    p = sizes[0][1]
    sign = -1.0 if has_one_sign(p) and p.null == p.high else 1.0
    found = spread_of(sign * white, residual, max(p.high - p.null, p.null - p.low), has_one_sign(p))
    return attrs.evolve(found, values=sign * found.values) if found.value > 0.0 else None
