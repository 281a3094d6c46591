"""Newton's method along a pressure path: adaptive steps, line search, and failures that are named."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_kPa
from ..errors import ConvergenceError
from .damped_descent import EXACT_BELOW, damped_minimum
from .factor import IndefiniteError
from .line_search import Descent
from .materials import Materials
from .model import Model
from .newton_settings import NewtonSettings
from .sparsity import Pattern
from .state import State, lagrange, rest

if TYPE_CHECKING:
    from .self_contact import SelfContact


LOWER = "lower the pressure, thicken the wall or stiffen the material"
"""Remedy where a body has no equilibrium at a pressure."""
# How much friction may still change with its lagged bound, as a share of it, and how often it may lag.
FRICTION_TOLERANCE = 1e-4
MOST_LAGS = 40
# Number of steps in which a weight is applied, where fewer do not suffice.
WEIGHT_STEPS = (1, 4, 16)
# Share of the way to a predicted state after which contact on it is checked.
SHARES_OF_WAY = (1 / 16, 1 / 4)


class Equilibrium:
    """Finds equilibria of one body with one set of materials, by Newton's method with line search.

    `at_zero_pressure` is the state without pressure, `newton` a state at a pressure from a nearby start,
    `reach` a state from earlier ones with adaptive load steps, `path` several in order. No state is returned
    that did not converge or is unstable: ConvergenceError gives the pressure, place and reason.

    settings: tolerances, by default a residual of 1e-9 of the root sum of squares of all element forces.
    """

    def __init__(
        self,
        model: Model,
        materials: Materials,
        settings: NewtonSettings | None = None,
    ) -> None:
        self.model = model
        self.settings = settings or NewtonSettings()
        self.parameters = model.parameters(materials)
        self._stiffening: tuple[Pattern, Array] | None = None

    @property
    def factor(self) -> Any:
        """Solver of the model; it is replaced when self-contact enlarges the tangent's pattern."""
        return self.model.factor

    @property
    def rest_tangent(self) -> Array:
        """Tangent of the undeformed body: positive definite, of the same pattern and similar stiffness."""
        if self._stiffening is None or self._stiffening[0] is not self.model.pattern:
            values = self.model.tangent(rest(self.model.mesh).u, 0.0, self.parameters)
            self._stiffening = self.model.pattern, values
        return self._stiffening[1]

    def _factorise(self, u: Array, pressure: float, convex: bool = False, first: int = 0) -> tuple[bool, int]:
        """Factorise the tangent; where it is indefinite, with a share of the undeformed body's added.

        Away from equilibrium a thin wall may be compressed beyond its buckling load although the equilibrium
        itself is stable. convex: as in `Model.tangent`; if the convex tangent of self-contact is needed and
        not requested, it is tried first. first: number of the share to begin with, 0 for none. Returns True
        if the requested tangent was definite, and the number of the added share.
        """
        touches = self.model.has_convex_tangent
        shares = 0.0, *self.settings.regularisation
        for with_convex in dict.fromkeys((convex, convex or touches)):
            values = self.model.tangent(u, pressure, self.parameters, with_convex)
            last = with_convex == (convex or touches)
            for number in range(first, len(shares)) if last else (0,):
                share = shares[number]
                try:
                    self.factor.factor(values + share * self.rest_tangent if share else values)
                    return with_convex == convex and number == 0, number
                except IndefiniteError:
                    continue
        raise ConvergenceError("the tangent is far from definite")

    def at_zero_pressure(self) -> State:
        """State without pressure: as drawn, or deformed by the model's load.

        Raises ConvergenceError where the body cannot carry its load.
        """
        model = self.model
        start, load = rest(model.mesh), model.load
        if load is None:
            return start
        failed: ConvergenceError | None = None
        for steps in WEIGHT_STEPS:
            try:
                state = start
                for step in range(1, steps + 1):
                    model.load = load * (step / steps)
                    state = self.newton(state.u, 0.0)
                return state
            except ConvergenceError as error:
                failed = error
            finally:
                model.load = load
        raise ConvergenceError(
            f"no equilibrium under gravity alone: {failed.what if failed else 'not computed'}",
            "0 kPa",
            "stiffen the material, or orient the unit with its tip down",
        )

    def newton(self, u: Array, pressure: float, reach_mm: float = np.inf, touches: bool = False) -> State:
        """Stable equilibrium at a pressure in MPa, from a start (n, 3) in mm that obeys the supports.

        With friction, an equilibrium with its own bound. Raises ConvergenceError if elements invert, progress
        stops, the equilibrium is unstable, or a component of the displacement differs from the start's by
        more than `reach_mm`. Self-contact is left out at first if no pair is within its gap, unless the body
        `touches` itself on the way that was predicted.
        """
        contact = self.model.self_contact
        if contact is not None and not (touches or contact.friction or contact.count(u)):
            self.model.self_contact = None
            try:
                state = self._newton(u, pressure, reach_mm, free_of=contact)
            except ConvergenceError:
                state = None
            finally:
                self.model.self_contact = contact
            if state is not None and contact.free_share(u, state.u) == 1.0 and not contact.count(state.u):
                return state
        return self._newton(u, pressure, reach_mm)

    def _newton(
        self, u: Array, pressure: float, reach_mm: float, free_of: SelfContact | None = None
    ) -> State:
        def found(start: State, again: bool) -> State:
            # The last factor is still about right where only friction's bound has moved.
            state = self._descend(start, factored=again, free_of=free_of)
            if np.abs(state.u - u).max() > reach_mm:
                raise ConvergenceError("the unit snaps to a distant equilibrium (limit point)")
            return state

        return self._with_friction(State(pressure, u), found)

    def _with_friction(self, state: State, found: Callable[[State, bool], State]) -> State:
        """The equilibrium from a start, with its own bound of friction.

        found: the equilibrium from a start with the bound held; its second argument is False at the first
        call. Raises ConvergenceError.
        """
        if self.model.self_contact is not None:
            self.model.self_contact.forget_candidates()
        contacts = self.model.remembering
        for contact in contacts:
            contact.lag_from_memory()
        for number in range(MOST_LAGS):
            state = found(state, number > 0)
            lag_change = max((contact.lag_change(state.u) for contact in contacts), default=0.0)
            if lag_change <= FRICTION_TOLERANCE:
                return state
            for contact in contacts:
                contact.update_lag(state.u)
        raise ConvergenceError(
            f"friction does not converge: it still changes by {lag_change:.1e} of its bound"
        )

    def _descend(self, start: State, factored: bool, free_of: SelfContact | None = None) -> State:
        """The equilibrium from a start, friction's bound held; its cost is added to the start's.

        factored: True if the existing factor is that of a definite tangent near this start. free_of: contact
        that the model leaves out; a search that needs further factors and has passed a touch ends with
        ConvergenceError, before it finds a body that passes through itself.
        """
        s, pressure = self.settings, start.pressure_MPa
        search = Descent(self.model, self.parameters, pressure, start.u, s)
        touches = self.model.has_convex_tangent
        factorisations, stale, definite, convex, added, steps = 0, not factored, True, False, 0, 0
        for iteration in range(s.max_iterations + 1):
            if search.converged:
                exact = definite and not convex
                if not exact and not self._factorise(search.u, pressure)[0]:
                    raise ConvergenceError("the equilibrium is unstable (limit point or buckling)")
                return State(
                    pressure,
                    search.u,
                    search.residual,
                    start.iterations + iteration,
                    start.factorisations + factorisations,
                )
            # The exact tangent converges in fewer steps, and is factorised at the end in any case.
            if stale or (convex and search.residual <= EXACT_BELOW):
                if factorisations == s.max_factorisations:
                    break
                convex = touches and search.residual > EXACT_BELOW
                if free_of is not None and factorisations and free_of.free_share(start.u, search.u) < 1.0:
                    raise ConvergenceError("the body passes through itself")
                # A little less than the last time may suffice now; starting from none costs a factorisation
                # each.
                definite, added = self._factorise(search.u, pressure, convex, max(added - 1, 0))
                factorisations += 1
                search.forget()
                steps = 0
            try:
                shrunk = search.move(search.direction(self.factor.solve))
            except IndefiniteError:
                # Iterative solvers may detect it only here.
                raise ConvergenceError("the tangent is not definite") from None
            steps += 1
            stale = shrunk > s.keep_factor if definite else steps == s.indefinite_steps
        raise ConvergenceError(f"no convergence with {factorisations} factorisations")

    def reach(self, target: float, history: Sequence[State]) -> State:
        """The state at a pressure in MPa, from converged states before it, the last of them the nearest.

        Steps are predicted and halved until they converge to where they were predicted, so that no snap to
        another branch passes for the path. If the smallest step fails and the settings allow it, the path
        continues beyond the limit point; such a state has `State.snapped_mm` > 0. Raises ConvergenceError
        naming pressure, place and cause otherwise.
        """
        s = self.settings
        if len(history) == 1:
            self.model.forget_contact()
        history = list(history[-3:])
        largest = s.largest_step_MPa(history[-1].pressure_MPa, target)
        step = np.clip(target - history[-1].pressure_MPa, -largest, largest)
        smooth = True
        while history[-1].pressure_MPa != target:
            last = history[-1]
            if abs(target - last.pressure_MPa) <= abs(step) * (1 + 1e-9):
                step = target - last.pressure_MPa
            pressure = target if step == target - last.pressure_MPa else last.pressure_MPa + step
            try:
                # A polynomial through states far apart is wrong about the slope at any step, the tangent is
                # right about the smallest.
                guess = self._predict(history if smooth else history[-1:], pressure)
                allowed = s.predictor_tolerance * np.abs(guess - last.u).max()
                start = self.start(last.u, guess)
                state = self.newton(start, pressure, allowed, touches=start is last.u)
            except ConvergenceError as why:
                smooth = False
                if abs(step) / 2 >= s.min_step_MPa:
                    step /= 2
                    continue
                if not s.follow_snaps:
                    raise self._failure(last, pressure, why.what) from None
                try:
                    history, smooth = [self.snapped(last, pressure)], True
                except ConvergenceError as none:
                    raise self._failure(last, pressure, none.what) from None
                continue
            history, smooth = [*history[-2:], attrs.evolve(state, snapped_mm=last.snapped_mm)], True
            if state.factorisations <= s.easy_factorisations:
                step = np.clip(2 * step, -largest, largest)
            elif state.factorisations > 2 * s.easy_factorisations:
                step /= 2
        return history[-1]

    def settled(self, u: Array, pressure: float) -> State:
        """The stable state at a pressure in MPa that damped motion from u (n, 3) in mm leads to.

        For starts far from equilibrium, see `damped_minimum`. The cavity must be closed, so that its pressure
        has a potential. With friction the bound is that of the state: the motion is repeated for each bound.
        Raises ConvergenceError if it leads to none.
        """

        def found(start: State, again: bool) -> State:
            if again:
                with contextlib.suppress(ConvergenceError):
                    return self._descend(start, factored=False)
            return damped_minimum(self, start.u, pressure)

        return self._with_friction(State(pressure, u), found)

    def snapped(self, last: State, pressure: float) -> State:
        """Stable state beyond a limit point, at a pressure in MPa, that the body snaps to from one before it.

        `State.snapped_mm` holds the distance. Raises ConvergenceError if there is none.
        """
        state = self.settled(last.u, pressure)
        moved = float(np.linalg.norm(state.u - last.u, axis=1).max())
        return attrs.evolve(state, snapped_mm=max(moved, last.snapped_mm))

    def start(self, u: Array, guess: Array) -> Array:
        """Start (n, 3) in mm: the prediction, or the last state u if surfaces would touch before it.

        A start cut short at the first touch would lie where the barrier's forces are largest.
        """
        # What touches early on a long way is found without the search of all that lies along it.
        for share in SHARES_OF_WAY:
            part = self.model.following(u + share * (guess - u))
            if self.model.before_touch(u, part) is not part:
                return u
        return guess if self.model.before_touch(u, guess) is guess else u

    def _predict(self, history: Sequence[State], pressure: float) -> Array:
        """Start at another pressure: along the tangent from one state, by extrapolation from several."""
        last = history[-1]
        if len(history) > 1:
            # A polynomial of turning sections leaves what they carry behind.
            known = [state.pressure_MPa for state in history], [state.u for state in history]
            return self.model.following(lagrange(*known, pressure))
        if not self._factorise(last.u, last.pressure_MPa)[0]:
            raise ConvergenceError("the state to start from is unstable")
        with_, without = (
            self.model.residual(last.u, p, self.parameters).ravel()[self.model.free]
            for p in (pressure, last.pressure_MPa)
        )
        return self.model.moved(last.u, self.factor.solve(without - with_))

    def path(
        self,
        pressures_MPa: Iterable[float],
        start: State,
        on_state: Callable[[State], None] | None = None,
    ) -> list[State]:
        """States at the given pressures in MPa, visited in order from a converged start.

        on_state: called with each state. Raises ConvergenceError as `reach`.
        """
        found = [start]
        for target in pressures_MPa:
            found.append(self.reach(target, found))
            if on_state:
                on_state(found[-1])
        return found[1:]

    def _failure(self, last: State, pressure: float, why: str) -> ConvergenceError:
        if "limit point" not in why:
            why += "; it may have passed a limit point, or buckles"
        least, element = self.model.smallest_jacobian(last.u, self.parameters)
        nodes = self.model.mesh.tets[element]
        place = (self.model.mesh.nodes[nodes] + last.u[nodes]).mean(axis=0)
        return ConvergenceError(
            f"no equilibrium at {in_kPa(pressure):.4g} kPa: {why}",
            f"the last converged state is {last.pressure_kPa:.4g} kPa; its most distorted element is "
            f"{element} near ({place[0]:.1f}, {place[1]:.1f}, {place[2]:.1f}) mm with det F = {least:.3g}",
            LOWER,
        )
