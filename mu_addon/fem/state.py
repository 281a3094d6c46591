"""States of a body in equilibrium, and the undeformed one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_kPa
from ..errors import ConvergenceError
from ..meshing.mesh import Mesh


@attrs.frozen(eq=False)
class State:
    """A converged equilibrium: pressure in MPa, displacement u (n, 3) in mm, relative residual, and its cost.

    residual: over the root sum of squares of all element forces; iterations, factorisations: their numbers.
    snapped_mm: largest displacement of a node at a limit point before the state, 0 on a smooth path.

    >>> import numpy as np
    >>> State(0.02, np.zeros((4, 3))).pressure_kPa
    20.0
    """

    pressure_MPa: float
    u: Array
    residual: float = 0.0
    iterations: int = 0
    factorisations: int = 0
    snapped_mm: float = 0.0

    @property
    def pressure_kPa(self) -> float:
        """Pressure in kPa, as files and people have it."""
        return in_kPa(self.pressure_MPa)

    @property
    def loaded(self) -> bool:
        """True if pressure or weight acts on the body: the pressure or a displacement is not 0."""
        return bool(self.pressure_MPa) or bool(self.u.any())


def lagrange(places: Sequence[float], values: Sequence[Array], at: float) -> Array:
    """Value at a place of Lagrange's polynomial through values at some places, arrays of one shape.

    >>> lagrange([0.0, 1.0, 2.0], [np.array([0.0]), np.array([1.0]), np.array([4.0])], 3.0).tolist()
    [9.0]
    """
    found = np.zeros_like(values[0])
    for n, (a, value) in enumerate(zip(places, values, strict=True)):
        found += np.prod([(at - b) / (a - b) for b in [*places[:n], *places[n + 1 :]]]) * value
    return found


def rest(mesh: Mesh) -> State:
    """Undeformed, unloaded state of a mesh: zero displacement at zero pressure.

    A body with weight has no such state; use `Equilibrium.at_zero_pressure`.
    """
    return State(0.0, np.zeros_like(mesh.nodes))


def as_far_as_found(solve: Callable[[Callable[[State], None]], object]) -> list[State]:
    """States of a solution up to the first that it does not find; ConvergenceError if it finds none.

    solve: raises ConvergenceError, and calls the function it is given with each state before that.
    """
    found: list[State] = []
    try:
        solve(found.append)
    except ConvergenceError:
        if not found:
            raise
    return found
