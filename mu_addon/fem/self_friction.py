"""Coulomb friction of a body's surface on itself: slip within a step, under a bound that lags."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array


class SelfFriction:
    """Friction between pieces of a surface that slide on each other, as a term of `SelfContact`.

    coefficient: Coulomb's. slip_mm, e: friction grows with the slip s since the last committed state as 2 s/e
    - (s/e)^2, up to the coefficient times the barrier's force from a slip of e on (Li et al., ACM Trans.
      Graph. 39 (2020) 49, of displacements in place of velocities). Sticking points therefore move by less
      than e in every step, also under constant load. Pairs of facets, their normals and forces are those of
      an earlier iterate, as in `Obstacle`, so that energy, force and tangent are consistent.

    ipctk, surface, barrier: the library, its mesh of the surface and its potential of the normal forces. All
    places are (v, 3) in mm of the surface's v nodes, by columns, pairs ipctk's. lost_mJ: energy dissipated up
    to the last committed state.
    """

    def __init__(self, ipctk: Any, surface: Any, barrier: Any, coefficient: float, slip_mm: float) -> None:
        self.coefficient = coefficient
        self._ipctk, self._surface, self._barrier = ipctk, surface, barrier
        self._potential = ipctk.FrictionPotential(slip_mm)
        self.lost_mJ = 0.0
        self.recall(np.asfortranarray(surface.rest_positions), ipctk.NormalCollisions())

    def recall(self, places: Array, pairs: Any, lost_mJ: float = 0.0) -> None:
        """Set the last committed state, the energy dissipated up to it, and the lag's state."""
        self._before, self._remembered, self.lost_mJ = places, self._lagged(places, pairs), lost_mJ
        self.lag_from_memory()

    def lag_from_memory(self) -> None:
        """Take the sliding pairs and their normal forces from the last committed state."""
        self._lag = self._remembered

    def update_lag(self, places: Array, pairs: Any) -> None:
        """Update the sliding pairs and their normal forces to other positions."""
        self._lag = self._lagged(places, pairs)

    def lag_change(self, places: Array, pairs: Any) -> float:
        """Change of friction's forces if the lag followed to some positions, over the sum of their bounds."""
        old, new = (self._gradient(lag, places) for lag in (self._lag, self._lagged(places, pairs)))
        change = float(np.linalg.norm(new - old, axis=1).sum())
        if not len(pairs):
            return float(change > 0)
        normal = self._barrier.gradient(pairs, self._surface, places).reshape(-1, 3)
        return change / (self.coefficient * float(np.linalg.norm(normal, axis=1).sum()))

    def commit(self, places: Array, pairs: Any) -> None:
        """Make a converged state the last committed one; friction times slip is added to `lost_mJ`."""
        lost = float((self._gradient(self._lag, places) * (places - self._before)).sum())
        self.recall(places, pairs, self.lost_mJ + lost)

    def energy_mJ(self, places: Array) -> float:
        """Energy dissipated by sliding in this step, in mJ, as in the potential."""
        if not len(self._lag):
            return 0.0
        return float(self._potential(self._lag, self._surface, self._slip(places)))

    def gradient_N(self, places: Array) -> Array:
        """The energy's derivative by the places, (v, 3) in N."""
        return self._gradient(self._lag, places)

    def hessian(self, places: Array, method: Any) -> Any:
        """Second derivative in N/mm, sparse (3 v, 3 v), pair by pair as ipctk's projection method has it."""
        return self._potential.hessian(self._lag, self._surface, self._slip(places), method).tocoo()

    @property
    def has_pairs(self) -> bool:
        """Return True if any pair was within the gap in the lag's state."""
        return len(self._lag) > 0

    def _slip(self, places: Array) -> Array:
        return np.asfortranarray(places - self._before)

    def _lagged(self, places: Array, pairs: Any) -> Any:
        found = self._ipctk.TangentialCollisions()
        found.build(self._surface, places, pairs, self._barrier, self.coefficient)
        return found

    def _gradient(self, lag: Any, places: Array) -> Array:
        if not len(lag):
            return np.zeros_like(places)
        gradient: Array = self._potential.gradient(lag, self._surface, self._slip(places))
        return gradient.reshape(-1, 3)
