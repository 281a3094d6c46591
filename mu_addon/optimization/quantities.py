"""Quantities of a design, read off a body in equilibrium, with their slopes by the displacements."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..fem.bending_angle import TipSection, tip_faces
from ..fem.held_tip import HeldTip
from ..fem.lattice_law import deformation_gradients
from ..fem.model import Model
from ..fem.moved_nodes import relocated
from ..fem.self_intersection import crossings
from ..fem.sensitivity import Sensitivity
from ..meshing.mesh import AXES, LATTICE, MEMBRANE, Mesh
from .residual_change import ResidualChange
from .structure import WITHOUT, Condition, States, Structure

REGIONS = {"wall": MEMBRANE, "struts": LATTICE}
MOST_STRETCHED = 0.01
"""Share of a region's volume over which its largest stretch is averaged."""
SMALL_MM = 1e-3
"""Largest displacement at which the stiffness at rest is read off residuals."""


@attrs.frozen
class _AtPressure:
    """A quantity of the state at a pressure in kPa."""

    name: str
    pressure_kPa: float

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The state at its pressure."""
        return (Condition(WITHOUT, self.pressure_kPa),)


@attrs.frozen
class Angle(_AtPressure):
    """Bending angle in degrees at a pressure in kPa, see `bending_angle_deg`."""

    def value(self, structure: Structure, states: States) -> float:
        """Value in degrees."""
        return _tip(structure).angle_deg(states[self.conditions[0]])

    def slope(self, structure: Structure, states: States) -> dict[Condition, Array]:
        """Derivative by the displacements (n, 3), in degrees/mm.

        With s and c the sums whose quotient is the tangent of the angle, d = -(c ds - s dc)/(c^2 + s^2); the
        places at rest are relative to their mean, so that the mean of the moved ones drops out.
        """
        tip = _tip(structure)
        u = states[self.conditions[0]]
        yz = tip.places[:, 1:]
        before = yz - np.average(yz, axis=0, weights=tip.area)
        after = yz + u[tip.nodes, 1:]
        after = after - np.average(after, axis=0, weights=tip.area)
        s = (tip.area * (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])).sum()
        c = (tip.area[:, None] * before * after).sum()
        ds = tip.area[:, None] * np.column_stack([-before[:, 1], before[:, 0]])
        dc = tip.area[:, None] * before
        found = np.zeros_like(u)
        found[tip.nodes, 1:] = -np.degrees((c * ds - s * dc) / (c * c + s * s))
        return {self.conditions[0]: found}


@attrs.frozen
class TipForce:
    """Force in N with which the tip presses on a wall at a pressure in kPa: the blocked force.

    The wall lies along the axis, gap_mm from the +y edge of the tip as drawn, toward which pressure bends the
    unit; the tip slides on it without friction, and turns. It is held to either side (`HeldTip`), so that the
    force is smooth: below 0 the free tip would not reach the wall.
    """

    name: str
    pressure_kPa: float
    gap_mm: float = 0.0

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The state at its pressure, the tip held."""
        return (Condition(WITHOUT, self.pressure_kPa, self.gap_mm),)

    def value(self, structure: Structure, states: States) -> float:
        """Value in N."""
        return self._wall(structure).reading_N(states[self.conditions[0]])

    def slope(self, structure: Structure, states: States) -> dict[Condition, Array]:
        """Derivative by the displacements (n, 3), in N/mm: the wall's stiffness at the tip's edge."""
        wall = self._wall(structure)
        found = np.zeros_like(structure.model.mesh.nodes)
        found[wall.edge, 1] = wall.copies * wall.stiffness
        return {self.conditions[0]: found}

    def _wall(self, structure: Structure) -> HeldTip:
        return HeldTip(structure.model.mesh, self.gap_mm)


