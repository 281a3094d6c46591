"""One step along a branch of equilibria: displacement and pressure corrected together.

Lengths along the branch are measured as ds^2 = |du|^2/n + (c dp)^2, in mm: n free unknowns, and c the root
mean square of du/dp where the branch starts, so that both move it alike there. A point is fixed by the
plane at a length along the tangent (Keller, in: Applications of Bifurcation Theory, 1977; Riks, J. Appl.
Mech. 39 (1972) 1060), or by its pressure, or by its cavity's volume.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, Protocol

import attrs
import numpy as np

from ..errors import ConvergenceError
from .indefinite import Inertia
from .model import MaterialData, Model
from .newton_settings import NewtonSettings
from .state import State

Array = np.ndarray[Any, Any]


@attrs.frozen
class ContinuationSettings:
    """Step lengths of arc-length continuation, and how accurately critical points are located.

    first_step_MPa: change of pressure of the first step. max_points: of a branch; max_iterations: of one
    point. keep_factor, predictor_tolerance, min_step and accuracy are ratios, turn is an angle in radians.
    """

    first_step_MPa: float = 0.002
    max_points: int = 100
    max_iterations: int = 15
    # A factor is kept while each step with it shrinks the residual by at least this much.
    keep_factor: float = 0.6
    # The branch's direction shall turn by about this angle, in rad, from point to point.
    turn: float = 0.25
    # A point may lie this share of the step away from its prediction.
    predictor_tolerance: float = 0.3
    # The smallest step, as a share of the first.
    min_step: float = 1e-3
    # Relative accuracy of the pressure of a critical point.
    accuracy: float = 1e-6


@attrs.frozen(eq=False)
class Point:
    """A converged equilibrium on a branch.

    volume_mm3: of the cavity. negative: negative eigenvalues of the tangent, 0 where the point is stable
    at its pressure. slope: change of pressure along the branch, in MPa/mm; compliance: of volume with
    pressure, in mm3/MPa.
    """

    state: State
    volume_mm3: float
    negative: int
    slope: float
    compliance: float

    @property
    def stable(self) -> bool:
        """True if the point is stable at its pressure."""
        return self.negative == 0


@attrs.frozen(eq=False)
class Node:
    """A point as z (n + 1,), the n free displacements in mm and then the pressure in MPa.

    direction (n + 1,): unit tangent of the branch there, in the metric of `Arc.product`; bend (n + 1,):
    change of direction with length along the branch in mm.
    """

    point: Point
    z: Array
    direction: Array
    bend: Array

    def reversed(self) -> Node:
        """The same point with the branch's direction and its `slope` of pressure turned round."""
        point = attrs.evolve(self.point, slope=-self.point.slope)
        return attrs.evolve(self, point=point, direction=-self.direction)


# What fixes a point: its gap and the gradient (n + 1,) of that, of z and the residual's slope in pressure.
Condition = Callable[[Array, Array], tuple[float, Array]]


class Body(Protocol):
    """Model, its materials on the device, and the tolerances of its states, as a branch is traced for.

    An `Equilibrium` is one.
    """

    model: Model
    parameters: MaterialData
    settings: NewtonSettings


