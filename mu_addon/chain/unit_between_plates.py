"""A unit between two rigid plates: equilibria for placements of the tip's plate, and their stiffness."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError
from ..fem import kinematics
from ..fem.dead_loads import nodal_masses
from ..fem.equilibrium import Equilibrium
from ..fem.factor import IndefiniteError
from ..fem.model import Model
from ..fem.newton_settings import BODY_NEWTON
from ..fem.rotations import rotation, skew
from ..fem.unit_materials import materials_of
from ..meshing.mesh import Mesh
from .rigid_motion import exponential, inverse, logarithm, motion, rotation_vector, slope

if TYPE_CHECKING:
    from ..design.parameters import Unit


# Smallest share of the way to a placement that is tried.
_LEAST_SHARE = 1 / 4
# A free state's Newton step is below this share of the largest allowed, in radians and unit lengths.
_FREE = 1e-7
_MOST_STEPS = 25
# Of one step of the search for the free state, in radians and unit lengths.
_LONGEST_STEP = 0.15


@attrs.frozen(eq=False)
class PlateState:
    """One equilibrium of a unit between plates, in the frame of its base.

    pressure_kPa; eta (6,): logarithm of the tip plate's motion from z = 0, at rest (0, 0, 0, 0, 0, height).
    gradient (6,): of the potential by eta, in mJ/rad and N; hessian (6, 6) likewise, of the unit whose inside
    is in equilibrium. centre (3,): of mass in mm; centre_slope (3, 6): its change with eta.
    """

    pressure_kPa: float
    eta: Array
    gradient: Array
    hessian: Array
    centre: Array
    centre_slope: Array

    def mirrored(self) -> PlateState:
        """The unit's state reflected in its mirror plane x = 0."""
        m = MIRROR
        return PlateState(
            self.pressure_kPa,
            m * self.eta,
            m * self.gradient,
            m[:, None] * self.hessian * m,
            kinematics.MIRROR * self.centre,
            kinematics.MIRROR[:, None] * self.centre_slope * m,
        )


MIRROR = np.array([1.0, -1.0, -1.0, -1.0, 1.0, 1.0])
"""Signs of a logarithm's components where space is mirrored in x = 0."""


def tip_nodes(mesh: Mesh) -> Array:
    """Nodes (t,) in the plane of a mesh's tip that follow no other node."""
    on = mesh.nodes[:, 2] == mesh.nodes[mesh.tip[0], 2]
    on[mesh.tied] = False
    on[mesh.carried] = False
    return np.flatnonzero(on)


def sections_on(mesh: Mesh, nodes: Array) -> Array:
    """Rotation vectors (r,) of the beam nodes among some nodes."""
    return np.unique(mesh.beams[:, 1::2][np.isin(mesh.beams[:, 0::2], nodes)])


