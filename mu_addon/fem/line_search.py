"""One search for an equilibrium: its iterate, the steps taken so far, and the line search."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError
from .model import MaterialData, Model
from .newton_settings import NewtonSettings

LONGEST_STEP = 0.025
"""Largest move of a node in a step, as a share of the body's longest side, where steps are limited."""


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
        # Walls and struts that are about to buckle or to slide past each other ask for moves longer than a
        # strut: each costs a search of all that lies on the way, and leads far off the path.
        touches = model.self_contact is not None
        self._longest = LONGEST_STEP * float(np.ptp(model.mesh.nodes, axis=0).max()) if touches else np.inf

    @property
    def converged(self) -> bool:
        """Return True if `residual` is within the settings' tolerance."""
        return self.level <= self.settings.tolerance * self.scale

    @property
    def residual(self) -> float:
        """Norm of the out-of-balance forces over the root sum of squares of all element forces.

        Forces on free unknowns only; 0 where there are no element forces.
        """
        return self.level / self.scale if self.scale else 0.0

    def forget(self) -> None:
        """Drop the steps so far: they are of another factor."""
        self._secants = []

    def direction(self, solve: Callable[[Array], Array]) -> Array:
        """BFGS step (f,) in mm of the f free unknowns.

        solve: maps right-hand sides (f,) in N to solutions (f,) in mm with the factorised tangent.
        """
        force, shares = self.pulled_back()
        return self.pushed_forward(solve(force), shares)

    def pulled_back(self) -> tuple[Array, list[float]]:
        """First half of the BFGS two-loop recursion (Nocedal 1980), newest step first.

        Returns the right-hand side (f,) in N for the factorised tangent, and the coefficient of each earlier
        step, for `pushed_forward`.
        """
        force = self.force.copy()
        shares = []
        for s, y, r in reversed(self._secants):
            shares.append(r * float(s @ force))
            force -= shares[-1] * y
        return force, shares

    def pushed_forward(self, solved: Array, shares: list[float]) -> Array:
        """Second half of the recursion: the step (f,) in mm of the factorised tangent's solution (f,) in mm.

        solved, shares: the solution for the result of `pulled_back`, and its coefficients.
        """
        step = solved
        for (s, y, r), share in zip(self._secants, reversed(shares), strict=True):
            step = step + s * (share - r * float(y @ step))
        return -step

    def move(self, step: Array) -> float:
        """Take the share of a step (f,) in mm that reduces the residual; return its new norm over the old
        one.

        The step is halved until the residual halves or the potential falls enough (Armijo). Raises
        ConvergenceError where no length tried does either. With self-contact a step ends before a touch and
        moves no node by more than `LONGEST_STEP`.
        """
        model, s = self.model, self.settings
        far = float(np.abs(step).max())
        if far > self._longest:
            step = step * (self._longest / far)
        slope = float(self.force @ step)
        length = 1.0
        if model.self_contact is not None:
            length = model.self_contact.free_share(self.u, model.moved(self.u, step))
        for _ in range(s.max_backtracks):
            trial = model.moved(self.u, length * step)
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
