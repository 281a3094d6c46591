"""How a unit is simulated: what makes a model of its mesh, and the instants of its pressure protocol."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..arrays import Array
from ..design.body import Body
from ..design.parameters import Unit, Waveguide
from ..design.rigid_body import RigidBody, mirrored, to_obj
from ..fem.device import require_device
from ..fem.newton_settings import (
    BODY_CONTACT_NEWTON,
    BODY_NEWTON,
    BODY_OBSTACLE_NEWTON,
    NewtonSettings,
)
from ..fem.protocol import Protocol
from ..meshing.settings import MeshSettings
from ..run.cache import key
from .named_effects import NamedEffects

if TYPE_CHECKING:
    # The inputs of a study are made without the solver: Blender's window waits for them.
    from ..fem.equilibrium import Equilibrium
    from ..fem.materials import Materials
    from ..fem.model import Model
    from ..meshing.mesh import Mesh


@attrs.frozen(eq=False)
class Mechanics:
    """A unit with all that acts on it but its pressure: body, obstacles, effects, contact with itself."""

    unit: Unit
    body: Body | None
    obstacles: tuple[RigidBody, ...]
    effects: NamedEffects
    self_contact: bool
    self_friction: float
    device: str

    def hash(self) -> str:
        """Hash of what decides a motion: neither the unit's name nor its waveguide, and not the device."""
        unit = attrs.evolve(self.unit, name="unit", waveguide=Waveguide())
        body = "" if self.body is None else self.body.hash
        met = to_obj(self.obstacles) if self.obstacles else "", [o.friction for o in self.obstacles]
        return key(unit.hash(), body, met, self.effects.parts, self.self_contact, self.self_friction)

    def materials(self, mesh: Mesh) -> Materials:
        """Materials of the unit's mesh, effects and all."""
        from ..fem.unit_materials import materials_of

        return self.effects.materials(materials_of(self.unit, mesh), mesh)

    def model(self, mesh: Mesh, threads: int = 2) -> Model:
        """Model of the unit's mesh: pressure, weight, obstacles. Raises InputError."""
        require_device(self.device)
        model = self.effects.model(self.unit, mesh, threads, self.device)
        if self.obstacles:
            from .contact_history import obstacles_of

            model.obstacles = obstacles_of(self.obstacles, self.unit, mesh)
        if self.self_contact:
            from ..fem.self_contact import self_contact_of

            model.self_contact = self_contact_of(self.unit, mesh, self.self_friction)
        return model

    def equilibrium(self, mesh: Mesh) -> Equilibrium:
        """Solver of the unit's equilibria on a mesh."""
        from ..fem.equilibrium import Equilibrium

        return Equilibrium(self.model(mesh), self.materials(mesh), self.newton)

    @property
    def newton(self) -> NewtonSettings:
        """Settings of Newton's method for this unit."""
        if self.self_contact:
            return BODY_CONTACT_NEWTON
        return BODY_OBSTACLE_NEWTON if self.in_time else BODY_NEWTON

    @property
    def in_time(self) -> bool:
        """True if motion is solved instant by instant, since contact or the wall's law has history."""
        return bool(self.obstacles) or self.unit.wall.has_memory or bool(self.self_friction)

    def mesh_settings(self, settings: MeshSettings) -> MeshSettings:
        """Settings of a mesh: of the whole unit if an obstacle is not symmetric."""
        if not self.obstacles or mirrored(self.obstacles):
            return settings
        return attrs.evolve(settings, fraction="full")


@attrs.frozen(eq=False)
class Samples:
    """Instants (k,) at which a protocol is solved: time in s, pressure in kPa on the unit, and supplied.

    With effects in time the pressure on the unit is the effective one.
    """

    time_s: Array
    pressure_kPa: Array
    supplied_kPa: Array

    @classmethod
    def of(cls, protocol: Protocol, times: int, effects: NamedEffects) -> Samples:
        """A protocol's at uniform instants."""
        time, supplied = protocol.sample(times)
        if not effects.in_time:
            return cls(time, supplied, supplied)
        # Between the protocol's corners the pressure is linear, as the effects have it.
        every = np.union1d(protocol.time_s, time)
        effective = effects.effective_kPa(every, np.interp(every, protocol.time_s, protocol.pressure_kPa))
        # Rounded, so that the same pressure met twice is recognised as one equilibrium.
        return cls(time, np.round(effective[np.searchsorted(every, time)], 9), supplied)

    @cached_property
    def distinct_kPa(self) -> list[float]:
        """Distinct pressures on the unit, ascending."""
        found: list[float] = np.unique(self.pressure_kPa).tolist()
        return found

    @property
    def instants(self) -> Array:
        """Number of instants (s,) of each distinct pressure."""
        return np.unique(self.pressure_kPa, return_counts=True)[1]

    def outward(self, to_kPa: float) -> list[float]:
        """Distinct pressures from 0, without it, to one of them on the same side, in that order."""
        side = [p for p in self.distinct_kPa if p * to_kPa > 0 and abs(p) <= abs(to_kPa) * (1 + 1e-12)]
        return sorted(side, key=abs)