class PlateBody:
    """A unit with its base clamped and its tip's end plane on a rigid plate, without weight.

    mesh: the whole unit, both halves. threads: of the element kernels.
    """

    def __init__(self, unit: Unit, mesh: Mesh, density_g_per_ml: float, threads: int = 1) -> None:
        self.mesh = mesh
        self.height = float(mesh.nodes[mesh.tip[0], 2])
        self.tip = tip_nodes(mesh)
        self._turns = sections_on(mesh, self.tip)
        self._clamped = np.concatenate([mesh.base, sections_on(mesh, mesh.base)])
        supports = np.zeros((len(mesh.nodes), 3), bool)
        supports[self.tip] = True
        materials = materials_of(unit, mesh)
        settings = attrs.evolve(BODY_NEWTON, follow_snaps=False)
        self.equilibrium = Equilibrium(Model(mesh, supports, threads=threads), materials, settings)
        self._open = Model(mesh, threads=threads)
        self.parameters = self.equilibrium.parameters
        nodal = mesh.folded(nodal_masses(mesh, density_g_per_ml * 1e-3))
        self.mass_g = float(nodal.sum())
        self._share = nodal / self.mass_g
        self._station = np.clip(mesh.nodes[:, 2] / self.height, 0.0, 1.0)
        number = np.full(3 * len(mesh.nodes), -1)
        number[self._open.free] = np.arange(len(self._open.free))
        self._inside = number[self.equilibrium.model.free]
        # Unknowns of the plate: displacements of its nodes, then rotation vectors of its sections.
        self._plate = (3 * np.concatenate([self.tip, self._turns])[:, None] + np.arange(3)).ravel()
        self._on_plate = number[self._plate]

    @property
    def rest(self) -> Array:
        """Logarithm (6,) of the tip's plate at rest."""
        return np.array([0.0, 0.0, 0.0, 0.0, 0.0, self.height])

    @property
    def size(self) -> Array:
        """Scale of a logarithm's components (6,): 1 rad, and the height in mm."""
        return np.array([1.0, 1.0, 1.0, self.height, self.height, self.height])

    def carried(self, u: Array, before: Array, after: Array) -> Array:
        """Displacements (n, 3) with the plate moved from one logarithm (6,) to another, the rest along z.

        On the plate exact; between base and plate by the motion at the node's height share of both.
        """
        found = spread(self.mesh, u, self._station, before, after)
        found[self.tip] = placed(self.mesh.nodes[self.tip], self.height, after)
        found[self._turns] = after[:3]
        found[self._clamped] = 0.0
        return self.equilibrium.model.following(found)

    def solved(self, start: Array, before: Array, after: Array, pressure_MPa: float) -> Array:
        """Equilibrium (n, 3) with the plate at the logarithm `after`, from one at `before` at that pressure.

        Raises ConvergenceError where it is not reached in steps of a quarter of the way.
        """
        share, step, u = 0.0, 1.0, start
        while share < 1.0:
            to = min(1.0, share + step)
            here, there = (before + s * (after - before) for s in (share, to))
            try:
                u = self.equilibrium.newton(self.carried(u, here, there), pressure_MPa).u
            except ConvergenceError:
                step /= 2
                if step < _LEAST_SHARE:
                    raise
                continue
            share = to
        return u

    def state(self, u: Array, eta: Array, pressure_MPa: float) -> PlateState:
        """Loads and stiffness of an equilibrium u (n, 3) with the plate at a logarithm eta (6,)."""
        model, x = self._open, self.mesh.nodes + u
        forces = model.residual(u, pressure_MPa, self.parameters)
        force, at = forces[self.tip], x[self.tip]
        wrench = np.concatenate([np.cross(at, force).sum(axis=0), force.sum(axis=0)])
        to_twist = slope(eta)
        modes = np.zeros((len(self.mesh.nodes) * 3, 6))
        by_twist = np.concatenate([-skew(at), np.tile(np.eye(3), (len(at), 1, 1))], axis=2)
        # The rotation vector of a section on the plate is that of the plate's logarithm.
        of_turns = np.tile(np.eye(3, 6), (len(self._turns), 1, 1))
        modes[self._plate] = np.concatenate([by_twist @ to_twist, of_turns]).reshape(-1, 6)
        stiffness = model.matrix(model.tangent(u, pressure_MPa, self.parameters)).tocsr()
        inner = self.equilibrium.model
        try:
            inner.factor.factor(inner.tangent(u, pressure_MPa, self.parameters))
        except IndefiniteError:
            raise ConvergenceError("the equilibrium between plates is not stable") from None
        pulled = stiffness[self._inside] @ modes[model.free]
        modes[inner.free] = -inner.factor.solve(np.ascontiguousarray(pulled))
        plate = modes[self._plate]
        added = plate.T @ (stiffness[self._on_plate] @ modes[model.free])
        on_tip = plate[: 3 * len(self.tip)].reshape(-1, 3, 6)
        turning = np.cross(on_tip.transpose(0, 2, 1), force[:, None, :]).sum(axis=0).T
        gradient = to_twist.T @ wrench
        gradient[:3] += forces[self._turns].sum(axis=0)
        nodal = model.passed_back(u, modes).reshape(-1, 3, 6)
        return PlateState(
            pressure_MPa * 1e3,
            eta,
            gradient,
            added + to_twist[:3].T @ turning + _slope_of_gradient(eta, wrench),
            self._share @ x,
            np.einsum("n,nik->ik", self._share, nodal),
        )

    def free(self, start: Array, eta: Array, pressure_MPa: float) -> tuple[Array, PlateState]:
        """The state whose plate bears no load, from a nearby one u (n, 3) at the logarithm eta (6,).

        By Newton's method on the plate's placement. Raises ConvergenceError.
        """
        u = self.equilibrium.newton(self.carried(start, eta, eta), pressure_MPa).u
        for _ in range(_MOST_STEPS):
            state = self.state(u, eta, pressure_MPa)
            # Symmetric up to the residual of the inside.
            h = (state.hessian + state.hessian.T) / 2
            least = np.linalg.eigvalsh(h / np.outer(1 / self.size, 1 / self.size))[0]
            if least <= 0:
                raise ConvergenceError("the unit with a free tip is not stable")
            step = -np.linalg.solve(h, state.gradient)
            length = np.abs(step / self.size).max()
            if length < _FREE:
                return u, state
            step *= min(1.0, _LONGEST_STEP / length)
            u = self.solved(u, eta, eta + step, pressure_MPa)
            eta = eta + step
        raise ConvergenceError("the free tip's placement did not converge")

    def free_path(
        self,
        pressures_kPa: Array,
        kept: Callable[[float], tuple[Array, PlateState] | None] = lambda p: None,
        keep: Callable[[Array, PlateState], None] = lambda u, state: None,
        step_kPa: float = 2.5,
    ) -> dict[float, tuple[Array, PlateState]]:
        """Free states (u, state) by pressure in kPa, outward from 0.

        kept and keep: a cache; step_kPa: the largest step. Raises ConvergenceError that names the pressure.
        """
        found: dict[float, tuple[Array, PlateState]] = {}
        for side in (pressures_kPa[pressures_kPa >= 0], pressures_kPa[pressures_kPa < 0][::-1]):
            at, u, eta = 0.0, np.zeros_like(self.mesh.nodes), self.rest
            slope_ = np.zeros(6)
            for target in side.tolist():
                known, begun, eta_begun = kept(target), at, eta
                if known is None:
                    count = max(1, int(np.ceil(abs(target - at) / step_kPa)))
                    for p in np.linspace(at, target, count + 1)[1:].tolist():
                        guess = eta + slope_ * (p - at)
                        try:
                            moved = self.carried(u, eta, guess)
                            known = self.free(moved, guess, p / 1e3)
                        except ConvergenceError as error:
                            raise ConvergenceError(
                                f"no free state at {p:g} kPa: {error.what}",
                                f"the last is at {at:g} kPa",
                                "narrow the protocol's pressures, or thicken the wall",
                            ) from None
                        slope_ = (known[1].eta - eta) / (p - at) if p != at else slope_
                        at, (u, eta) = p, (known[0], known[1].eta)
                    assert known is not None
                    keep(*known)
                if target != begun:
                    # As from the cache, which has no steps between: a resumed run ends at the same digits.
                    slope_ = (known[1].eta - eta_begun) / (target - begun)
                at, (u, eta) = target, (known[0], known[1].eta)
                found[target] = known
        return found