class Arc:
    """Finds the points of one branch of equilibria of a body that begins at a converged state.

    Lengths along the branch are in mm, pressures in MPa. Each new point costs factorisations of the tangent,
    counted in its state.
    """

    def __init__(self, body: Body, start: State, settings: ContinuationSettings) -> None:
        self.model, self.parameters = body.model, body.parameters
        self.tolerance = body.settings.tolerance
        self.settings = settings
        self.inertia = Inertia(self.model)
        self._start = start
        self._linear = False
        self._size = len(self.model.free)
        self._metric = np.full(self._size + 1, 1 / self._size)

    def begin(self) -> Node:
        """The start as a node whose direction leads to higher pressure; also sets the metric of `product`.

        Raises ConvergenceError where the start is no equilibrium or its tangent is singular.
        """
        z = np.append(self._start.u.ravel()[self.model.free], self._start.pressure_MPa)
        force, scale = self._force(z)
        if np.linalg.norm(force) > self.tolerance * scale:
            raise ConvergenceError("a branch can only be followed from a converged state")
        self._linearise(z)
        per_MPa = self._per_MPa
        # Where pressure moves nothing, any weight is valid.
        self._metric[-1] = (per_MPa @ per_MPa) / self._size or 1.0
        return self._node(z, np.append(per_MPa, 1.0), self._start.residual, 0, 1)

    def advance(self, node: Node, length: float) -> Node:
        """The node a positive length in mm ahead of a node.

        Raises ConvergenceError where the correction fails, or ends farther from its prediction than the
        predictor tolerance times the length.
        """
        predicted = node.z + length * node.direction + length**2 / 2 * node.bend
        row = self._metric * node.direction

        def condition(z: Array, _: Array) -> tuple[float, Array]:
            return float(row @ (z - predicted)), row

        new = self._correct(predicted, condition, node)
        off = new.z - predicted
        if np.sqrt(self.product(off, off)) > self.settings.predictor_tolerance * length:
            raise ConvergenceError("the branch bends away, or another one is near")
        return attrs.evolve(new, bend=(new.direction - node.direction) / length)

    def at_pressure(self, before: Node, after: Node, pressure: float) -> Node:
        """The node at a pressure in MPa between two nodes, started from linear interpolation.

        Raises ConvergenceError where the correction fails.
        """
        ends = before.z[-1], after.z[-1]
        row = np.append(np.zeros(self._size), 1.0)
        guess = _between(before, after, ends, pressure)
        return self._correct(guess, lambda z, _: (z[-1] - pressure, row), after)

    def at_volume(self, before: Node, after: Node, volume: float) -> Node:
        """The node at a cavity volume in mm3 between two nodes, started from linear interpolation.

        Raises ConvergenceError where the correction fails.
        """
        ends = before.point.volume_mm3, after.point.volume_mm3

        def condition(z: Array, force_per_MPa: Array) -> tuple[float, Array]:
            # The residual's slope in pressure is minus the volume's in displacement: both are the
            # mixed derivative of the potential.
            gap = self.model.cavity_volume(self._displacement(z)) - volume
            return gap, np.append(-force_per_MPa, 0.0)

        return self._correct(_between(before, after, ends, volume), condition, after)

    def product(self, a: Array, b: Array) -> float:
        """Inner product in mm2 of two changes a and b (n + 1,) of z: |du|^2/n + (c dp)^2, see the module."""
        return float((self._metric * a) @ b)

    def softest(self, z: Array) -> tuple[float, Array]:
        """The tangent's eigenvalue nearest zero at z (n + 1,), in N/mm, and its eigenvector (nodes, 3).

        The eigenvector is scaled so that the node which moves most moves by 1. Raises ConvergenceError where
        the tangent is singular or the eigenvalue is not found.
        """
        self._factor(z)
        try:
            stiffness, modes = self.inertia.modes(1)
        except ArithmeticError as why:
            raise ConvergenceError(str(why)) from None
        mode = self.model.moved(np.zeros_like(self._start.u), modes[:, 0])
        return float(stiffness[0]), mode / np.linalg.norm(mode, axis=1).max()

    def _displacement(self, z: Array) -> Array:
        u = self._start.u.copy()
        u.ravel()[self.model.free] = z[:-1]
        return self.model.following(u)

    def _check_way(self, z: Array, to: Array) -> None:
        """Raise ConvergenceError for a step in which the surface would intersect itself."""
        contact = self.model.self_contact
        if contact is not None and contact.free_share(self._displacement(z), self._displacement(to)) < 1:
            raise ConvergenceError("the surface would meet itself within the step")

    def _force(self, z: Array) -> tuple[Array, float]:
        force = self.model.residual(self._displacement(z), z[-1], self.parameters).ravel()[self.model.free]
        return force, self.model.force_scale()

    def _factor(self, z: Array, thorough: bool = True) -> None:
        self._linear = False
        try:
            tangent = self.model.tangent(self._displacement(z), z[-1], self.parameters)
            self.inertia.factor(tangent, thorough)
        except ArithmeticError as why:
            raise ConvergenceError(str(why)) from None

    def _linearise(self, z: Array, thorough: bool = True) -> None:
        """Factorise the tangent at z; return the derivatives of residual and displacement by pressure."""
        self._factor(z, thorough)
        # The residual is affine in pressure.
        unit = np.append(np.zeros(self._size), 1.0)
        self._force_per_MPa = self._force(z + unit)[0] - self._force(z)[0]
        self._per_MPa = self.inertia.solve(-self._force_per_MPa)
        self.inertia.suspect(self._per_MPa)
        self._linear = True

    def _correct(self, z: Array, condition: Condition, near: Node) -> Node:
        """The point that meets a condition, from a prediction z, by Broyden's method.

        One factor serves while that pays, first that of the last equilibrium found: a tangent away from
        equilibrium may be far from definite. Sources: block elimination of the bordered system, Crisfield,
        Comput. Struct. 13 (1981) 55; Broyden's steps from each other, Kelley, Iterative Methods for Linear
        and Nonlinear Equations (SIAM 1995), algorithm brsola.
        """
        s = self.settings
        begun, before = self.inertia.factorisations, np.inf
        if not self._linear:
            self._linearise(near.z)
        # An interruption must not leave a factor of an intermediate state.
        self._linear = False
        steps: list[Array] = []
        self._check_way(near.z, z)
        for iteration in range(s.max_iterations):
            force, scale = self._force(z)
            level = float(np.linalg.norm(force))
            if not np.isfinite(level):
                raise ConvergenceError("an element inverts")
            converged = level <= self.tolerance * scale
            if iteration and not converged and level > s.keep_factor * before:
                self._linearise(z, thorough=False)
                self._linear, steps = False, []
            gap, row = condition(z, self._force_per_MPa)
            if converged and abs(gap) <= 1e-9 * np.linalg.norm(row) * np.linalg.norm(z):
                self._linearise(z)
                cost = self.inertia.factorisations - begun
                return self._node(z, near.direction, level / scale if scale else 0.0, iteration, cost)
            by_force = self.inertia.solve(-force)
            along = float(row[:-1] @ self._per_MPa + row[-1])
            pressure = -(gap + row[:-1] @ by_force) / along
            step = np.append(by_force + pressure * self._per_MPa, pressure)
            for a, b in itertools.pairwise(steps):
                step += b * (self.product(a, step) / self.product(a, a))
            if steps:
                last = steps[-1]
                step /= 1 - self.product(last, step) / self.product(last, last)
            steps.append(step)
            self._check_way(z, z + step)
            z, before = z + step, level
        raise ConvergenceError("no convergence")

    def _node(self, z: Array, ahead: Array, residual: float, iterations: int, factorisations: int) -> Node:
        """Node at z, where the tangent has just been factorised; its direction is the one `ahead`."""
        u, pressure = self._displacement(z), float(z[-1])
        if not np.isfinite(self.model.potential(u, pressure, self.parameters)):
            raise ConvergenceError("an element inverts")
        direction = np.append(self._per_MPa, 1.0)
        direction /= np.sqrt(self.product(direction, direction))
        direction *= np.sign(self.product(direction, ahead)) or 1.0
        point = Point(
            State(pressure, u, residual, iterations, factorisations),
            self.model.cavity_volume(u),
            self.inertia.negative,
            float(direction[-1]),
            -float(self._force_per_MPa @ self._per_MPa),
        )
        return Node(point, z, direction, np.zeros_like(z))


def _between(before: Node, after: Node, ends: tuple[float, float], target: float) -> Array:
    share = (target - ends[0]) / (ends[1] - ends[0])
    return np.asarray(before.z + share * (after.z - before.z))
