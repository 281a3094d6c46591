"""The search for designs: a trust region on a surrogate that knows slopes, for one goal or a front of
several.

Each step fits a surrogate to every quantity computed so far, finds its best design within reach of the known
ones, and computes that. Bounds and targets are met first; then the objectives are weighed in turn (augmented
Chebyshev, as in ParEGO: Knowles, IEEE Trans. Evol. Comput. 10 (2006) 50), so that the designs spread along
the Pareto front.
"""

from __future__ import annotations

import itertools
from collections.abc import Generator, Iterator, Sequence
from typing import Any

import attrs
import numpy as np

from ..arrays import Array, pareto
from .freedoms import Freedom
from .settings import BATCH, EVALUATIONS, SEED
from .surrogate import Surrogate, fit_all
from .targets import Target

Values = tuple[float | int | str, ...]
"""A design: one value for each freedom."""

PENALTY = 10.0
INWARD = 0.25
"""Distance inside a bound that the search aims at, in tolerances, to allow for the surrogate's error."""
AIM = 0.7
"""Beside objectives, a target counts as met within this share of its tolerance."""
FIRST_REACH, LEAST_REACH, MOST_REACH = 0.35, 0.01, 1.5
ROUNDS, SAMPLES = 9, 384
STALLED = 8
"""Number of steps without progress that end a search; with several objectives, for each."""


@attrs.frozen
class SearchSettings:
    """Limits and method of a search; see `settings`."""

    evaluations: int = EVALUATIONS.field()
    batch: int = BATCH.field()
    seed: int = SEED.field()


@attrs.frozen(eq=False)
class Observed:
    """Observation of a design: values (q,), slopes (q, c) by its continuous freedoms, nan where unknown.

    sound: True if it could be computed. margins (q,): distance to either side of each value within which its
    target must also be met; None for no margin.
    """

    design: Values
    values: Array
    slopes: Array
    sound: bool = True
    margins: Array | None = None


@attrs.frozen(eq=False)
class Found:
    """All designs computed, in order, and the proposed ones: the Pareto set, or the nearest."""

    observed: tuple[Observed, ...]
    proposed: tuple[int, ...]
    feasible: bool
    in_the_way: tuple[str, ...] = ()

    def some(self, most: int) -> list[int]:
        """Numbers of at most so many sound proposals in order, the first and the last among them."""
        chosen = np.array(self.proposed)
        if len(chosen) > most:
            chosen = chosen[np.unique(np.linspace(0, len(chosen) - 1, most).round().astype(int))]
        return [n for n in chosen.tolist() if self.observed[n].sound]


