"""Static effects of the unit in its finite-element model."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..design.parameters import Unit
from ..errors import InputError
from ..fem.newton_settings import (
    CONTACT_NEWTON,
    RESOLVED_CONTACT_NEWTON,
    RESOLVED_NEWTON,
    NewtonSettings,
)
from ..measured.pose import Direction, X, down
from ..meshing.settings import CELL_MM, MeshSettings
from .effect import Effect, Parameter
from .prediction import beam_deadweight, coupon, lattice_compression
from .prediction.flat_obstacle import NAME as CONTACT

if TYPE_CHECKING:
    # To name, size or draw an effect, nothing of the solver is loaded.
    from ..fem.materials import Materials
    from ..fem.model import Model
    from ..meshing.mesh import Mesh

Array = np.ndarray[Any, Any]

# A skin of this depth represents every skin of the same depth times excess modulus.
SKIN_MM = 0.1
# Share of a one-sided foam on its other side: laws require more than none.
NEXT_TO_NOTHING = 1e-3
# A size whose path ends before the last pressure is useless: it need not be followed to its end.
SMOOTH_CONTACT: NewtonSettings = attrs.evolve(
    RESOLVED_CONTACT_NEWTON, min_step_MPa=1e-3, max_factorisations=20, follow_snaps=False
)
TONNE_PER_MM3 = 1e-12  # in kg/m3
# A wall's contact pressure is some kPa; there the gap is off by this much at 1.0x.
OBSTACLE_MPa, OBSTACLE_mm = 0.005, 0.02
# Faces of the envelope are some 20 mm long, and the tip's edge is what touches first.
OBSTACLE_HALVINGS = 2


@lru_cache(maxsize=2)
def _mesh_kept(unit: Unit, settings: MeshSettings, cache: Path | None) -> Mesh:
    """A unit's mesh, cached: a process makes many runs of one unit."""
    from ..body.printed_mesh import mesh_printed

    return mesh_printed(unit, settings, cache=cache)


@attrs.frozen
class Body:
    """Inputs of a run of the unit, before it has a mesh.

    finer: the mesh that mesh_error compares with. distal: number of chambers, from the tip, that a clog cuts
    off. orientation_deg, orientation_axis: see `unit_pose.down`. gap_mm: from the tip at rest to the load
    cell that holds it, None for a free tip. drawn: the unit that an effect has changed into this one.
    self_contact: of walls and struts. device: Warp's, of a model.
    """

    unit: Unit
    mesh: MeshSettings = attrs.field(factory=MeshSettings)
    finer: MeshSettings = attrs.field(factory=MeshSettings)
    distal: int = 1
    orientation_deg: float = 0.0
    orientation_axis: Direction = X
    gap_mm: float | None = None
    drawn: Unit | None = None
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
        mesh, finer = (attrs.evolve(m, fraction="full") for m in (self.mesh, self.finer))
        return attrs.evolve(self, mesh=mesh, finer=finer)

    def newton(self, effect: UnitEffect | None = None) -> NewtonSettings:
        """Settings of Newton's method for a run of this body, with an effect or without."""
        if self.self_contact:
            return RESOLVED_CONTACT_NEWTON if effect is None and self.drawn is None else SMOOTH_CONTACT
        return effect.newton if effect else RESOLVED_NEWTON

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
    a length by which the size of the same change grows with the unit, at the same moduli and pressures.
    Raises InputError where sizes lack the null or leave the bounds.
    """

    name: str
    parameter: Parameter
    sizes: tuple[float, ...]
    body: Callable[[Body, float], Body] | None = None
    materials: Callable[[Materials, Mesh, float], Materials] | None = None
    model: Callable[[Body, Mesh, float], Model] | None = None
    load: Callable[[Body, Mesh, float], Array] | None = None
    has_gravity: bool = False
    newton: NewtonSettings = RESOLVED_NEWTON
    length: int = 0
    larger: tuple[float, ...] = ()
    first: tuple[float, ...] = ()

    def __attrs_post_init__(self) -> None:
        p = self.parameter
        if p.null not in self.sizes or not all(p.low <= s <= p.high for s in self.sizes):
            raise InputError(f"{self.name}: sizes miss the null or leave the bounds", "unit effects")

    def sizes_at(self, enlarged: float) -> tuple[float, ...]:
        """Sizes at 1.0x, in the parameter's unit, up to the bound of a unit `enlarged` times as large."""
        every = (*self.sizes, *self.larger)
        needed = self.parameter.high / enlarged**self.length
        beyond = sum(s < needed * (1 - 1e-9) for s in every)
        return every[: beyond + 1]

    def first_at(self, enlarged: float) -> tuple[float, ...]:
        """Those of `sizes_at` that a first look needs, the null among them."""
        return tuple(s for s in self.sizes_at(enlarged) if s == self.parameter.null or s in self.first)


