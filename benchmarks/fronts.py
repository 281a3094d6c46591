"""Evaluations to the same Pareto front, known in closed form: ours, pymoo's NSGA-II, Optuna, random search.

    python benchmarks/fronts.py [--budget 400] [--seeds 5] [--picture fronts.png]

Two problems: a cantilever, as light and as stiff as can be, by width, height and wall of its hollow section;
and ZDT2 (Zitzler, Deb and Thiele, Evol. Comput. 8 (2000) 173) of four variables. Measured is the share of the
true front's hypervolume that the units found so far have, and the evaluations until it is 95 %; ours takes
slopes, so that each of its evaluations counts as 1.5. Needs pymoo and optuna, which mu_addon does not.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import Any

import attrs
import numpy as np

from mu_addon.optimization.freedoms import Freedom
from mu_addon.optimization.search import Observed, SearchSettings, search_units
from mu_addon.optimization.targets import Target

Array = np.ndarray[Any, Any]
SHARE = 0.95
WITH_SLOPES = 1.5
GENERATION = 20
# Evaluations of ours at most: the time of its surrogate grows with their cube.
MOST = 80


@attrs.frozen
class Problem:
    """Two costs (2,) of places (n,) in the unit cube, each 0 to 1 on the front, and the front (m, 2)."""

    name: str
    variables: int
    costs: Callable[[Array], Array]
    front: Array


@attrs.frozen
class Quantity:
    """A named quantity without a simulation."""

    name: str
    conditions: tuple[Any, ...] = ()


def zdt2(x: Array) -> Array:
    """f1 = x1, f2 = g (1 - (f1/g)^2), g = 1 + 9 mean(x2..)."""
    g = 1.0 + 9.0 * x[1:].mean()
    return np.array([x[0], g * (1.0 - (x[0] / g) ** 2)])


# Of the hollow section: bounds of width and height in mm, of the wall as a share of the width.
LOW, HIGH = np.array([4.0, 4.0, 0.1]), np.array([20.0, 20.0, 0.5])


def section(places: Array) -> tuple[float, float]:
    """Area in mm2 and second moment in mm4 of a hollow rectangle, its wall a share of the lesser side."""
    a, b, share = LOW + places * (HIGH - LOW)
    t = share * (a * b) / (a + b)
    inner = (a - 2 * t), (b - 2 * t)
    return a * b - inner[0] * inner[1], (a * b**3 - inner[0] * inner[1] ** 3) / 12.0


def _cantilever() -> Problem:
    """Log of area and of flexibility; the front by a grid so fine that a finer one has the same volume."""
    steps = [np.linspace(0.0, 1.0, n) for n in (60, 60, 40)]
    every = np.array([section(np.array(p)) for p in np.stack(np.meshgrid(*steps), -1).reshape(-1, 3)])
    logs = np.column_stack([np.log(every[:, 0]), -np.log(every[:, 1])])
    front = _best(logs)
    low, span = front.min(axis=0), np.ptp(front, axis=0)

    def costs(places: Array) -> Array:
        area, moment = section(places)
        return (np.array([np.log(area), -np.log(moment)]) - low) / span

    return Problem("cantilever", 3, costs, (front - low) / span)


def problems() -> list[Problem]:
    """The two problems."""
    x = np.linspace(0.0, 1.0, 2001)
    return [_cantilever(), Problem("ZDT2", 4, zdt2, np.column_stack([x, 1.0 - x**2]))]


def _best(costs: Array) -> Array:
    """The rows (m, 2) that no other row beats, by the first cost."""
    order = np.lexsort((costs[:, 1], costs[:, 0]))
    rows = costs[order]
    least = np.minimum.accumulate(rows[:, 1])
    return rows[np.r_[True, rows[1:, 1] < least[:-1]]]


def volume(costs: Array) -> float:
    """Area between the rows (n, 2) and the point (1.1, 1.1)."""
    inside = costs[(costs < 1.1).all(axis=1)]
    if not len(inside):
        return 0.0
    front = _best(inside)
    above = np.r_[1.1, front[:-1, 1]]
    return float(((1.1 - front[:, 0]) * (above - front[:, 1])).sum())


class Counted:
    """A problem's costs, each evaluation kept."""

    def __init__(self, problem: Problem, budget: int) -> None:
        self.problem, self.budget = problem, budget
        self.rows: list[Array] = []

    def __call__(self, places: Array) -> Array:
        found = self.problem.costs(np.asarray(places, float))
        self.rows.append(found)
        return found

    def shares(self) -> Array:
        """Share of the true front's hypervolume after each evaluation."""
        whole = volume(self.problem.front)
        return np.array([volume(np.array(self.rows[: n + 1])) for n in range(len(self.rows))]) / whole


