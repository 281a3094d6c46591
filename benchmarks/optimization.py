"""Model A's that a search needs until a unit meets all that is asked: ours, random search and NSGA-II.

    python -m benchmarks.optimization --method ours --budget 60 --seed 1

On a coarse mesh. NSGA-II needs pymoo, which mu_addon does not depend on. A gradient counts as half a Model A.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from benchmarks.table import options_of
from mu_addon.errors import InputError
from mu_addon.generators import value_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.optimization.design_file import parse_design
from mu_addon.optimization.evaluation import evaluate
from mu_addon.optimization.search import Observed, Search, SearchSettings
from mu_addon.optimization.unit_body import Mechanics

ASKED = """
format = 1
preset = "mu-1.0x"
[[target]]
kind = "angle"
pressure_kPa = 20
value = 11.45
tolerance = 0.3
[[target]]
kind = "angle"
pressure_kPa = -8
value = -16.56
tolerance = 0.2
[[target]]
kind = "air_volume"
value = 16.49
tolerance = 0.15
[[freedom]]
parameter = "chambers.wall_mm"
low = 0.5
high = 1.2
[[freedom]]
parameter = "chambers.neck_diameter_mm"
low = 9
high = 15
[[freedom]]
parameter = "chambers.bladder_share"
low = 0.45
high = 0.7
[[freedom]]
parameter = "material.membrane_modulus_kPa"
low = 1500
high = 4000
"""
GRADIENT = 0.5


class Counted:
    """Observes designs; when the first met all, and what it cost."""

    def __init__(self, refine: float, with_gradient: bool) -> None:
        self.design = parse_design(ASKED, "benchmark")
        self.mechanics = Mechanics(MeshSettings(refine=refine))
        self.with_gradient = with_gradient
        self.cost = 0.0
        self.count = 0
        self.met_at: float | None = None
        self.best = np.inf

    def one(self, values: tuple[Any, ...]) -> Observed:
        """What is found of one design."""
        targets, freedoms = self.design.targets, self.design.freedoms
        found, slopes = np.full(len(targets), np.nan), np.full((len(targets), len(freedoms)), np.nan)
        sound = False
        try:
            unit = self.design.unit_of(values)
            result = evaluate(unit, targets, freedoms, self.mechanics, self.with_gradient)
            found, slopes, sound = result.values, result.gradient, result.sound
            self.cost += 1.0 + GRADIENT * self.with_gradient
        except InputError:
            # A rule is checked in no time.
            pass
        self.count += 1
        if sound:
            misfits = [abs(t.misfit(v)) for t, v in zip(targets, found, strict=True)]
            self.best = min(self.best, max(misfits))
            if self.met_at is None and max(misfits) <= 1.0:
                self.met_at = self.cost
        return Observed(values, found, slopes, sound)

    def misfit(self, places: np.ndarray[Any, Any]) -> list[float]:
        """Misfits of a design at places in the unit cube, in tolerances; 100 where it fails."""
        values = tuple(f.at(float(p)) for f, p in zip(self.design.freedoms, places, strict=True))
        o = self.one(values)
        if not o.sound:
            return [100.0] * len(self.design.targets)
        return [abs(t.misfit(v)) for t, v in zip(self.design.targets, o.values, strict=True)]


def ours(counted: Counted, budget: int, seed: int) -> None:
    """The search of mu_addon."""
    d = counted.design
    settings = SearchSettings(evaluations=int(budget / 1.5), seed=seed)
    steps = Search(d.freedoms, d.targets, settings).steps(d.start)
    value_of(steps, lambda xs: [counted.one(x) for x in xs])


def random(counted: Counted, budget: int, seed: int) -> None:
    """Designs at random."""
    rng = np.random.default_rng(seed)
    while counted.cost < budget and counted.met_at is None:
        counted.misfit(rng.random(len(counted.design.freedoms)))


def nsga2(counted: Counted, budget: int, seed: int) -> None:
    """pymoo's NSGA-II on the misfits, 12 designs a generation."""
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    n = len(counted.design.freedoms)

    class Problem(ElementwiseProblem):
        def __init__(self) -> None:
            super().__init__(n_var=n, n_obj=len(counted.design.targets), xl=np.zeros(n), xu=np.ones(n))

        def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **more: Any) -> None:
            out["F"] = counted.misfit(x) if counted.met_at is None else [0.0] * len(counted.design.targets)

    minimize(Problem(), NSGA2(pop_size=12), ("n_eval", budget), seed=seed, verbose=False)


METHODS = {"ours": ours, "random": random, "nsga2": nsga2}


def main() -> None:
    """Run one method once and print what it took."""
    options = options_of(__doc__)
    options.add_argument("--method", choices=METHODS, required=True)
    options.add_argument("--budget", type=int, default=60)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--refine", type=float, default=0.3)
    given = options.parse_args()
    counted = Counted(given.refine, given.method == "ours")
    start = time.process_time()
    METHODS[given.method](counted, given.budget, given.seed)
    seconds = time.process_time() - start
    met = "not met" if counted.met_at is None else f"met after {counted.met_at:g} Model A's"
    print(
        f"{given.method} seed {given.seed}: {met} (largest misfit {counted.best:.2f} tolerances), "
        f"{counted.count} designs, {counted.cost:g} Model A's, {seconds:.0f} processor seconds",
        flush=True,
    )


if __name__ == "__main__":
    main()
