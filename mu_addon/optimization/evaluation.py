"""Evaluation of all targets of a unit from one Model A, with gradients."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from ..errors import ConvergenceError, InputError, MeshingError
from ..fem.factor import IndefiniteError
from .freedoms import Freedom
from .gradient import gradients
from .structure import WITHOUT, solve
from .targets import Target
from .uncertainty import Uncertainty
from .unit_body import Mechanics, UnitBody


@attrs.frozen(eq=False)
class Evaluated:
    """Evaluation of one unit.

    values (q,) of the targets' quantities, nan where it failed; gradient (q, f) by the continuous freedoms,
    nan where there is none; why: the reason of a failure, else ""; model_a: number of solutions of the unit
    along its path, one for each body simulated. by_print, by_resin (q,): standard errors of the values, 0
    where none were asked for.
    """

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
        return Evaluated(values, gradient[:, :count], error.what, simulated)
    if with_gradient and continuous:
        try:
            gradient[rows] = gradients(body.structure, states, quantities, body.pairs(continuous))
        except (MeshingError, InputError, IndefiniteError):
            # Beside a rule's limit or a folded mesh: the values stand, and the search goes on without slopes.
            gradient[:] = np.nan
    errors = uncertainty.errors(unit, gradient[:, count:]) if uncertainty else ()
    return Evaluated(values, gradient[:, :count], "", simulated, *errors)