def ours(counted: Counted, seed: int) -> None:
    """The search of mu_addon, with slopes."""
    n = counted.problem.variables
    freedoms = [Freedom(str(i), 0.0, 1.0) for i in range(n)]
    goals = [
        Target(f"cost {i}", "angle", "", Quantity(f"cost {i}"), tolerance=1.0, goal="minimise")
        for i in (1, 2)
    ]

    def one(design: tuple[float, ...]) -> Observed:
        x = np.array(design)
        sides = [
            [counted.problem.costs(np.clip(x + s * 1e-6 * row, 0, 1)) for s in (1, -1)] for row in np.eye(n)
        ]
        width = [(np.clip(v + 1e-6, 0, 1) - np.clip(v - 1e-6, 0, 1)) for v in x]
        slopes = np.array([(a - b) / w for (a, b), w in zip(sides, width, strict=True)]).T
        return Observed(design, counted(x), slopes)

    start = tuple(np.random.default_rng(seed).random(n).tolist())
    settings = SearchSettings(evaluations=min(int(counted.budget / WITH_SLOPES), MOST), seed=seed)
    search_units(freedoms, goals, lambda designs: [one(d) for d in designs], start, settings)


def random(counted: Counted, seed: int) -> None:
    """Designs at random."""
    rng = np.random.default_rng(seed)
    for _ in range(counted.budget):
        counted(rng.random(counted.problem.variables))


def nsga2(counted: Counted, seed: int) -> None:
    """pymoo's NSGA-II, 20 designs a generation."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    n = counted.problem.variables

    class Wrapped(ElementwiseProblem):
        def __init__(self) -> None:
            super().__init__(n_var=n, n_obj=2, xl=np.zeros(n), xu=np.ones(n))

        def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **more: Any) -> None:
            out["F"] = counted(x)

    minimize(Wrapped(), NSGA2(pop_size=GENERATION), ("n_eval", counted.budget), seed=seed, verbose=False)


def optuna(counted: Counted, seed: int, sampler: str) -> None:
    """Optuna's TPE for several objectives, or its own NSGA-II."""
    import optuna as library

    library.logging.set_verbosity(library.logging.ERROR)
    made = (
        library.samplers.TPESampler(seed=seed)
        if sampler == "tpe"
        else library.samplers.NSGAIISampler(seed=seed, population_size=GENERATION)
    )
    study = library.create_study(directions=["minimize"] * 2, sampler=made)
    for _ in range(counted.budget):
        trial = study.ask()
        x = np.array([trial.suggest_float(str(i), 0.0, 1.0) for i in range(counted.problem.variables)])
        study.tell(trial, counted(x).tolist())


METHODS: dict[str, Callable[[Counted, int], None]] = {
    "ours": ours,
    "NSGA-II (pymoo)": nsga2,
    "TPE (Optuna)": partial(optuna, sampler="tpe"),
    "NSGA-II (Optuna)": partial(optuna, sampler="nsga2"),
    "random": random,
}


def picture(found: dict[tuple[str, str], list[Array]], path: str) -> None:
    """Share of the hypervolume by evaluations: median, and least to most of the seeds."""
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(problem for problem, _ in found))
    drawn = Figure(figsize=(9, 3.4), layout="constrained")
    for axes, name in zip(drawn.subplots(1, len(names), sharey=True), names, strict=True):
        for number, method in enumerate(METHODS):
            runs = found[name, method]
            count = min(map(len, runs))
            rows = np.array([r[:count] for r in runs])
            cost = np.arange(1, count + 1) * (WITH_SLOPES if method == "ours" else 1.0)
            axes.plot(cost, np.median(rows, axis=0), color=f"C{number}", label=method)
            axes.fill_between(cost, rows.min(axis=0), rows.max(axis=0), color=f"C{number}", alpha=0.15, lw=0)
        axes.axhline(SHARE, color="black", lw=0.8, ls="--")
        axes.set(title=name, xlabel="evaluations (1.5 with slopes)", xscale="log", ylim=(0, 1.02))
    drawn.axes[0].set_ylabel("share of the true hypervolume")
    drawn.axes[0].legend(fontsize=8, frameon=False)
    drawn.savefig(path, dpi=130)


def main() -> None:
    """Print the evaluations of each method on each problem, and draw the courses."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--budget", type=int, default=400)
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--picture")
    given = options.parse_args()
    found: dict[tuple[str, str], list[Array]] = {}
    print(
        f"| problem | search | evaluations to {SHARE:.0%} of the hypervolume, each seed | share at the end |"
    )
    print("| --- | --- | --- | --- |")
    for problem in problems():
        for method, search in METHODS.items():
            runs = []
            for seed in range(given.seeds):
                counted = Counted(problem, given.budget)
                search(counted, seed)
                runs.append(counted.shares())
            found[problem.name, method] = runs
            factor = WITH_SLOPES if method == "ours" else 1.0
            reached = [
                f"{factor * (np.argmax(r >= SHARE) + 1):g}" if (r >= SHARE).any() else "not reached"
                for r in runs
            ]
            last = np.median([r[-1] for r in runs])
            print(f"| {problem.name} | {method} | {', '.join(reached)} | {last:.3f} |", flush=True)
    if given.picture:
        picture(found, given.picture)


if __name__ == "__main__":
    main()