@attrs.frozen
class TipPosition(_AtPressure):
    """Displacement in mm of the tip's end plane along y or z at a pressure in kPa, its mean."""

    direction: str = "y"

    def value(self, structure: Structure, states: States) -> float:
        """Value in mm."""
        return float(_tip_centre(structure, states[self.conditions[0]])[AXES.index(self.direction)])

    def slope(self, structure: Structure, states: States) -> dict[Condition, Array]:
        """Derivative by the displacements (n, 3), without unit: each node's share of the plane."""
        return {self.conditions[0]: _tip_slope(structure, np.eye(3)[AXES.index(self.direction)])}


@attrs.frozen
class Workspace:
    """Length in mm of the path of the tip's centre through its places at some pressures in kPa and at rest.

    With one pressure line a unit reaches the points of a curve in its bending plane; its length is the
    workspace's size. The path is taken as straight between the places, in the order of pressure.
    """

    name: str
    pressures_kPa: tuple[float, ...]

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Its pressures and 0, in ascending order."""
        return tuple(Condition(WITHOUT, p) for p in sorted({0.0, *self.pressures_kPa}))

    def value(self, structure: Structure, states: States) -> float:
        """Value in mm."""
        return float(np.linalg.norm(self._steps(structure, states), axis=1).sum())

    def slope(self, structure: Structure, states: States) -> dict[Condition, Array]:
        """Derivative by the displacements (n, 3) in every state, unitless: along the path, both ways."""
        steps = self._steps(structure, states)
        # A unit that does not move has a path without direction.
        along = steps / np.maximum(np.linalg.norm(steps, axis=1), 1e-12)[:, None]
        none = np.zeros((1, 3))
        pulls = np.concatenate([none, along]) - np.concatenate([along, none])
        return {c: _tip_slope(structure, pull) for c, pull in zip(self.conditions, pulls, strict=True)}

    def _steps(self, structure: Structure, states: States) -> Array:
        """Steps from each position to the next, (k - 1, 3) in mm."""
        return np.diff([_tip_centre(structure, states[c]) for c in self.conditions], axis=0)


@attrs.frozen
class AirVolume:
    """Volume of air in ml inside the chambers at a pressure in kPa; at 0 as printed."""

    name: str
    pressure_kPa: float = 0.0

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The state at its pressure, none at 0."""
        return (Condition(WITHOUT, self.pressure_kPa),) if self.pressure_kPa else ()

    def value(self, structure: Structure, states: States) -> float:
        """Value in ml."""
        model = structure.model
        u = states[self.conditions[0]] if self.conditions else np.zeros_like(model.mesh.nodes)
        return _whole(model) * model.cavity_volume(u) / 1000.0

    def slope(self, structure: Structure, states: States) -> dict[Condition, Array]:
        """Derivative by the displacements (n, 3), in ml/mm: minus the nodal forces of unit pressure."""
        if not self.conditions:
            return {}
        return {self.conditions[0]: self._by_places(structure, states)}

    def change(self, structure: Structure, states: States, plus: Structure, minus: Structure) -> float:
        """Difference in ml between two bodies near to `structure` at its displacements, to first order."""
        kept = structure.kept(f"air {self.pressure_kPa}", lambda: self._by_places(structure, states))
        return float(np.vdot(kept, plus.model.mesh.nodes - minus.model.mesh.nodes))

    def _by_places(self, structure: Structure, states: States) -> Array:
        """Derivative (n, 3) in ml/mm by the nodes' places: minus the nodal forces of unit pressure."""
        model = structure.model
        u = states[self.conditions[0]] if self.conditions else np.zeros_like(model.mesh.nodes)
        data = model.parameters(structure.materials)
        forces = model.residual(u, 0.0, data) - model.residual(u, 1.0, data)
        return np.asarray(_whole(model) * forces / 1000.0)


