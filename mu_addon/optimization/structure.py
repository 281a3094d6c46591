"""A body for one choice of freedoms, and its equilibria under the pressures of its quantities."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_MPa
from ..errors import InputError
from ..fem.equilibrium import Equilibrium
from ..fem.held_tip import HeldTip
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.newton_settings import NewtonSettings
from ..fem.state import State, rest

WALL_STEPS = 4
"""Number of steps in which a tip is moved to the wall that holds it."""
WITHOUT = ""
"""Path of a body without a sensor, Model A."""


class Condition(NamedTuple):
    """One state that a quantity needs: the path of the sensor in the body, and a pressure in kPa.

    wall_mm: distance at which a wall holds the tip, from where it is drawn (`HeldTip`); None: it is free.
    """

    path: str
    pressure_kPa: float
    wall_mm: float | None = None


States = Mapping[Condition, Array]
"""Displacements (n, 3) in mm by condition."""
Follow = Callable[[Equilibrium, Sequence[State]], list[State]]
"""States of a body with a sensor, from those of the body without it on one side of rest: the last is at the
pressure of their last."""


@attrs.frozen(eq=False)
class Structure:
    """A discretised body for one choice of freedoms.

    about: its origin (a Unit), for quantities of the design; shared: figures of its elements that do not
    depend on the nodes' positions, valid for bodies of the same elements too. with_sensor: makes the body
    with the sensor along a path, whose states `follow` finds. Its mesh begins with this one's nodes.
    """

    model: Model
    materials: Materials
    about: Any = None
    newton: NewtonSettings = attrs.field(factory=NewtonSettings)
    shared: dict[str, Any] = attrs.field(factory=dict)
    with_sensor: Callable[[str], Structure] | None = None
    follow: Follow | None = None
    _with: dict[str, Structure] = attrs.field(factory=dict, init=False, repr=False)

    def of(self, path: str) -> Structure:
        """The body with the sensor along a path, made when first asked for; itself `WITHOUT` one.

        Raises MeshingError.
        """
        if path == WITHOUT:
            return self
        if path not in self._with:
            assert self.with_sensor is not None
            self._with[path] = self.with_sensor(path)
        return self._with[path]

    def once(self, name: str, make: Callable[[], Any]) -> Any:
        """Figure of the elements, computed when first asked for."""
        if name not in self.shared:
            self.shared[name] = make()
        return self.shared[name]

    def kept(self, name: str, make: Callable[[], Any]) -> Any:
        """Figure of this body, computed when first asked for; only the last body's is kept."""
        known = self.shared.get(name)
        if known is None or known[0] is not self:
            known = self.shared[name] = self, make()
        return known[1]

    def following(self, u: Array) -> Array:
        """Displacements u (n, 3) in mm with tied and carried nodes following by this body's ties and arms.

        A similar body ties struts to its wall by other weights, and has other sections.
        """
        mesh = self.model.mesh
        return np.asarray(self.model.following(u.copy())) if len(mesh.tied) or len(mesh.carried) else u

    def following_changes(self, u: Array, changes: Sequence[Array]) -> list[Array]:
        """Changes (n, 3) of displacements u (n, 3) in mm, with `following` to first order."""
        columns = np.stack([v.ravel() for v in changes], axis=1)
        return [column.reshape(u.shape) for column in self.model.passed_back(u, columns).T]

    def under(self, condition: Condition) -> Model:
        """Model of a condition: the body's own with or without a sensor, or with the wall that holds its tip.

        Raises MeshingError.
        """
        if condition.wall_mm is None:
            return self.of(condition.path).model
        # Made first, so that both share it.
        _ = self.model.factor
        found = copy.copy(self.model)
        found.obstacles = (*self.model.obstacles, HeldTip(self.model.mesh, condition.wall_mm))
        return found


class Quantity(Protocol):
    """A figure of a body in equilibrium, identified by its `name`.

    A quantity with `slope(structure, states)`, its derivative (n, 3) by the displacements of each condition,
    gets its gradient by one adjoint solution a condition, whatever the number of freedoms; its difference
    between two bodies at the same displacements is `change(structure, states, plus, minus)` if it has that,
    else that of its values. Any other quantity with conditions is computed again, with moved displacements,
    for every freedom.
    """

    @property
    def name(self) -> str:
        """Identifier of the quantity."""

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """States it is computed from, all under pressure."""

    def value(self, structure: Structure, states: States) -> float:
        """Its value."""


def solve(structure: Structure, conditions: Iterable[Condition]) -> tuple[dict[Condition, Array], int]:
    """Displacements in every condition, each from those of smaller pressure, and the factorisations.

    Raises ConvergenceError where a pressure cannot be reached, and InputError for materials with history.
    """
    wanted = set(conditions)
    found: dict[Condition, State] = {}
    # A sensor's states start from those without it, which come first.
    for path, wall_mm in sorted({(c.path, c.wall_mm) for c in wanted}, key=repr):
        body, model = structure.of(path), structure.under(Condition(path, 0.0, wall_mm))
        equilibrium = Equilibrium(model, body.materials, body.newton)
        if equilibrium.parameters.has_history or model.has_friction:
            raise InputError(
                "the state of a body with friction or memory depends on its history",
                "[wall], freedoms",
                "optimise with an elastic law of the wall",
            )
        pressures = sorted(c.pressure_kPa for c in wanted if (c.path, c.wall_mm) == (path, wall_mm))
        start = _start(equilibrium, wall_mm)
        found |= {Condition(path, p, wall_mm): start for p in pressures if p == 0}
        for side in ([p for p in pressures if p < 0][::-1], [p for p in pressures if p > 0]):
            history: list[State] = [start]
            for number, pressure in enumerate(side, 1):
                if body.follow is None:
                    history.append(equilibrium.reach(in_MPa(pressure), history))
                else:
                    way = [found[Condition(WITHOUT, p)] for p in side[:number]]
                    history.append(body.follow(equilibrium, way)[-1])
                found[Condition(path, pressure, wall_mm)] = history[-1]
    return {c: state.u for c, state in found.items()}, sum(s.factorisations for s in found.values())


def _start(equilibrium: Equilibrium, wall_mm: float | None) -> State:
    """State without pressure, with the tip moved to its wall; raises ConvergenceError."""
    model = equilibrium.model
    start = rest(model.mesh) if model.load is None else equilibrium.at_zero_pressure()
    if not wall_mm:
        return start
    wall = model.obstacles[-1]
    assert isinstance(wall, HeldTip)
    for share in np.linspace(0.0, 1.0, WALL_STEPS + 1)[1:]:
        wall.share = share
        start = equilibrium.newton(start.u, 0.0)
    return start
