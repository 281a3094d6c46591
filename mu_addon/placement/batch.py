"""Batches of candidates on one mesh: at each state of Model A, all sensors by a batched Newton method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..fem.batched_newton import BatchedNewton, Variant
from ..fem.kinematics import Probe
from ..fem.laws import NeoHooke
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.newton_settings import CONTACT_NEWTON, NewtonSettings
from ..fem.state import State, as_far_as_found
from ..fem.time_stepping import simulate_in_time

Array = np.ndarray[Any, Any]


class CandidateBatch:
    """Many candidate sensors in one unit, solved together: displacement of the monitored points by each.

    At every state of Model A (the unit without a sensor) all candidates share one factorisation (batched
    Newton). shares: for each sensor the share (m,) of every element that it fills.
    monitored: points (p, 3) in mm of the backbone and their probe. sensor_MPa: Young's modulus of the sensor.
    settings: of Newton's method.
    """

    def __init__(
        self,
        model: Model,
        materials: Materials,
        monitored: tuple[Array, Probe],
        shares: Sequence[Array],
        sensor_MPa: float,
        settings: NewtonSettings | None = None,
    ) -> None:
        _, poisson = materials.small_strain(len(model.mesh.tets))
        stiff = NeoHooke.parameters(np.full(len(poisson), sensor_MPa), poisson)
        self._points, self._probe = monitored
        self._batched_newton = BatchedNewton(
            model, materials, [Variant(s, NeoHooke, stiff) for s in shares], settings
        )

    def alone(self, number: int, pressures_MPa: Array) -> Array:
        """Monitored points (s, p, 3) in mm of one sensor's unit along its whole path through some pressures.

        pressures_MPa (s,): visited in order from the state without pressure, as far as there is an
        equilibrium; ConvergenceError if at none of them.
        """
        one = self._batched_newton.alone(number)
        start = one.at_zero_pressure()
        return self.points(as_far_as_found(lambda keep: one.path(pressures_MPa, start, keep)))

    def simulated_in_time(self, number: int, time_s: Array, pressure_kPa: Array) -> Array:
        """Monitored points (k, p, 3) in mm of one sensor's unit at k instants, in the order of time.

        time_s (k,) ascending, pressure_kPa (k,). For models with history: friction on obstacles, or a law
        with history. As far as there is an equilibrium; raises ConvergenceError if at no instant, and
        InputError where time runs backward.
        """
        one = self._batched_newton.alone(number)
        one.settings = CONTACT_NEWTON
        return self.points(as_far_as_found(lambda keep: simulate_in_time(one, time_s, pressure_kPa, keep)))

    def at(self, state: State) -> Array:
        """Monitored points (sensors, p, 3) in mm of every sensor's unit, at a state of Model A.

        They are at that state's pressure. Raises ConvergenceError where a sensor's unit has no equilibrium
        that continues Model A's.
        """
        return self.points(self.states(state))

    def states(self, state: State) -> list[State]:
        """Each sensor's state at the pressure of a state of Model A. Raises ConvergenceError, as `at`."""
        return self._batched_newton.at(state)

    def points(self, states: Sequence[State]) -> Array:
        """Monitored points (s, p, 3) in mm of some states."""
        return np.array([self._points + self._probe.displacement(s.u) for s in states])