def placed(nodes: Array, height: float, eta: Array) -> Array:
    """Displacements (k, 3) of nodes (k, 3) in mm on a plate at eta (6,), at rest at z = height."""
    g = exponential(eta)
    return (nodes - [0.0, 0.0, height]) @ g[:3, :3].T + g[:3, 3] - nodes


def spread(mesh: Mesh, u: Array, station: Array, before: Array, after: Array) -> Array:
    """Displacements u (n, 3) of a mesh advanced as a plate moves from one logarithm (6,) to another.

    station (n,): each node's share, from base 0 to plate 1, of the constant strain of both. Sections of beams
    turn with it.
    """
    g = exponential(station[:, None] * after) @ inverse(exponential(station[:, None] * before))
    found = np.einsum("nij,nj->ni", g[:, :3, :3], mesh.nodes + u) + g[:, :3, 3] - mesh.nodes
    turns = np.unique(mesh.beams[:, 1::2])
    found[turns] = rotation_vector(g[turns, :3, :3] @ rotation(u[turns]))
    return found


def _slope_of_gradient(eta: Array, wrench: Array, step: float = 1e-5) -> Array:
    """Change (6, 6) of slope(eta)^T wrench with eta for a constant wrench (6,), by central differences."""
    size = np.array([1.0, 1.0, 1.0, *([max(1.0, float(np.linalg.norm(eta[3:])))] * 3)])
    moved = eta + step * np.vstack([np.diag(size), -np.diag(size)])
    values = np.einsum("kij,i->kj", slope(moved), wrench)
    return np.asarray(((values[:6] - values[6:]) / (2 * step * size[:, None])).T)


def relative(base: Array, tip: Array) -> Array:
    """Logarithm (..., 6) of a tip's frame (..., 4, 4) as seen from its base's."""
    return logarithm(inverse(base) @ tip)


def frame(turn_deg: float) -> Array:
    """The motion (4, 4) of a turn about z, in degrees."""
    a = np.radians(turn_deg)
    c, s = np.cos(a), np.sin(a)
    return motion(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.zeros(3))
