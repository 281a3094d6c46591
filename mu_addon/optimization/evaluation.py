"""Evaluation of all targets of a unit from one Model A, with gradients; never computed twice."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from ..design.parameters import Unit
from ..errors import ConvergenceError, InputError, MeshingError
from ..fem.factor import IndefiniteError
from ..run.cache import Cache, key
from .freedoms import Freedom
from .gradient import gradients
from .structure import WITHOUT, solve
from .targets import Target
from .uncertainty import Uncertainty
from .unit_body import Mechanics, UnitBody

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Evaluated:
    """Evaluation of one unit.

    values (q,) of the targets' quantities, nan where it failed; gradient (q, f) by the continuous freedoms,
    nan where there is none; why: the reason of a failure, else ""; model_a: number of solutions of the unit
    along its path, one for each body simulated. by_print, by_resin (q,): standard errors of the values, 0
    where none were asked for.
    """

    unit: Unit
    values: Array
    gradient: Array
    why: str = ""
    model_a: int = 1
    by_print: Array = attrs.field(default=attrs.Factory(lambda self: np.zeros_like(self.values), True))
    by_resin: Array = attrs.field(default=attrs.Factory(lambda self: np.zeros_like(self.values), True))

    @property
    def sound(self) -> bool:
        """True if it was simulated."""
        return not self.why

    def plain(self) -> dict[str, Any]:
        """Plain data, without the unit; `restored` is its inverse."""
        return {
            "values": [None if np.isnan(v) else float(v) for v in self.values],
            "gradient": [[None if np.isnan(v) else float(v) for v in row] for row in self.gradient],
            "why": self.why,
            "model_a": self.model_a,
            "by_print": self.by_print.tolist(),
            "by_resin": self.by_resin.tolist(),
        }


def restored(unit: Unit, plain: dict[str, Any]) -> Evaluated:
    """Evaluation of a unit restored from `Evaluated.plain`."""

    def numbers(row: Sequence[float | None]) -> list[float]:
        return [np.nan if v is None else v for v in row]

    gradient = np.array([numbers(row) for row in plain["gradient"]])
    return Evaluated(
        unit,
        np.array(numbers(plain["values"])),
        gradient.reshape(len(plain["values"]), -1),
        str(plain["why"]),
        int(plain["model_a"]),
        np.array(plain["by_print"], float),
        np.array(plain["by_resin"], float),
    )


def evaluate(
    unit: Unit,
    targets: Sequence[Target],
    freedoms: Sequence[Freedom],
    mechanics: Mechanics,
    with_gradient: bool = True,
    uncertainty: Uncertainty | None = None,
) -> Evaluated:
    """All targets' quantities of a unit, and their gradients by its continuous freedoms.

    A unit that cannot be meshed or cannot carry a pressure is an answer (`why`), not an error. uncertainty:
    of a print, for the values' standard errors. Raises InputError for targets that the mechanics cannot
    answer.
    """
    asked = [t for t in targets if t.quantity is not None]
    quantities = [t.quantity for t in asked if t.quantity is not None]
    count = sum(not f.discrete for f in freedoms)
    continuous = [f for f in freedoms if not f.discrete]
    continuous += uncertainty.freedoms(unit) if uncertainty else []
    values = np.full(len(targets), np.nan)
    gradient = np.full((len(targets), len(continuous)), np.nan)
    conditions = {c for q in quantities for c in q.conditions}
    body, simulated = UnitBody(unit, mechanics), len({WITHOUT, *(c.path for c in conditions)})
    rows = [i for i, t in enumerate(targets) if t.quantity is not None]
    try:
        states, _ = solve(body.structure, conditions)
        values[rows] = [q.value(body.structure, states) for q in quantities]
    except (ConvergenceError, MeshingError) as error:
        return Evaluated(unit, values, gradient[:, :count], error.what, simulated)
    if with_gradient and continuous:
        try:
            gradient[rows] = gradients(body.structure, states, quantities, body.pairs(continuous))
        except (MeshingError, InputError, IndefiniteError):
            # Beside a rule's limit or a folded mesh: the values stand, and the search goes on without slopes.
            gradient[:] = np.nan
    errors = uncertainty.errors(unit, gradient[:, count:]) if uncertainty else ()
    return Evaluated(unit, values, gradient[:, :count], "", simulated, *errors)


@attrs.frozen
class Candidate:
    """A unit to be evaluated, and the chosen path and resin by name."""

    unit: Unit
    choice: tuple[tuple[str, str], ...] = ()


Asked = tuple[Sequence[Target], Mechanics]


@attrs.define(eq=False)
class Evaluator:
    """Evaluates units, each once: from its cache if evaluated before, by this run or a killed one.

    origin: text of all inputs that decide a value besides the unit (targets, mesh, extended model); many:
    evaluates several candidates at a time, yielding their number and result; None: one after the other, here.
    uncertainty: as for `evaluate`. of_choice: targets and mechanics of a chosen path and resin; None: those
    given. computed: number of units simulated by this run, and model_a the solutions they took.
    """

    targets: Sequence[Target]
    freedoms: Sequence[Freedom]
    mechanics: Mechanics
    cache: Cache | None = None
    origin: str = ""
    many: Callable[[Sequence[Candidate]], Any] | None = None
    on_each: Callable[[Evaluated], None] = lambda found: None
    uncertainty: Uncertainty | None = None
    of_choice: Callable[[Mapping[str, str]], Asked] | None = None
    computed: int = 0
    model_a: int = 0

    def of(self, units: Sequence[Unit | Candidate]) -> list[Evaluated]:
        """Evaluations of some units, in their order."""
        candidates = [u if isinstance(u, Candidate) else Candidate(u) for u in units]
        found: list[Evaluated | None] = [self._kept(c) for c in candidates]
        todo = [i for i, known in enumerate(found) if known is None]
        for number, result in self._each([candidates[i] for i in todo]):
            self.computed += 1
            self.model_a += result.model_a
            found[todo[number]] = result
            if self.cache is not None:
                text = json.dumps(result.plain())
                self.cache.put("unit", self._key(candidates[todo[number]]), {"found": np.array(text)})
            self.on_each(result)
        return [result for result in found if result is not None]

    def _each(self, candidates: Sequence[Candidate]) -> Any:
        if self.many is not None and len(candidates) > 1:
            return self.many(candidates)
        return ((i, self._one(c)) for i, c in enumerate(candidates))

    def _one(self, c: Candidate) -> Evaluated:
        targets, mechanics = self.targets, self.mechanics
        if c.choice and self.of_choice is not None:
            targets, mechanics = self.of_choice(dict(c.choice))
        return evaluate(c.unit, targets, self.freedoms, mechanics, uncertainty=self.uncertainty)

    def _key(self, c: Candidate) -> str:
        own = c.choice or ""
        return key("optimise 3", attrs.evolve(c.unit, name="unit").hash(), self.origin, own)

    def _kept(self, c: Candidate) -> Evaluated | None:
        stored = None if self.cache is None else self.cache.get("unit", self._key(c))
        if stored is None:
            return None
        result = restored(c.unit, json.loads(str(stored["found"])))
        self.model_a += result.model_a
        return result
