"""A unit as a body with movable freedoms: its mesh, its materials, and pairs of neighbours."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..body.candidates import states_along
from ..body.morph import PrintedMorph
from ..body.printed_mesh import mesh_printed
from ..body.waveguide import bar_of, moved_with_waveguide, with_waveguide
from ..design.anchors import anchor_points, window
from ..design.body import Body, envelope
from ..design.parameters import Unit
from ..errors import InputError, MeshingError
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.moved_nodes import relocated
from ..fem.newton_settings import BODY_CONTACT_NEWTON, BODY_NEWTON, NewtonSettings
from ..fem.self_contact import relocated_contact, self_contact_of
from ..fem.unit_materials import materials_of
from ..meshing.mesh import Mesh
from ..meshing.settings import MeshSettings
from .freedoms import Freedom, changed_unit
from .gradient import Pair
from .structure import Structure

STEP = 1e-4
"""Half step of a freedom's central differences, relative to its value (or its range, where that is
smaller)."""


@attrs.frozen(eq=False)
class Mechanics:
    """Settings of a printed unit's simulation: mesh, and the changes of an extended model.

    as_printed: a drawn unit with the parts of the model that a unit has parameters for; materials, model: of
    such a unit and its mesh; load: dead forces (n, 3) in N, or None. body: a closed surface in place of
    the lattice's box; self_contact: of walls and struts.
    """

    settings: MeshSettings = attrs.field(factory=lambda: MeshSettings(refine=0.5))
    as_printed: Callable[[Unit], Unit] = lambda unit: unit
    materials: Callable[[Unit, Mesh], Materials] = materials_of
    model: Callable[[Unit, Mesh], Model] = lambda unit, mesh: Model(mesh, threads=1)
    load: Callable[[Unit, Mesh], Array | None] = lambda unit, mesh: None
    cache: Path | None = None
    body: Body | None = None
    self_contact: bool = False


@attrs.frozen
class UnitBody:
    """One unit, as drawn, as a body; `structure` is meshed on first use, and its sensors are (`of`)."""

    unit: Unit
    mechanics: Mechanics
    _shared: dict[str, Any] = attrs.field(factory=dict, init=False, eq=False, repr=False)

    @cached_property
    def printed(self) -> Unit:
        """The unit with the extended model applied."""
        return self.mechanics.as_printed(self.unit)

    @cached_property
    def mesh(self) -> Mesh:
        """The unit's mesh. Raises InputError and MeshingError."""
        m = self.mechanics
        return mesh_printed(self.printed, m.settings, cache=m.cache, body=self.envelope)

    @property
    def envelope(self) -> Body | None:
        """The body in place of the lattice's box, cut to the unit's length, or None. Raises InputError."""
        own = self.mechanics.body
        return None if own is None else envelope(own, self.printed.dimensions)

    @cached_property
    def structure(self) -> Structure:
        """The body; see `mesh` for the errors."""
        model = self.mechanics.model(self.printed, self.mesh)
        model.load = self.mechanics.load(self.printed, self.mesh)
        if self.mechanics.self_contact:
            model.self_contact = self_contact_of(self.printed, self.mesh)
        return self._structure(self.unit, self.printed, model, self.mesh)

    @cached_property
    def morph(self) -> PrintedMorph:
        """Morph of its mesh to units near to it. Raises MeshingError."""
        return PrintedMorph(self.mesh, self.printed, self.mechanics.settings, self.envelope)

    @property
    def _newton(self) -> NewtonSettings:
        return BODY_CONTACT_NEWTON if self.mechanics.self_contact else BODY_NEWTON

    def moved(self, unit: Unit) -> Structure:
        """Another unit on this one's mesh, morphed; it shares this one's buffers (`relocated`).

        Raises InputError if the unit breaks a rule, MeshingError if it needs a separate mesh.
        """
        printed = self.mechanics.as_printed(unit)
        mesh = self.mesh if printed.printed == self.printed.printed else self.morph.to(printed, checked=False)
        own = self.structure.model.self_contact
        contact = None if own is None else relocated_contact(own, printed, mesh)
        model = relocated(self.structure.model, mesh, contact)
        model.load = self.mechanics.load(printed, mesh)
        return self._structure(unit, printed, model, mesh)

    def pair(self, freedom: Freedom) -> Pair:
        """The two neighbours by one continuous freedom, and the difference between them in its unit.

        One-sided if the unit can be moved to one side only. Raises InputError and MeshingError.
        """
        value = float(freedom.value_of(self.unit))
        step = STEP * min(freedom.high - freedom.low, abs(value) or np.inf)
        ends, units = [value, value], [self.unit, self.unit]
        for side, sign in enumerate((1.0, -1.0)):
            with suppress(InputError):
                units[side] = changed_unit(self.unit, [freedom], [value + sign * step])
                ends[side] = value + sign * step
        if ends[0] == ends[1]:
            raise InputError(
                f"{freedom.name} = {value:g} cannot be varied in either direction", freedom.name, "fix it"
            )
        plus, minus = map(self.moved, units)
        return plus, minus, ends[0] - ends[1]

    def pairs(self, freedoms: Sequence[Freedom]) -> list[Callable[[], Pair]]:
        """`pair` of every freedom, each made on demand."""
        return [lambda freedom=freedom: self.pair(freedom) for freedom in freedoms]  # type: ignore[misc]

    def _structure(self, unit: Unit, printed: Unit, model: Model, mesh: Mesh) -> Structure:
        return Structure(
            model,
            self.mechanics.materials(printed, mesh),
            printed,
            self._newton,
            self._shared,
            with_sensor=lambda path: self._with_sensor(unit, printed, mesh, path),
        )

    def _with_sensor(self, unit: Unit, printed: Unit, mesh: Mesh, path: str) -> Structure:
        """The body with the waveguide along a path, in a unit's mesh. Raises MeshingError."""
        m, chosen = self.mechanics, window(unit, path)
        points = anchor_points(printed)[list(chosen.indices)]
        body = None if m.body is None else envelope(m.body, printed.dimensions)
        try:
            bar = bar_of(printed, points, body)
            if mesh is self.mesh:
                found = with_waveguide(mesh, bar, printed, body)
                model = m.model(printed, found)
                if m.self_contact:
                    model.self_contact = self_contact_of(printed, found)
            else:
                first = self.structure.of(path).model
                found = moved_with_waveguide(self.mesh, first.mesh, mesh, bar, printed, body)
                own = first.self_contact
                contact = None if own is None else relocated_contact(own, printed, found)
                model = relocated(first, found, contact)
        except InputError as error:
            # Another design may have room for it.
            raise MeshingError(error.what, error.where, error.remedy) from error
        model.load = m.load(printed, found)
        cell = printed.printed.cell
        return Structure(
            model,
            m.materials(printed, found),
            printed,
            self._newton,
            follow=lambda equilibrium, way: states_along(equilibrium, mesh, points, cell, way),
        )