def _weight(body: Body, mesh: Mesh, density_kg_m3: float) -> Array:
    from ..fem.dead_loads import gravity

    return gravity(mesh, np.full(len(mesh.tets), density_kg_m3 * TONNE_PER_MM3), body.down)


def _clogged(body: Body, mesh: Mesh, share_lost: float) -> Model:
    from ..fem.clogged import CloggedModel

    d = body.unit.printed
    if not 0 < body.distal < d.count:
        raise InputError(
            f"{body.distal} of {d.count} chambers cannot be cut off", "clogged_chamber", "give 1 or more"
        )
    return CloggedModel(mesh, (d.count - body.distal) * d.cell, share_lost, device=body.device, threads=1)


def with_flat_obstacle(body: Body, mesh: Mesh, gap_mm: float) -> Model:
    """The unit next to a flat frictionless wall along its axis, on the side +y, or -y for gap_mm < 0.

    |gap_mm|: distance in mm of the wall from the outline at rest.
    """
    from ..fem.obstacle import Obstacle
    from ..fem.rigid import Plane

    model = body.model(mesh)
    away = math.copysign(1.0, gap_mm)
    farthest = float((away * mesh.nodes[:, 1]).max())
    wall = Plane((0.0, away * (farthest + abs(gap_mm)), 0.0), (0.0, -away, 0.0))
    size = body.unit.dimensions.cell / CELL_MM
    model.obstacles = (Obstacle(mesh, wall, OBSTACLE_MPa, OBSTACLE_mm * size, OBSTACLE_HALVINGS),)
    return model


def _printed(body: Body, **changes: float) -> Body:
    unit = attrs.evolve(body.unit, print=attrs.evolve(body.unit.print, **changes))
    return attrs.evolve(body, unit=unit, drawn=body.unit)


def _overcured(body: Body, offset_mm: float) -> Body:
    p = body.unit.print
    grown = {"offset_xy_mm": p.offset_xy_mm + offset_mm, "offset_z_mm": p.offset_z_mm + offset_mm}
    return _printed(body, **grown)


def _skinned(body: Body, excess_mm: float) -> Body:
    p = body.unit.print
    excess = excess_mm + p.skin_depth_mm * (p.skin_factor - 1.0)
    return _printed(body, skin_depth_mm=SKIN_MM, skin_factor=1.0 + excess / SKIN_MM)


def _thickened(body: Body, factor: float) -> Body:
    chambers = attrs.evolve(body.unit.chambers, wall_mm=factor * body.unit.chambers.wall_mm)
    return attrs.evolve(body, unit=attrs.evolve(body.unit, chambers=chambers), drawn=body.unit)


def _refined(body: Body, share: float) -> Body:
    return attrs.evolve(body, mesh=body.finer) if share else body


def _stiffening(materials: Materials, mesh: Mesh, c2_over_c1: float) -> Materials:
    from ..fem.laws import NeoHooke, Yeoh
    from ..fem.materials import Layer, Materials

    stiffer = []
    for layer in materials.layers:
        if layer.law is not NeoHooke:
            # The law that makes its layers differ stays proportional to stretch.
            stiffer.append(layer)
            continue
        # The unit's resin is neo-Hookean, which is Yeoh's law with c1 = mu/2 alone.
        mu, kappa = layer.parameters.T
        c1 = mu / 2
        rows = np.stack([c1, c2_over_c1 * c1, np.zeros_like(c1), kappa], axis=1)
        stiffer.append(Layer(Yeoh, layer.elements, rows, layer.weight))
    return Materials(tuple(stiffer))


def _asymmetric(materials: Materials, mesh: Mesh, excess: float) -> Materials:
    """Resin stiffer by `excess` in compression; below 0 less stiff, as if it buckled.

    A foam in parallel with the resin's law that resists only one sign of strain. For a less stiff one it
    resists tension and replaces an equal part of the law. Two such foams are the resin at small strain.
    """
    from ..fem.laws import Foam
    from ..fem.materials import Layer, Materials

    modulus, poisson = materials.small_strain(len(mesh.tets))
    both = Foam.parameters(modulus, poisson, 2.0, 2.0)
    both[:, 2 if excess < 0 else 0] *= NEXT_TO_NOTHING
    both[:, 4] /= 2
    foam = Layer(Foam, np.arange(len(mesh.tets)), both, abs(excess))
    share = min(1.0, 1.0 + excess)
    return Materials(
        (*(attrs.evolve(layer, weight=share * layer.weight) for layer in materials.layers), foam)
    )