class Search:
    """A search for designs that meet targets; `steps` is its course."""

    def __init__(
        self,
        freedoms: Sequence[Freedom],
        targets: Sequence[Target],
        settings: SearchSettings,
    ) -> None:
        self.freedoms, self.settings = freedoms, settings
        self.judged = [i for i, t in enumerate(targets) if t.quantity is not None]
        self.targets = [targets[i] for i in self.judged]
        self.goals = [i for i, t in enumerate(self.targets) if t.goal is not None]
        self.signs = np.array([1.0 if self.targets[i].goal == "minimise" else -1.0 for i in self.goals])
        self.continuous = [i for i, f in enumerate(freedoms) if not f.discrete]
        self.discrete = [i for i, f in enumerate(freedoms) if f.discrete]
        self.rng = np.random.default_rng(settings.seed)
        self.observed: list[Observed] = []
        self.reach = FIRST_REACH

    # Designs as places: continuous freedoms from 0 to 1, discrete ones by the number of their value.

    def places(self, design: Values) -> Array:
        """Positions (f,) of a design."""
        return np.array(
            [
                float(f.values.index(v)) if f.discrete else f.place(float(v))
                for f, v in zip(self.freedoms, design, strict=True)
            ]
        )

    def design(self, places: Array) -> Values:
        """Design at positions (f,)."""
        return tuple(
            f.values[int(p)] if f.discrete else f.at(float(p))
            for f, p in zip(self.freedoms, places, strict=True)
        )

    def coordinates(self, places: Array) -> Array:
        """Coordinates (m, d) of a surrogate at positions (m, f): numbers by their size, names one by one."""
        columns = [places[:, self.continuous]]
        for i in self.discrete:
            values = self.freedoms[i].values
            number = places[:, i].astype(int)
            if all(isinstance(v, int | float) and not isinstance(v, bool) for v in values):
                size = np.array(values, float)
                span = float(np.ptp(size)) or 1.0
                columns.append(((size - size.min()) / span)[number][:, None])
            else:
                columns.append(np.eye(len(values))[number])
        return np.concatenate(columns, axis=1)

    # The course of the search.

    def steps(
        self, start: Values, known_before: Sequence[Observed] = ()
    ) -> Generator[list[Values], Sequence[Observed], Found]:
        """Generator of the designs to compute next, that is sent what was observed of them.

        known_before: designs computed before, replacing the start; they count as evaluations.
        """
        if known_before:
            self.observed = [self._judged(o) for o in known_before]
        else:
            yield from self._compute(self._first(start))
        weights = self._weights()
        stalled, most = 0, STALLED * max(len(self.goals), 1)
        while len(self.observed) < self.settings.evaluations and stalled < most and not self._done():
            if not any(o.sound for o in self.observed):
                yield from self._compute([self._random()])
                continue
            room = self.settings.evaluations - len(self.observed)
            chosen: list[Values] = []
            used: list[Array] = []
            models = self._models()
            for _ in range(min(self.settings.batch, room)):
                weighed = next(weights)
                proposal = self._proposed(models, weighed, chosen)
                if proposal is not None:
                    chosen.append(proposal)
                    used.append(weighed)
            if not chosen:
                # Of several objectives other weights may still have a new design.
                if self.reach >= MOST_REACH and len(self.goals) < 2:
                    break
                self.reach, stalled = min(2 * self.reach, MOST_REACH), stalled + 1
                continue
            known = len(self.observed)
            yield from self._compute(chosen)
            better = any(self._improved(known + i, known, w) for i, w in enumerate(used))
            self.reach = float(np.clip(self.reach * self._trust(models, known), LEAST_REACH, MOST_REACH))
            stalled = 0 if better else stalled + 1
        return self._found()

    def _first(self, start: Values) -> list[Values]:
        """The start, moved inside the bounds, and it with each other value of the discrete freedoms."""
        inside = []
        for f, v in zip(self.freedoms, start, strict=True):
            inside.append(
                (v if v in f.values else f.values[0])
                if f.discrete
                else f.at(np.clip(f.place(float(v)), 0, 1))
            )
        first = [tuple(inside)]
        for i in self.discrete:
            others = [v for v in self.freedoms[i].values if v != inside[i]]
            if len(others) > 3:
                others = [others[0], others[len(others) // 2], others[-1]]
            first += [(*inside[:i], v, *inside[i + 1 :]) for v in others]
        return first[: max(1, self.settings.evaluations // 2)]

    def _random(self) -> Values:
        places = [
            float(self.rng.integers(len(f.values))) if f.discrete else self.rng.random()
            for f in self.freedoms
        ]
        return self.design(np.array(places))

    def _compute(self, designs: list[Values]) -> Generator[list[Values], Sequence[Observed], None]:
        observed = yield designs
        self.observed += [self._judged(o) for o in observed]

    def _judged(self, o: Observed) -> Observed:
        """A design reduced to the quantities of the search."""
        margins = np.zeros_like(o.values) if o.margins is None else o.margins
        return attrs.evolve(
            o, values=o.values[self.judged], slopes=o.slopes[self.judged], margins=margins[self.judged]
        )

    def _models(self) -> Sequence[Surrogate]:
        """Models of every value, then of the margins if there are any."""
        sound = [o for o in self.observed if o.sound]
        x = self.coordinates(np.array([self.places(o.design) for o in sound]))
        widths = np.array([self.freedoms[i].high - self.freedoms[i].low for i in self.continuous])
        slopes = np.full((len(sound), len(self.targets), x.shape[1]), np.nan)
        if len(self.continuous):
            slopes[:, :, : len(self.continuous)] = np.array([o.slopes for o in sound]) * widths
        found = list(fit_all(x, np.array([o.values for o in sound]), slopes))
        margins = np.array([o.margins for o in sound])
        return found + list(fit_all(x, margins, np.full_like(slopes, np.nan))) if margins.any() else found

    def _done(self) -> bool:
        """Return True if, without objectives, a design meets all targets near their middle."""
        if self.goals or not self.observed:
            return False
        best = self.observed[self._best()]
        if not best.sound:
            return False
        misfits = [t.misfit(v) for t, v in zip(self.targets, best.values, strict=True)]
        return all(abs(m) <= 0.1 for m in misfits) and all(self._met(best))

    # Quality of values.

    def _met(self, o: Observed) -> list[bool]:
        """True for each target that is met, within its margin."""
        assert o.margins is not None
        rows = zip(self.targets, o.values, o.margins, strict=True)
        return [t.met(float(v), float(margin)) for t, v, margin in rows]

    def _known(self, observed: Sequence[Observed]) -> Array:
        """Values (n, q) of computed designs, followed by margins: (n, 2 q)."""
        return np.array([[*o.values, *o.margins] for o in observed])  # type: ignore[misc]

    def _misfits(self, found: Array, inward: float) -> Array:
        """Squared misfits (m, q) of values and margins (m, 2 q).

        inward: required distance inside their bounds, in tolerances.
        """
        values, margins = found[:, : len(self.targets)], found[:, len(self.targets) :]
        misfits = np.zeros_like(values)
        for i, t in enumerate(self.targets):
            if t.goal is not None:
                continue
            v, margin = values[:, i] / t.tolerance, margins[:, i] / t.tolerance
            if not np.isnan(t.value):
                off = np.abs(v - t.value / t.tolerance) + margin
                misfits[:, i] = np.maximum(off - (AIM if self.goals else 0.0), 0.0) ** 2
                continue
            if not np.isnan(t.low):
                misfits[:, i] += np.maximum(t.low / t.tolerance + inward + margin - v, 0.0) ** 2
            if not np.isnan(t.high):
                misfits[:, i] += np.maximum(v - t.high / t.tolerance + inward + margin, 0.0) ** 2
        return misfits

    def _merit(self, found: Array, weights: Array, inward: float = INWARD) -> Array:
        """Merits (m,) of values and margins (m, 2 q), to be small, for weights (g,) of the objectives."""
        merit = PENALTY * self._misfits(found, inward).sum(axis=1)
        if not self.goals:
            return merit
        ideal, span = self._scale()
        part = weights * (self.signs * found[:, self.goals] - ideal) / span
        return np.asarray(merit + part.max(axis=1) + 0.05 * part.sum(axis=1))

    def _scale(self) -> tuple[Array, Array]:
        """The best value (g,) of each objective, smaller is better, and the spread (g,) that counts as
        one."""
        sound = [o for o in self.observed if o.sound]
        good = [o for o in sound if self._feasible(o)] or sound
        costs = self.signs * np.array([o.values for o in good])[:, self.goals]
        least, spread = costs.min(axis=0), np.ptp(costs, axis=0)
        span = np.maximum(spread, 1e-2 * np.maximum(np.abs(least), 1e-9))
        # A little below the best found, so that weights from 0 to 1 end all along the front.
        return least - 0.3 * span, span

    def _feasible(self, o: Observed) -> bool:
        return o.sound and all(self._met(o))

    def _trust(self, models: Sequence[Surrogate], before: int) -> float:
        """Factor on the reach, by the accuracy of the surrogates for designs computed since.

        Their errors over the predicted change from the nearest known design, as in any trust region.
        """
        sound = [o for o in self.observed[:before] if o.sound]
        places = np.array([self.places(o.design) for o in sound])
        sizes = np.array([m.size for m in models[: len(self.targets)]])
        factors = []
        for o in self.observed[before:]:
            if not o.sound:
                factors.append(0.5)
                continue
            at = self.places(o.design)
            nearest = sound[int(np.abs(places - at).max(axis=1).argmin())]
            foreseen = self._predicted(models, at[None])[0, : len(self.targets)]
            change = np.linalg.norm((foreseen - nearest.values) / sizes)
            wrong = np.linalg.norm((foreseen - o.values) / sizes) / max(float(change), 1e-12)
            factors.append(2.0 if wrong < 0.1 else 1.0 if wrong < 0.35 else 0.5)
        return min(factors)

    def _improved(self, number: int, before: int, weights: Array) -> bool:
        """True if a design is better for some weights than all earlier ones."""
        if not self.observed[number].sound:
            return False
        rows = [o for o in self.observed[:before] if o.sound]
        merit = self._merit(self._known([*rows, self.observed[number]]), weights, 0.0)
        return len(rows) == 0 or bool(merit[-1] < merit[:-1].min() - 1e-9 * abs(merit[-1]))

    def _best(self) -> int:
        """The number of the design with the least misfit, then the best objectives, equally weighed."""

        def cost(o: Observed) -> tuple[bool, float, float]:
            if not o.sound:
                return (True, np.inf, np.inf)
            values = self._known([o])
            goal = float(self._merit(values, np.ones(len(self.goals)), 0.0)[0])
            feasible = self._feasible(o)
            return (not feasible, 0.0 if feasible else float(self._misfits(values, 0.0).sum()), goal)

        return min(range(len(self.observed)), key=lambda i: cost(self.observed[i]))

    # The next design.

    def _weights(self) -> Any:
        """Weights (g,) of the objectives, each alone first, then even mixes and others."""
        g = len(self.goals)
        if g < 2:
            return itertools.repeat(np.ones(g))
        corners = [np.eye(g)[i] * 0.98 + 0.02 / g for i in range(g)]
        even = [np.full(g, 1.0 / g)]
        if g == 2:
            mixes: Any = (np.array([a, 1 - a]) for a in _halvings())
        else:
            mixes = (self.rng.dirichlet(np.ones(g)) for _ in itertools.count())
        return itertools.chain(corners, even, corners, mixes)

    def _proposed(
        self, models: Sequence[Surrogate], weights: Array, besides: Sequence[Values]
    ) -> Values | None:
        """Best design of the surrogate within reach, None where all near it are known."""
        sound = np.array([self.places(o.design) for o in self.observed if o.sound])
        failed = np.array([self.places(o.design) for o in self.observed if not o.sound]).reshape(
            -1, len(self.freedoms)
        )
        values = self._known([o for o in self.observed if o.sound])
        order = np.argsort(self._merit(values, weights))
        best, width = sound[order[: min(4, len(order))]], self.reach
        for _ in range(ROUNDS):
            trial = np.concatenate([best, self._around(best, width)])
            trial = trial[self._within(trial, sound, failed)]
            if not len(trial):
                return None
            merit = self._merit(self._predicted(models, trial), weights)
            best = trial[np.argsort(merit, kind="stable")[:6]]
            width *= 0.5
        known = {o.design for o in self.observed} | set(besides)
        for places in best:
            design = self.design(places)
            near = [np.abs(places - self.places(k))[self.continuous].max(initial=0.0) for k in known
                    if all(self.places(k)[i] == places[i] for i in self.discrete)]  # fmt: skip
            if design not in known and min(near, default=1.0) > 1e-4:
                return design
        return None

    def _predicted(self, models: Sequence[Surrogate], places: Array) -> Array:
        """Values and margins (m, 2 q) at places (m, f)."""
        x = self.coordinates(places)
        means = np.stack([m.mean(x) for m in models], axis=1)
        missing = np.zeros((len(x), 2 * len(self.targets) - means.shape[1]))
        found = np.concatenate([means, missing], axis=1)
        found[:, len(self.targets) :] = np.maximum(found[:, len(self.targets) :], 0.0)
        return found

    def _around(self, centres: Array, width: float) -> Array:
        """Positions (SAMPLES, f) about some centres, a discrete freedom changed now and then."""
        chosen = centres[self.rng.integers(len(centres), size=SAMPLES)].copy()
        if self.continuous:
            steps = width * self.rng.standard_normal((SAMPLES, len(self.continuous)))
            # Half of them move along few axes, as the best often lies on a bound.
            steps *= self.rng.random(steps.shape) < self.rng.choice([0.4, 1.0], size=(SAMPLES, 1))
            chosen[:, self.continuous] = np.clip(chosen[:, self.continuous] + steps, 0.0, 1.0)
        for i in self.discrete:
            flip = self.rng.random(SAMPLES) < 0.2
            chosen[flip, i] = self.rng.integers(len(self.freedoms[i].values), size=int(flip.sum()))
        return chosen

    def _within(self, trial: Array, sound: Array, failed: Array) -> Array:
        """Mask of the places (m, f) within reach of a computed design and not nearer to a failed
        one."""
        if not self.continuous:
            return np.ones(len(trial), bool)

        def distance(to: Array) -> Array:
            step = np.abs(trial[:, None, self.continuous] - to[None][:, :, self.continuous]).max(axis=2)
            return np.asarray(step.min(axis=1))

        near = distance(sound)
        kept = near <= self.reach
        return kept & (distance(failed) > near) if len(failed) else kept

    # What was found.

    def _found(self) -> Found:
        feasible = [i for i, o in enumerate(self.observed) if self._feasible(o)]
        if not feasible:
            return Found(tuple(self.observed), (self._best(),), False, self._in_the_way())
        if len(self.goals) < 2:
            return Found(tuple(self.observed), (self._best(),), True)
        costs = self.signs * np.array([self.observed[i].values for i in feasible])[:, self.goals]
        front = pareto(costs)
        ordered = sorted(front.tolist(), key=lambda n: costs[n, 0])
        return Found(tuple(self.observed), tuple(feasible[n] for n in ordered), True)

    def _in_the_way(self) -> tuple[str, ...]:
        """Names of the targets without any one of which the others could be met, by the surrogate."""
        if not any(o.sound for o in self.observed):
            return ()
        models = self._models()
        best = self.observed[self._best()]
        self.reach = MOST_REACH
        found = []
        for number, target in enumerate(self.targets):
            if target.goal is not None or self._met(best)[number]:
                continue
            places, width = self.places(best.design)[None], 0.5
            least = np.inf
            for _ in range(ROUNDS):
                trial = np.concatenate([places, self._around(places, width)])
                rest = self._misfits(self._predicted(models, trial), 0.0)
                rest[:, number] = 0.0
                total = rest.sum(axis=1)
                places, width = trial[np.argsort(total, kind="stable")[:6]], 0.6 * width
                least = min(least, float(total.min()))
            if least <= 1.0:
                found.append(target.name)
        return tuple(found)


def _halvings() -> Iterator[float]:
    """Shares between 0 and 1 that halve the gaps between those before: 1/4, 3/4, 1/8, 5/8, ..."""
    for level in itertools.count(2):
        size = 2**level
        # The odd ones far from each other in turn (van der Corput).
        yield from sorted((k / size for k in range(1, size, 2)), key=lambda a: (a * size // 2) % 4)
