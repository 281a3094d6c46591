"""Minimisation of the potential by damped steps, for starts from which no stable path leads on."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError
from .factor import IndefiniteError
from .line_search import LONGEST_STEP
from .model import MaterialData, Model
from .newton_settings import NewtonSettings
from .state import State

MOST_STEPS = 300
# Residual below which directions come from the exact tangent of self-contact. Further away its negative
# eigenvalues, of surfaces that would slip past each other, ask for a damping that hardly lets the body move.
EXACT_BELOW = 1e-4
# Shares of the undeformed body's tangent: the first, and below which there is none; by how much it grows and
# shrinks, and shares of the predicted decrease below and above which it does.
_FIRST, _LEAST, _MOST = 0.01, 1e-5, 1e4
_GROWS, _SHRINKS = 4.0, 1 / 3
_POOR, _GOOD = 0.1, 0.7
# A decrease below this share of the potential's parts is lost in rounding.
_ROUNDING = 1e-13


class Body(Protocol):
    """Model, its materials, its solver, and the tangent (nnz,) of the undeformed body.

    An `Equilibrium` is one.
    """

    model: Model
    parameters: MaterialData
    settings: NewtonSettings

    @property
    def factor(self) -> Any:
        """Factorisation, as `Model.factor`."""

    @property
    def rest_tangent(self) -> Array:
        """Values (nnz,) in N/mm, as `Model.tangent`."""


def damped_minimum(body: Body, start: Array, pressure_MPa: float) -> State:
    """The stable state at a pressure in MPa that damped motion from a start (n, 3) in mm leads to.

    Each step minimises the potential's quadratic model plus a share of the undeformed body's stiffness about
    the last iterate. This is a time step of a motion damped by that stiffness. The share is adapted to the
    model's accuracy (Levenberg and Marquardt). Steps end before surfaces touch. The cavity must be closed, so
    that its pressure has a potential. Raises ConvergenceError.
    """
    model, parameters, tolerance = body.model, body.parameters, body.settings.tolerance
    u, damping = start, _FIRST
    force, scale = _force(model, parameters, u, pressure_MPa)
    potential = model.potential(u, pressure_MPa, parameters)
    longest = LONGEST_STEP * float(np.ptp(model.mesh.nodes, axis=0).max())
    factorisations = 0
    for step_number in range(MOST_STEPS):
        level = float(np.linalg.norm(force))
        convex = model.has_convex_tangent and level > EXACT_BELOW * scale
        values = model.tangent(u, pressure_MPa, parameters, convex)
        if level <= tolerance * scale:
            try:
                body.factor.factor(values)
            except IndefiniteError:
                pass
            else:
                return State(pressure_MPa, u, level / scale, step_number, factorisations + 1)
        while True:
            if damping > _MOST:
                raise ConvergenceError("no step lowers the potential")
            try:
                factorisations += 1
                body.factor.factor(values + damping * body.rest_tangent if damping else values)
                step = -body.factor.solve(force)
            except IndefiniteError:
                damping = max(_GROWS * damping, _LEAST)
                continue
            far = float(np.abs(step).max())
            step *= min(1.0, longest / far if far else 1.0)
            moved = model.before_touch(u, model.moved(u, step))
            step = (moved - u).ravel()[model.free]
            found = model.potential(moved, pressure_MPa, parameters)
            after, new_scale = _force(model, parameters, moved, pressure_MPa)
            # Decrease by the two ends' forces, where the energy's own difference is rounding.
            by_forces = -0.5 * float((force + after) @ step)
            decrease = potential - found if abs(by_forces) > _ROUNDING * abs(potential) else by_forces
            expected = -float(force @ step)
            if np.isfinite(found) and decrease > _POOR * 0.5 * expected:
                break
            damping = max(_GROWS * damping, _LEAST)
        if decrease > _GOOD * 0.5 * expected:
            damping = damping * _SHRINKS if damping * _SHRINKS > _LEAST else 0.0
        u, force, scale, potential = moved, after, new_scale, found
    raise ConvergenceError(f"the motion does not come to rest within {MOST_STEPS} steps")


def _force(model: Model, parameters: MaterialData, u: Array, pressure_MPa: float) -> tuple[Array, float]:
    force = model.residual(u, pressure_MPa, parameters).ravel()[model.free]
    return force, model.force_scale()