def _layered(materials: Materials, mesh: Mesh, in_plane: float) -> Materials:
    """The resin stiffer along the print's layers, which lie across the axis."""
    from ..fem.laws import Layered
    from ..fem.materials import Layer, Materials
    from ..fem.wall_law import LAYER_NORMAL, layer_stiffness

    layered: list[Layer] = []
    for layer in materials.layers:
        # The unit's resin is neo-Hookean, alike everywhere but for its skin, which is only stiffer.
        shear, bulk = layer.parameters[0]
        added, share = layer_stiffness(1 + in_plane, float(shear), float(bulk))
        less = min(added, 0.0)
        base = layer.parameters[0] + np.array([less / 2, less / 3])
        more = Layered.parameters(max(added, 0.0), -less, LAYER_NORMAL)
        weight = share * layer.weight * (layer.parameters[:, 0] / shear)
        for law, row in ((layer.law, base), (Layered, more)):
            layered.append(Layer(law, layer.elements, np.tile(row, (len(layer.elements), 1)), weight))
    return Materials(tuple(layered))


def _shared(effects: Sequence[Effect], name: str) -> Parameter:
    """Parameter of the effect in another kind of experiment: one effect, one value."""
    return next(e.parameters[0] for e in effects if e.name == name)


EFFECTS = {
    effect.name: effect
    for effect in (
        UnitEffect(
            "gravity",
            _shared(beam_deadweight.EFFECTS, "gravity"),
            (0.0, 1300.0, 4000.0),
            load=_weight,
            has_gravity=True,
            length=-1,
            larger=(6000.0, 9000.0),
            first=(1300.0,),
        ),
        UnitEffect(
            "strain_stiffening",
            _shared(coupon.EFFECTS, "strain_stiffening"),
            (-0.03, 0.0, 0.1, 0.4, 1.0, 2.0),
            materials=_stiffening,
            first=(1.0,),
        ),
        UnitEffect(
            "overcure",
            _shared(lattice_compression.EFFECTS, "overcure"),
            (0.0, 0.06, 0.14, 0.25),
            body=_overcured,
            length=1,
            larger=(0.34,),
            first=(0.14,),
        ),
        UnitEffect(
            "skin_cure",
            _shared(lattice_compression.EFFECTS, "skin_cure"),
            (0.0, 0.04, 0.1, 0.2, 0.4),
            body=_skinned,
            length=1,
            larger=(0.54,),
            first=(0.2,),
        ),
        UnitEffect(
            "wall_thickness",
            Parameter(
                "factor", "", 0.8, 1.3, 1.0, (0.95, 1.05), "assumed: printers miss it by a fifth at most"
            ),
            (0.8, 0.9, 1.0, 1.15, 1.3),
            body=_thickened,
            first=(0.8, 1.3),
        ),
        UnitEffect(
            "anisotropy",
            attrs.evolve(_shared(coupon.EFFECTS, "anisotropy"), low=-0.6, high=3.0, starts=(-0.3, 0.3)),
            (-0.6, -0.3, 0.0, 0.5, 1.3, 3.0),
            materials=_layered,
            first=(-0.3, 1.3),
        ),
        UnitEffect(
            "tension_compression_asymmetry",
            # From the other side a fit may end in another minimum: beside it a thinner wall was named.
            attrs.evolve(_shared(coupon.EFFECTS, "tension_compression_asymmetry"), starts=(-0.3, 0.3)),
            (-0.8, -0.4, 0.0, 0.5, 1.5, 4.0),
            materials=_asymmetric,
            first=(-0.4, 1.5),
        ),
        UnitEffect(
            "clogged_chamber",
            Parameter("share_lost", "", 0.0, 1.0, 0.0, (0.1, 0.5), "of the pressure, in the last chambers"),
            (0.0, 0.3, 0.65, 1.0),
            model=_clogged,
            first=(0.65,),
        ),
        UnitEffect(
            "mesh_error",
            Parameter("share", "", 0.0, 2.0, 0.0, (1.0,), "1: the finer mesh; beyond: the way further on"),
            (0.0, 1.0),
            body=_refined,
            first=(1.0,),
        ),
    )
}

# A load cell farther from the tip than stated, in runs of a held tip.
HELD = UnitEffect(
    "seating",
    Parameter("tip_gap_mm", "mm", 0.0, 3.0, 0.0, (0.2, 1.0), "a cell set by eye is off by tenths"),
    (0.0, 0.5, 1.5, 3.0),
    body=lambda body, more_mm: attrs.evolve(body, gap_mm=(body.gap_mm or 0.0) + more_mm),
    length=1,
    larger=(4.5,),
    first=(1.5,),
)

# A flat obstacle in a run; its position depends on the free unit's range, see prediction/flat_obstacle.
FLAT_OBSTACLE = UnitEffect(
    CONTACT,
    Parameter("gap_mm", "mm", -1e3, 1e3, 1e3, (), "signed: toward +y, below 0 toward -y"),
    (1e3,),
    model=with_flat_obstacle,
    newton=CONTACT_NEWTON,
    length=1,
)
