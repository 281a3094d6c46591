"""Inputs of a run of a unit, and what a static effect changes in them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..arrays import Array
from ..design.parameters import Unit
from ..errors import InputError
from ..fem.newton_settings import (
    BODY_CONTACT_NEWTON,
    BODY_NEWTON,
    NewtonSettings,
)
from ..measured.pose import Direction, X, down
from ..meshing.settings import MeshSettings
from .parameter import Parameter

if TYPE_CHECKING:
    # To name, size or draw an effect, nothing of the solver is loaded.
    from ..fem.materials import Materials
    from ..fem.model import Model
    from ..meshing.mesh import Mesh


WALL, HELD = "wall", "held"
# A size whose path ends before the last pressure is useless: it need not be followed to its end.
SMOOTH_CONTACT: NewtonSettings = attrs.evolve(
    BODY_CONTACT_NEWTON, min_step_MPa=1e-3, max_factorisations=20, follow_snaps=False
)
# Of a unit of another design, left out where its path ends: of eight six took no step below 2 kPa and did not
# snap, two ended at 30 and 32.5 kPa. Damped motion moved one of these by 26 mm in 93 s and did not end.
OTHER_CONTACT: NewtonSettings = attrs.evolve(
    BODY_CONTACT_NEWTON,
    min_step_MPa=2e-3,
    max_factorisations=32,
    max_iterations=60,
    indefinite_steps=2,
    follow_snaps=False,
)


@lru_cache(maxsize=2)
def _mesh_kept(unit: Unit, settings: MeshSettings, cache: Path | None) -> Mesh:
    """A unit's mesh, cached: a process makes many runs of one unit."""
    from ..body.printed_mesh import mesh_printed

    return mesh_printed(unit, settings, cache=cache)


@attrs.frozen
class Body:
    """Inputs of a run of the unit, before it has a mesh.

    distal: number of chambers, from the tip, that a clog cuts off. orientation_deg, orientation_axis: see
    `unit_pose.down`. gap_mm: from the tip at rest to the load cell that holds it, None for a free tip. drawn:
    the unit that an effect has changed into this one. other: True for the unit of another design.
    self_contact: of walls and struts. device: Warp's, of a model.
    """

    unit: Unit
    mesh: MeshSettings = attrs.field(factory=MeshSettings)
    distal: int = 1
    orientation_deg: float = 0.0
    orientation_axis: Direction = X
    gap_mm: float | None = None
    drawn: Unit | None = None
    other: bool = False
    self_contact: bool = False
    device: str = "cpu"

    def meshed(self, cache: Path | None = None) -> Mesh:
        """The unit's mesh; raises InputError and MeshingError. cache: see `mesh_printed`."""
        from ..body.printed_mesh import mesh_printed

        # One of a changed unit is used once.
        make = mesh_printed if self.drawn else _mesh_kept
        return make(self.unit, self.mesh, cache=cache)

    @property
    def down(self) -> Array:
        """Unit vector (3,) of gravity; toward +x, which is the mirror image of toward -x."""
        x, y, z = down(self.orientation_deg, self.orientation_axis).round(12).tolist()
        return np.array([abs(x), y, z])

    @property
    def whole(self) -> Body:
        """The body made whole if its weight leaves the plane of bending."""
        if not self.down[0]:
            return self
        return attrs.evolve(self, mesh=attrs.evolve(self.mesh, fraction="full"))

    def printed(self, **changes: float) -> Body:
        """The body with other values of its print, a change of its unit."""
        unit = attrs.evolve(self.unit, print=attrs.evolve(self.unit.print, **changes))
        return attrs.evolve(self, unit=unit, drawn=self.unit)

    def newton(self, effect: UnitEffect | None = None) -> NewtonSettings:
        """Settings of Newton's method for a run of this body, with an effect or without."""
        if self.self_contact:
            if self.other:
                return OTHER_CONTACT
            return BODY_CONTACT_NEWTON if effect is None and self.drawn is None else SMOOTH_CONTACT
        return effect.newton if effect else BODY_NEWTON

    def materials(self, mesh: Mesh) -> Materials:
        """The base model's materials on a mesh; raises InputError if the unit's wall has a law of its own."""
        from ..fem.unit_materials import materials_of

        if self.unit.wall.names:
            raise InputError(
                "evidence needs a neo-Hookean wall: it looks for the behaviour beyond that",
                "[wall]",
                "leave [wall] out of the unit",
            )
        return materials_of(self.unit, mesh)

    def model(self, mesh: Mesh) -> Model:
        """The base model of a mesh, loaded by pressure alone."""
        from ..fem.model import Model

        return Model(mesh, device=self.device, threads=1)


@attrs.frozen
class UnitEffect:
    """A static effect of the unit: its parameter, the sizes that are run, and its change of the model.

    sizes: at 1.0x, in the parameter's unit, ascending, the null among them; larger: more of them, for units
    at whose scale the bound is beyond the last; first: those that a first look at the effect needs. body: of
    a body and a size; materials: of those without it, the mesh and a size; model, in place of the base's, and
    load (n, 3) in N: of a body, its mesh and a size. Effects combine, each applied to the result of the
    others. has_gravity: whether it depends on gravity's direction. newton: of its runs. length: the power of
    a length by which the size of the same change grows with the unit, at the same moduli and pressures. of:
    `WALL` or `HELD` where it is one of a wall's place, or of a held tip alone. Raises InputError where sizes
    lack the null or leave the bounds.
    """

    parameter: Parameter
    sizes: tuple[float, ...]
    body: Callable[[Body, float], Body] | None = None
    materials: Callable[[Materials, Mesh, float], Materials] | None = None
    model: Callable[[Body, Mesh, float], Model] | None = None
    load: Callable[[Body, Mesh, float], Array] | None = None
    has_gravity: bool = False
    newton: NewtonSettings = BODY_NEWTON
    length: int = 0
    larger: tuple[float, ...] = ()
    first: tuple[float, ...] = ()
    of: str = ""

    def __attrs_post_init__(self) -> None:
        p = self.parameter
        if p.null not in self.sizes or not all(p.low <= s <= p.high for s in self.sizes):
            raise InputError(f"{p.name}: sizes miss the null or leave the bounds", "unit effects")

    def sizes_at(self, enlarged: float) -> tuple[float, ...]:
        """Sizes at 1.0x, in the parameter's unit, up to the bound of a unit `enlarged` times as large."""
        every = (*self.sizes, *self.larger)
        needed = self.parameter.high / enlarged**self.length
        beyond = sum(s < needed * (1 - 1e-9) for s in every)
        return every[: beyond + 1]

    def first_at(self, enlarged: float) -> tuple[float, ...]:
        """Those of `sizes_at` that a first look needs, the null among them."""
        return tuple(s for s in self.sizes_at(enlarged) if s == self.parameter.null or s in self.first)