@attrs.frozen
class Stretch(_AtPressure):
    """Largest principal stretch in the wall or the struts at a pressure in kPa.

    The mean over that 1 % of the region's volume that is stretched most: the largest of all points depends on
    the mesh where struts meet a wall, and it jumps from point to point as a design changes. elongation: at
    break, as a ratio; where it is given, the value is the safety factor elongation/(stretch - 1).
    """

    region: str = "wall"
    elongation: float | None = None

    def value(self, structure: Structure, states: States) -> float:
        """A ratio."""
        mesh = structure.model.mesh
        found, share, _, _ = self._most(mesh, states[self.conditions[0]])
        stretch = float((found * share).sum())
        return stretch if self.elongation is None else self.elongation / max(stretch - 1.0, 1e-9)

    def slope(self, structure: Structure, states: States) -> dict[Condition, Array]:
        """Derivative by the displacements (n, 3), in 1/mm: n . F N along a direction N, n = F N/|F N|.

        The set of points changes with the displacements, but not to first order in their mean.
        """
        mesh, u = structure.model.mesh, states[self.conditions[0]]
        stretch, share, (element, point), (now, then) = self._known(structure, states)
        tets = mesh.tets[element]
        gradients = structure.model.reference.at.gradients[element, point]
        parts = share[:, None, None] * np.einsum("ki,knj,kj->kni", now, gradients, then)
        found = np.zeros_like(u)
        np.add.at(found, tets, parts)
        if self.elongation is not None:
            excess = max(float((stretch * share).sum()) - 1.0, 1e-9)
            found *= -self.elongation / excess**2
        return {self.conditions[0]: found}

    def change(self, structure: Structure, states: States, plus: Structure, minus: Structure) -> float:
        """Difference between two bodies near to `structure` at its displacements, to first order."""
        first, second = plus.model.mesh, minus.model.mesh
        if first is second:
            return 0.0
        name = f"by mesh {self.pressure_kPa} {self.region} {self.elongation}"
        return structure.kept(name, lambda: self._sensitivity(structure, states)).between(first, second)

    def _sensitivity(self, structure: Structure, states: States) -> Sensitivity:
        """Sensitivity to the mesh, at the displacements.

        The mean is t + the integral of (stretch - t) over the points above t, by 1 % of the volume; the
        points may be held, and t, for it is largest by t there.
        """
        mesh, u = structure.model.mesh, states[self.conditions[0]]
        reference = structure.model.reference.at
        stretch, share, (element, point), (now, then) = self._known(structure, states)
        mean, least = float((stretch * share).sum()), float(stretch[-1])
        G = reference.gradients[element, point]
        excess = (stretch - least) * share
        slope_u = np.einsum("kni,knj->kij", u[mesh.tets[element]], G)
        # F = 1 + grad u changes by -grad u grad d as nodes go by d, a volume by div d of itself.
        by_place = excess[:, None, None] * G
        by_place -= np.einsum("k,kji,kj,kn->kni", share, slope_u, now, np.einsum("knj,kj->kn", G, then))
        nodes, filled = np.zeros_like(u), np.zeros_like(mesh.filled)
        np.add.at(nodes, mesh.tets[element], by_place)
        own = np.flatnonzero(mesh.region == REGIONS[self.region])
        volumes = reference.volumes[own]
        solid = _solid(mesh, own, volumes)
        less = (mean - least) / solid.sum()
        np.add.at(nodes, mesh.tets[own], -less * np.einsum("eq,eqni->eni", solid, reference.gradients[own]))
        slope = _solid_slope(mesh, own, volumes)
        filled[own] = -less * slope
        relative = np.zeros_like(filled)
        relative[own] = np.divide(slope, solid, out=np.zeros_like(slope), where=solid > 0.0)
        np.add.at(filled, (element, point), excess * relative[element, point])
        factor = 1.0 if self.elongation is None else -self.elongation / max(mean - 1.0, 1e-9) ** 2
        by_u = self.slope(structure, states)[self.conditions[0]]
        ties = np.einsum("ti,tki->tk", by_u[mesh.tied], u[mesh.tied_to])
        nodes = factor * nodes + structure.model.by_places(u, by_u)
        return Sensitivity(nodes, factor * filled, ties, np.zeros(len(mesh.tets)))

    def _known(self, structure: Structure, states: States) -> Any:
        """Result of `_most` for a body, computed once."""
        u = states[self.conditions[0]]
        return structure.kept(
            f"points {self.pressure_kPa} {self.region}", lambda: self._most(structure.model.mesh, u)
        )

    def _most(self, mesh: Any, u: Array) -> tuple[Array, Array, tuple[Array, Array], tuple[Array, Array]]:
        """The points stretched most: stretches (k,), shares (k,) that sum to 1, their elements and points,
        and the stretch's directions now and at rest, (k, 3) each."""
        elements = np.flatnonzero(mesh.region == REGIONS[self.region])
        F, volumes = deformation_gradients(mesh, u, elements)
        squares, directions = np.linalg.eigh(np.swapaxes(F, -1, -2) @ F)
        largest = np.sqrt(squares[..., 2])
        volumes = _solid(mesh, elements, volumes)
        order = np.argsort(-largest, axis=None, kind="stable")
        volume = volumes.ravel()[order]
        wanted = MOST_STRETCHED * volume.sum()
        until = np.cumsum(volume)
        count = int(np.searchsorted(until, wanted)) + 1
        order, volume = order[:count], volume[:count].copy()
        volume[-1] -= until[count - 1] - wanted
        e, q = np.unravel_index(order, largest.shape)
        then = directions[e, q][..., 2]
        now = np.einsum("kij,kj->ki", F[e, q], then)
        stretch = np.linalg.norm(now, axis=1)
        return stretch, volume / wanted, (elements[e], q), (now / stretch[:, None], then)


