"""Reduced, linear response of a unit to a path of steps of its lattice, without solving for the path.

Forces of each step's patterns of deformation are applied to Model A's tangent once; any chain of steps is
then a small dense system.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..fem.factor import Cholesky, SuperLU
from ..fem.model import Model
from ..fem.triangular import Triangular
from .graph import Graph
from .sampling import polynomials

# Patterns solved at once, so that their solutions need not all be held.
BLOCK = 128


@attrs.frozen(eq=False)
class Response:
    """Reduced response of a unit to any chain of its graph's steps.

    For each of s states, at pressure_MPa (s,): flexibility (s, q, q) between all patterns, drive (s, q) the
    work of each pattern's forces under Model A's deformation, and reach (s, p, 3, q), the displacement in mm
    of the monitored points. stiffness (q,): the sensor's own, pattern by pattern; a step has as many
    `patterns`, in the order of the graph's steps.
    """

    graph: Graph
    pressure_MPa: Array
    flexibility: Array
    drive: Array
    reach: Array
    stiffness: Array
    patterns: int

    def displacements(
        self, chains: Sequence[tuple[int, ...]], pressures_MPa: Array, block: int = 512
    ) -> Array:
        """Displacement (c, t, p, 3) in mm of the monitored points by each of c chains, against Model A.

        pressures_MPa (t,): the response is a polynomial in the pressure through its states and through 0,
        where the deviation is 0. block: chains solved at once. Raises KeyError for a chain that is not the
        graph's.
        """
        moved = self._at_states(chains, block)
        return np.einsum("ts,cspi->ctpi", polynomials(self.pressure_MPa, pressures_MPa), moved)

    def _at_states(self, chains: Sequence[tuple[int, ...]], block: int) -> Array:
        found = np.empty((len(chains), len(self.pressure_MPa), *self.reach.shape[1:3]))
        steps = [self.graph.steps_of(chain) for chain in chains]
        length = np.array([len(s) for s in steps])
        for count in np.unique(length):
            rows = np.flatnonzero(length == count)
            for part in np.array_split(rows, -(-len(rows) // block)):
                found[part] = self._of_equal_length(np.array([steps[i] for i in part]))
        return found

    def _of_equal_length(self, steps: Array) -> Array:
        """Displacement (c, s, p, 3) in mm by chains of as many steps each, (c, h)."""
        k = self.patterns
        chains = len(steps)
        rows = (steps[:, :, None] * k + np.arange(k)).reshape(chains, -1)
        found = np.empty((chains, len(self.pressure_MPa), *self.reach.shape[1:3]))
        for s in range(len(self.pressure_MPa)):
            system = self.flexibility[s][rows[:, :, None], rows[:, None, :]]
            system[:, range(rows.shape[1]), range(rows.shape[1])] += self.stiffness[rows]
            force = np.linalg.solve(system, self.drive[s][rows][:, :, None])[:, :, 0]
            found[:, s] = -np.einsum("pick,ck->cpi", self.reach[s][:, :, rows], force)
        return found


def solver_of(model: Model, tangent: Array) -> Callable[[Array], Array]:
    """Return a function that solves with a tangent for right-hand sides (k, n), together if possible."""
    factor = model.factor.factor(tangent)
    if isinstance(factor, Cholesky | SuperLU):
        return Triangular(factor.lower(), threads=model.threads).solve
    return lambda b: factor.solve(b.T).T
