"""One search for an equilibrium: its iterate, the steps taken so far, and the line search."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import ConvergenceError
from .model import MaterialData, Model
from .newton_settings import NewtonSettings

Array = np.ndarray[Any, Any]


class Descent:
    """Minimises the potential at one pressure by quasi-Newton steps from a start (n, 3) in mm.

    The steps are BFGS's (Nocedal, Math. Comp. 35 (1980) 773) from whatever factor the caller solves
    with. Raises ConvergenceError where the start inverts an element.
    """

    def __init__(
        self, model: Model, parameters: MaterialData, pressure_MPa: float, u: Array, settings: NewtonSettings
    ) -> None:
        self.model, self.parameters, self.pressure, self.settings = model, parameters, pressure_MPa, settings
        self.u = u
        self.force, self.scale = self._out_of_balance(u)
        self.level = float(np.linalg.norm(self.force))
        self.potential = model.potential(u, pressure_MPa, parameters)
        if not np.isfinite(self.potential):
            raise ConvergenceError("the predicted state inverts an element")
        self._secants: list[tuple[Array, Array, float]] = []

    @property
    def converged(self) -> bool:
        """Whether the residual is within the tolerance."""
        return self.level <= self.settings.tolerance * self.scale

    @property
    def residual(self) -> float:
        """Residual over the root sum of squares of all element forces."""
        return self.level / self.scale if self.scale else 0.0

    def forget(self) -> None:
        """Drop the steps taken: they belong to another factor."""
        self._secants = []

    def direction(self, solve: Callable[[Array], Array]) -> Array:
        """Step (free unknowns) in mm with a solver of the factorised tangent."""
        force, shares = self.pulled_back()
        return self.pushed_forward(solve(force), shares)

    def pulled_back(self) -> tuple[Array, list[float]]:
        """The right-hand side of the factorised system, and the shares of each secant taken off it."""
        force = self.force.copy()
        shares = []
        for s, y, r in reversed(self._secants):
            shares.append(r * float(s @ force))
            force -= shares[-1] * y
        return force, shares

    def pushed_forward(self, solved: Array, shares: list[float]) -> Array:
        """Step (free unknowns) in mm of the solution for `pulled_back`."""
        step = solved
        for (s, y, r), share in zip(self._secants, reversed(shares), strict=True):
            step = step + s * (share - r * float(y @ step))
        return -step

    def move(self, step: Array) -> float:
        """Go along a step as far as it helps; returns the residual's new level over the old one.

        Raises ConvergenceError where no length lowers the energy.
        """
        model, s = self.model, self.settings
        slope = float(self.force @ step)
        length = 1.0
        for _ in range(s.max_backtracks):
            trial = self.u.copy()
            trial.ravel()[model.free] += length * step
            force, scale = self._out_of_balance(trial)
            level = float(np.linalg.norm(force))
            # A residual that shrinks fast needs no other proof (it is not a number where an element is
            # inverted), and near the solution the energy's change drowns in rounding.
            if level < 0.5 * self.level:
                self.potential = np.nan
                break
            if np.isnan(self.potential):
                self.potential = model.potential(self.u, self.pressure, self.parameters)
            energy = model.potential(trial, self.pressure, self.parameters)
            if energy <= self.potential + 1e-4 * length * slope:
                self.potential = energy
                break
            length /= 2
        else:
            raise ConvergenceError("the line search found no lower energy")
        ratio = level / self.level
        moved, change = length * step, force - self.force
        if moved @ change > 0:
            self._secants.append((moved, change, 1.0 / float(moved @ change)))
        self.u, self.force, self.scale, self.level = trial, force, scale, level
        return ratio

    def _out_of_balance(self, u: Array) -> tuple[Array, float]:
        force = self.model.residual(u, self.pressure, self.parameters).ravel()[self.model.free]
        return force, self.model.force_scale()