def _solid(mesh: Mesh, elements: Array, volumes: Array) -> Array:
    """Volumes (e, q) in mm3 of some elements' quadrature points, as far as they are filled.

    The weight of points filled by less than half falls to 0 at a quarter, as they are hardly supported.
    """
    filled = mesh.filled[elements]
    share = np.clip(2.0 * filled - 0.5, 0.0, 1.0)
    return volumes * filled * share**2 * (3.0 - 2.0 * share)


def _solid_slope(mesh: Mesh, elements: Array, volumes: Array) -> Array:
    """Derivatives (e, q) in mm3 of `_solid` by the filled shares."""
    filled = mesh.filled[elements]
    share = np.clip(2.0 * filled - 0.5, 0.0, 1.0)
    return np.asarray(volumes * (share**2 * (3.0 - 2.0 * share) + 12.0 * filled * share * (1.0 - share)))


@attrs.frozen
class RestStiffness:
    """Force in N on the tip's end plane, spread evenly, for a mean displacement of 1 mm of it along an axis.

    Of the unpressurised body, to first order: k = 1/(w . K^-1 w), w the share of the plane of each node.
    """

    name: str
    direction: str
    conditions: tuple[Condition, ...] = ()

    def value(self, structure: Structure, states: States) -> float:
        """Value in N/mm."""
        model, weights = self._side(structure)
        moved = self._moved(structure, model, weights)
        return _whole(model) / float(weights.ravel()[model.free] @ moved)

    def change(self, structure: Structure, states: States, plus: Structure, minus: Structure) -> float:
        """Difference in N/mm between two bodies near to `structure`, to first order.

        Of the flexibility c = w . K^-1 w: dc = 2 dw . v - v . dK v with v = K^-1 w. v . K v is the work of
        the residual along v at a displacement so small that the body is linear there.
        """
        model, weights = self._side(structure)
        moved = self._moved(structure, model, weights)
        flexibility = float(weights.ravel()[model.free] @ moved)
        small = SMALL_MM / np.abs(moved).max()
        sides = structure.kept(f"work {self.direction}", lambda: self._work(structure, model, moved, small))
        dK = sum(one.between(plus, minus)[0] for one in sides) / (2.0 * small**2)
        ahead, behind = (self._side(s)[1].ravel()[model.free] @ moved for s in (plus, minus))
        return -_whole(model) * float(2.0 * (ahead - behind) - dK) / flexibility**2

    def _work(self, structure: Structure, model: Model, moved: Array, small: float) -> list[ResidualChange]:
        """The work along a small displacement of itself, and the other way round."""
        found, rest = [], Condition(WITHOUT, 0.0)
        for sign in (1.0, -1.0):
            u, v = (np.zeros_like(model.mesh.nodes) for _ in range(2))
            v.ravel()[model.free] = u.ravel()[model.free] = sign * small * moved
            u = model.following(u)
            v = model.passed_back(u, v.reshape(-1, 1)).reshape(u.shape)
            found.append(ResidualChange(structure, rest, u, [v], model))
        return found

    def _side(self, structure: Structure) -> tuple[Model, Array]:
        """The model whose supports admit the direction, and the weights (n, 3) of the tip's displacement."""
        model = structure.model
        axis = AXES.index(self.direction)
        if self.direction in model.mesh.symmetry:
            model = _odd(structure)
        tip = _tip(structure)
        weights = np.zeros_like(model.mesh.nodes)
        weights[tip.nodes, axis] = tip.area / tip.area.sum()
        at_rest = np.zeros_like(weights)
        return model, model.passed_on(at_rest, weights.reshape(-1, 1)).reshape(weights.shape)

    def _moved(self, structure: Structure, model: Model, weights: Array) -> Array:
        """Displacement (free,) under the weights as forces in N, found once for one body."""

        def solved() -> Array:
            rest, data = np.zeros_like(model.mesh.nodes), model.parameters(structure.materials)
            factor = model.factor.factor(model.tangent(rest, 0.0, data))
            return np.asarray(factor.solve(weights.ravel()[model.free]))

        return np.asarray(structure.kept(f"moved {self.direction}", solved))


