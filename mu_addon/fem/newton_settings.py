"""Tolerances and limits of Newton's method."""

from __future__ import annotations

import attrs


@attrs.frozen
class NewtonSettings:
    """Tolerances and limits of Newton's method; a state converges where the residual is below `tolerance`.

    Residuals are relative to the root sum of squares of all element forces. Load steps in MPa lie between
    min_step_MPa and `largest_step_MPa`. The other numbers are counts and ratios, see the comments.
    """

    tolerance: float = 1e-9  # residual over the root sum of squares of all element forces
    max_iterations: int = 60
    max_factorisations: int = 12
    # A factor is kept while each step with it shrinks the residual by at least this much: at 50k unknowns
    # a factorisation costs as much as eight steps.
    keep_factor: float = 0.7
    # Steps with the factor of an indefinite tangent: the undeformed body's share in it makes them short, and
    # a new factor would need that share again.
    indefinite_steps: int = 1
    max_step_MPa: float = 0.01
    max_suction_step_MPa: float = float("inf")  # below 0 MPa besides, where a body closes and its walls touch
    min_step_MPa: float = 1e-4
    # Load steps grow after one with at most so many factorisations, and shrink after one with over twice as
    # many.
    easy_factorisations: int = 12
    max_backtracks: int = 6
    # Shares of the undeformed body's tangent added, in turn, to an indefinite one.
    regularisation: tuple[float, ...] = (0.03, 0.3, 3.0, 30.0)
    # Continue a path beyond a limit point with the state that the body snaps to: the minimum of the potential
    # reached by damped motion from the limit point.
    follow_snaps: bool = False
    # A state may lie this much of the predicted move away from its prediction.
    predictor_tolerance: float = 0.5

    def largest_step_MPa(self, *pressure_MPa: float) -> float:
        """The largest step between these pressures in MPa, in MPa."""
        suction = min(pressure_MPa) < 0
        return min(self.max_step_MPa, self.max_suction_step_MPa) if suction else self.max_step_MPa


BODY_NEWTON = NewtonSettings(max_step_MPa=0.0025, easy_factorisations=2, max_iterations=40, follow_snaps=True)
"""For a body meshed strut by strut: single struts snap long before the body does."""

# Points that begin to touch change the tangent, so an old factor is soon of no use; and a body that is
# stopped ends far from where it was predicted.
CONTACT_NEWTON = NewtonSettings(keep_factor=0.2, max_factorisations=40, predictor_tolerance=3.0)

BODY_OBSTACLE_NEWTON: NewtonSettings = attrs.evolve(CONTACT_NEWTON, max_step_MPa=0.005, follow_snaps=True)
"""For a body meshed strut by strut near an obstacle: struts snap one by one long before the body does."""

# A body that closes ends far from its prediction, and steps that touch cut short are many.
SELF_CONTACT_NEWTON = NewtonSettings(
    keep_factor=0.8,
    indefinite_steps=8,
    max_factorisations=80,
    max_iterations=200,
    max_backtracks=12,
    predictor_tolerance=3.0,
)

BODY_CONTACT_NEWTON: NewtonSettings = attrs.evolve(
    SELF_CONTACT_NEWTON, max_suction_step_MPa=0.005, follow_snaps=True
)
"""For a body meshed strut by strut whose walls and struts touch."""