@attrs.frozen
class WallsApart(_AtPressure):
    """1 if no wall of the body passes through another at a pressure in kPa, else 0; it has no slope."""

    def value(self, structure: Structure, states: States) -> float:
        """1 or 0."""
        return float(not crossings(structure.model.mesh, states[self.conditions[0]]))

    def change(self, structure: Structure, states: States, plus: Structure, minus: Structure) -> float:
        """0.0: a yes-or-no quantity has no derivative."""
        return 0.0


def _tip(structure: Structure) -> TipSection:
    mesh = structure.model.mesh
    return TipSection.of(mesh, structure.once("tip", lambda: tip_faces(mesh)))


def _tip_centre(structure: Structure, u: Array) -> Array:
    """Displacement (3,) in mm of the tip's end plane, the mean over the plane."""
    tip = _tip(structure)
    return np.asarray(_whole_x(structure, np.average(u[tip.nodes], axis=0, weights=tip.area)))


def _tip_slope(structure: Structure, along: Array) -> Array:
    """Derivative (n, 3) of the displacement of the tip's centre along a direction (3,)."""
    tip = _tip(structure)
    found = np.zeros_like(structure.model.mesh.nodes)
    found[tip.nodes] = tip.area[:, None] / tip.area.sum() * _whole_x(structure, along)
    return found


def _whole_x(structure: Structure, vector: Array) -> Array:
    """A vector (3,) of a part as one of the whole body: components across mirror planes are 0."""
    mirrored = [axis in structure.model.mesh.symmetry for axis in AXES]
    return np.where(mirrored, 0.0, vector)


def _whole(model: Model) -> int:
    """Number of copies of the mesh that make the whole body."""
    return 2 ** len(model.mesh.symmetry)


def _odd(structure: Structure) -> Model:
    """The model of a half whose mirror plane moves across itself, for loads across it."""
    mesh = structure.model.mesh
    if mesh.symmetry != ("x",):
        raise InputError(
            "stiffness across a mirror plane needs a half mesh",
            f"mirrors: {mesh.symmetry}",
            'fraction "half"',
        )
    whole = attrs.evolve(mesh, symmetry=())

    def made() -> Model:
        held = np.zeros((len(mesh.nodes), 3), bool)
        plane = mesh.symmetry_nodes("x")
        held[plane, 1:] = True
        # A section in the plane turns about the axes in it alone.
        ends = np.isin(mesh.beams[:, 0::2], plane)
        held[mesh.beams[:, 1::2][ends], 0] = True
        return Model(whole, supports=held, threads=structure.model.threads)

    return relocated(structure.once("odd", made), whole)
